"""HDF5 and MATLAB 7.3: datasets named "group/dataset", with numbered columns."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import Array, Facts, Place, bytes_of, fact, source_of, unusable
from .._limits import Limits
from .._source import Source, sample_type
from ._chunks import Chunks
from ._objects import attributes, check_size, members
from ._texts import Texts

MATLAB = b"MATLAB 7.3 MAT-file"
_NO_RATE = (
    "The file has no attribute or number named rate, fs or dt beside these samples, and no time"
)


def open_source(path: Path, limits: Limits) -> Source:
    """Open an HDF5 file; see `impactsig.io.formats`."""
    import h5py

    with path.open("rb") as head:
        matlab = head.read(len(MATLAB)) == MATLAB
    # No lock: the file is only read, and may lie where locks cannot be had.
    file = h5py.File(path, "r", locking=False)
    try:
        arrays, facts, notes = _arrays(path, file, limits, matlab)
        return source_of(
            path,
            "MATLAB 7.3" if matlab else "HDF5",
            arrays,
            facts,
            notes,
            separator="." if matlab else "/",
            no_rate=_NO_RATE,
            close=file.close,
        )
    except BaseException:
        file.close()
        raise


def _arrays(
    path: Path, file: Any, limits: Limits, matlab: bool
) -> tuple[list[Array], Facts, list[str]]:
    """Datasets that can be signals, facts about them, and notes on what is left out."""
    import h5py

    arrays: list[Array] = []
    facts, notes, texts = Facts(path), [], Texts(path)
    for name, value in attributes(file, texts):
        facts.add((), name, value)
    for place, item, refused in members(path, file, matlab):
        shown = "/".join(place)
        if refused:
            notes.append(f"{shown!r} is left out: it {refused}")
            continue
        for name, value in attributes(item, texts):
            facts.add(place, name, value)
        if not isinstance(item, h5py.Dataset):
            continue
        if item.shape is None:
            continue
        if item.size == 1 or _is_text(item):
            _collect_fact(path, facts, place, item, texts)
        elif item.dtype.names and len(item.shape) == 1:
            if reason := check_size(path, item, limits):
                notes.append(f"{shown!r} is left out: it {reason}")
            else:
                arrays += _table(path, place, item, limits)
        elif reason := _not_numbers(item) or check_size(path, item, limits):
            notes.append(f"{shown!r} is left out: it {reason}")
        else:
            arrays.append(Array(place, item.shape, item.dtype, _reader(path, item, limits)))
    for doubt in texts.doubts:
        notes.append(f"units and names in HDF5 heaps are not read: these {doubt}")
    return arrays, facts, notes


def _not_numbers(dataset: Any) -> str:
    if dataset.dtype.kind == "O":
        return "holds text, references or arrays of different lengths"
    return unusable(dataset.shape, dataset.dtype)


def _is_text(dataset: Any) -> bool:
    """Whether a dataset is a MATLAB text, which is stored as an array of 16-bit codes."""
    if dataset.dtype.kind != "u" or "MATLAB_class" not in dataset.attrs:
        return False
    kind = dataset.attrs.get_id("MATLAB_class").dtype.kind  # MATLAB's own stand in no heap
    return kind == "S" and dataset.attrs["MATLAB_class"] == b"char"


def _collect_fact(path: Path, facts: Facts, place: Place, dataset: Any, texts: Texts) -> None:
    """Record a single number or a text, if it is a fact about the arrays beside it."""
    if fact(place[-1]) is None or bytes_of(dataset.shape, dataset.dtype) > 4096:
        return
    Chunks(path, dataset).check()
    value: Any = None
    if _is_text(dataset):
        value = "".join(chr(code) for code in dataset[()].ravel())
    elif dataset.dtype.kind == "O":
        value = texts.dataset(dataset)
    elif dataset.dtype.kind in "biufS":
        value = dataset[()]
    if value is not None:
        value = value.reshape(-1)[0] if isinstance(value, np.ndarray) else value
        facts.add(place[:-1], place[-1], value)


def _table(path: Path, place: Place, dataset: Any, limits: Limits) -> list[Array]:
    """The columns of a table, which HDF5 stores as rows of fields."""
    return [
        Array((*place, name), dataset.shape, dtype, _reader(path, dataset, limits, name))
        for name, (dtype, *_) in dataset.dtype.fields.items()
        if dtype.kind in "biuf" and not dtype.shape
    ]


def _reader(
    path: Path, dataset: Any, limits: Limits, field: str | None = None
) -> Callable[[list[int], int, int], np.ndarray]:
    """Reads a part of a dataset, of which time runs along the longer axis."""
    shape, packed, chunks = dataset.shape, dataset.chunks is not None, Chunks(path, dataset)
    width = np.dtype(sample_type(dataset.dtype)).itemsize if field is None else 8

    def read(columns: list[int], first: int, last: int) -> np.ndarray:
        low, high = min(columns), max(columns) + 1
        if packed:
            limits.check(path, (last - first) * (high - low) * width)
        tall = shape[0] >= shape[-1]
        spans = [(first, last), (low, high)] if tall else [(low, high), (first, last)]
        chunks.check(spans[: len(shape)])
        if len(shape) == 1:
            part = dataset[first:last] if field is None else dataset.fields(field)[first:last]
            return part[:, np.newaxis]
        part = dataset[first:last, low:high] if tall else dataset[low:high, first:last].T
        whole = columns == list(range(low, high))
        return part if whole else part[:, [column - low for column in columns]]

    return read
