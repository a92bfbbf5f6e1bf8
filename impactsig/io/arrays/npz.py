"""NumPy .npz: arrays of one length are channels; a number named rate or fs is the rate."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...errors import UnreadableFile
from .._arrays import Array, Facts, along_time, fact, source_of, unusable
from .._limits import Limits
from .._source import Source
from .npy import NO_RATE, ArrayHeader, read_array_header


def open_source(path: Path, limits: Limits) -> Source:
    """Open an archive of arrays; see `impactsig.io.formats`.

    An array named as times (time, t, ...) gives the rate of the arrays that are as long.
    """
    with zipfile.ZipFile(path) as archive:
        headers = _headers(path, archive)
    facts = Facts(path)
    arrays, notes = [], []
    for name, header in headers.items():
        if header.shape in ((), (1,)):
            if fact(name) in ("rate", "step", "start") and header.dtype.kind in "iuf":
                facts.add((), name, float(_load(path, name).reshape(-1)[0]))
        elif reason := unusable(header.shape, header.dtype):
            notes.append(f"array {name!r} is left out: it {reason}")
        else:
            reader = _reader(path, name)
            arrays.append(Array((name,), header.shape, header.dtype, reader))
    # Each may be loaded, and all of them are held.
    total = sum(headers[array.place[0]].bytes for array in arrays)
    limits.check(path, total, at_once=True)
    return source_of(
        path,
        "NumPy npz",
        arrays,
        facts,
        notes,
        no_rate=f"{NO_RATE}, and no scalar named fs or rate",
        in_memory=True,
    )


def _headers(path: Path, archive: zipfile.ZipFile) -> dict[str, ArrayHeader]:
    """Header of every array by its name."""
    headers = {}
    for entry in archive.infolist():
        if not entry.filename.endswith(".npy"):
            continue
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise UnreadableFile(
                path,
                f"{entry.filename} is packed in a way that NumPy does not use "
                f"(number {entry.compress_type})",
                "Write it with numpy.savez or savez_compressed",
            )
        with archive.open(entry) as file:
            header = read_array_header(file)  # type: ignore[arg-type]
        if header.offset + header.bytes != entry.file_size and not header.dtype.hasobject:
            raise UnreadableFile(
                path,
                f"{entry.filename} announces {header.bytes} bytes of numbers and has "
                f"{entry.file_size - header.offset}",
            )
        headers[entry.filename.removesuffix(".npy")] = header
    return headers


def _reader(path: Path, name: str) -> Callable[[list[int], int, int], np.ndarray]:
    """A reader that loads the array at its first use and keeps it."""
    held: list[np.ndarray] = []

    def read(columns: list[int], first: int, last: int) -> np.ndarray:
        if not held:
            held.append(along_time(_load(path, name)))
        return held[0][first:last, columns]

    return read


def _load(path: Path, name: str) -> np.ndarray:
    with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as file:
        return np.lib.format.read_array(file, allow_pickle=False)
