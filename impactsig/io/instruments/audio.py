"""Audio containers, read by libsndfile: WAV, FLAC, OGG (Vorbis, Opus, FLAC), AIFF, W64, RF64."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source
from ._audio_header import _CONVERT, ends_in_order, missing_bytes

_SINGLE = frozenset(("PCM_S8", "PCM_U8", "PCM_16", "FLOAT", "VORBIS", "OPUS"))
_DOUBLE = frozenset(("PCM_24", "PCM_32", "DOUBLE"))
_COUNTABLE = 1 << 48  # more frames than this are no length but a sign that none was written
_STEP = 1 << 20


def open_source(path: Path, limits: Limits) -> Source:
    """Open an audio file; see `impactsig.io.formats`."""
    import soundfile

    lacking, declared = missing_bytes(path)
    # As bytes: soundfile takes names in UTF-8 only, and other systems have other names.
    file = soundfile.SoundFile(path if sys.platform == "win32" else os.fsencode(path))
    try:
        if file.subtype not in _SINGLE | _DOUBLE:
            raise UnreadableFile(path, f"is compressed ({file.subtype})", _CONVERT)
        dtype = "float32" if file.subtype in _SINGLE else "float64"
        frames = file.frames if 0 < file.frames < _COUNTABLE else _count(file)
        packed = file.format in ("FLAC", "OGG")
        if file.format == "OGG" and not ends_in_order(path):
            truncated = "the last page of its stream is missing"
        elif lacking:
            truncated = f"{lacking} of the {declared} bytes of samples in its header are missing"
        else:
            truncated = ""
        count = file.channels
        names = ("",) if count == 1 else tuple(f"channel {i}" for i in range(count))
        rate = float(file.samplerate)
    except BaseException:
        file.close()
        raise

    def read(channels: list[int], first: int, last: int) -> np.ndarray:
        if packed:
            limits.check(path, (last - first) * count * np.dtype(dtype).itemsize)
        try:
            if file.tell() != first:
                file.seek(first)
            samples = file.read(last - first, dtype=dtype, always_2d=True)
        except soundfile.LibsndfileError as error:
            raise UnreadableFile(
                path,
                f"cannot be decoded between samples {first} and {last} ({error})",
                "It is cut short or corrupt; the part before may be read with stop=",
            ) from error
        return samples if len(channels) == count else samples[:, channels]

    return Source(
        format=file.format if file.format != "WAVEX" else "WAV",
        signals=tuple(Signal(name, "", rate, frames) for name in names),
        read=read,
        close=file.close,
        audio=True,
        truncated=truncated,
        metadata=file.copy_metadata(),
    )


def _count(file: Any) -> int:
    """Number of frames of a stream whose header omits it, by reading through."""
    frames = 0
    while step := len(file.read(_STEP, dtype="float32")):
        frames += step
    file.seek(0)
    return frames
