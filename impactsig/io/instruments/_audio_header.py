"""Headers of audio containers, as far as libsndfile does not report or verify them.

A WAV, AIFF or W64 file that is shorter than its header says is read without a word by libsndfile,
and its decoders for compressed WAV have a history of memory errors. Both are settled here, from
the chunk headers alone, before the library sees the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

from ...errors import UnreadableFile

_UNKNOWN_SIZES = (0, 0xFFFFFFFF)  # what writers to a pipe leave there
_CONVERT = "Convert it to PCM WAV or FLAC, for example with: ffmpeg -i FILE out.wav"
_WAVE_CODECS = {1: "PCM", 3: "float"}
_AIFC_CODECS = frozenset(b"NONE sowt twos in24 in32 fl32 FL32 fl64 FL64".split()) | {b"raw "}


def missing_bytes(path: Path) -> tuple[int, int]:
    """Bytes of samples that the header announces but the file lacks, and the number announced.

    Raises
    ------
    UnreadableFile
        If the file is compressed by a codec that is not allowed, or its chunks make no sense.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        magic = file.read(4)
        if magic in (b"RIFF", b"RIFX", b"RF64"):
            start, declared = _wave(file, path, "big" if magic == b"RIFX" else "little")
        elif magic == b"FORM":
            start, declared = _aiff(file, path)
        elif magic == b"riff":
            start, declared = _wave64(file, path)
        else:
            return 0, 0
    return max(0, start + declared - size), declared


def ends_in_order(path: Path) -> bool:
    """Whether the last page of an Ogg file is marked as the end of its stream."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - 65_536))
        tail = file.read()
    page = tail.rfind(b"OggS")
    # A page of its own is 65 307 bytes at most: one begins in the tail of every sound file.
    return page >= 0 and len(tail) > page + 5 and bool(tail[page + 5] & 4)


def _wave(file: BinaryIO, path: Path, order: str) -> tuple[int, int]:
    """Offset and declared size of the samples of a RIFF, RIFX or RF64 file."""
    position, long_size, coded = 12, None, False
    while True:
        file.seek(position)
        head = file.read(8)
        if len(head) < 8:
            raise UnreadableFile(path, f"has no data chunk in its {position} bytes")
        name, size = head[:4], _number(head[4:], order)
        if name == b"ds64":
            long_size = _number(file.read(16)[8:], order)
        elif name == b"fmt ":
            _check_wave_codec(file.read(min(size, 40)), path, order)
            coded = True
        elif name == b"data":
            if not coded:
                raise UnreadableFile(path, "has no fmt chunk before its data chunk")
            if size == 0xFFFFFFFF and long_size is not None:
                return position + 8, long_size
            return position + 8, 0 if size in _UNKNOWN_SIZES else size
        position += 8 + size + size % 2


def _wave64(file: BinaryIO, path: Path) -> tuple[int, int]:
    """Offset and declared size of the samples of a Sony Wave64 file."""
    position, coded = 40, False
    while True:
        file.seek(position)
        head = file.read(24)
        if len(head) < 24:
            raise UnreadableFile(path, f"has no data chunk in its {position} bytes")
        name, size = head[:4], _number(head[16:], "little")
        if size < 24:
            raise UnreadableFile(path, f"has a chunk of impossible size {size} at byte {position}")
        if name == b"fmt ":
            _check_wave_codec(file.read(min(size - 24, 40)), path, "little")
            coded = True
        elif name == b"data":
            if not coded:
                raise UnreadableFile(path, "has no fmt chunk before its data chunk")
            return position + 24, size - 24
        position += size + -size % 8


def _aiff(file: BinaryIO, path: Path) -> tuple[int, int]:
    """Offset and declared size of the samples of an AIFF or AIFF-C file."""
    file.seek(8)
    compressed = file.read(4) == b"AIFC"
    position, found = 12, None
    while True:
        file.seek(position)
        head = file.read(8)
        if len(head) < 8:
            break
        name, size = head[:4], _number(head[4:], "big")
        if name == b"COMM" and compressed:
            codec = file.read(22)[18:]
            if codec not in _AIFC_CODECS:
                raise UnreadableFile(path, f"is compressed (AIFF-C codec {codec!r})", _CONVERT)
        elif name == b"SSND":
            found = position + 16, size - 8
        position += 8 + size + size % 2
    if found is None:
        raise UnreadableFile(path, "has no sound data chunk")
    return found


def _check_wave_codec(body: bytes, path: Path, order: str) -> None:
    tag = _number(body[:2], order)
    if tag == 0xFFFE:  # extensible: the codec stands in the first bytes of the subformat
        tag = _number(body[24:26], order)
    if tag not in _WAVE_CODECS:
        raise UnreadableFile(path, f"is compressed (WAVE codec 0x{tag:04x})", _CONVERT)


def _number(raw: bytes, order: str) -> int:
    return int.from_bytes(raw, "big" if order == "big" else "little")
