"""MATLAB 4 (save -v4): matrices one after the other, each behind a header of 20 bytes."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._arrays import Array, Facts, along_time, source_of
from .._limits import Limits
from .._source import Source, sample_type

_HEADER = 20
_PRECISIONS = ("f8", "f4", "i4", "i2", "u2", "u1")
_NUMBERS, _TEXT, _SPARSE = range(3)
_NO_RATE = "The file has no number named fs or dt beside these samples, and no array of times"


class _Matrix(NamedTuple):
    """A matrix: its real part begins at `start`, in column order."""

    name: str
    shape: tuple[int, int]
    dtype: np.dtype
    start: int
    kind: int
    imaginary: bool


def is_mat4(head: bytes) -> bool:
    """Whether a file begins with a plausible header of a MATLAB 4 matrix.

    The type is written in decimal digits: computer, 0, precision, full (0), text (1) or sparse (2).
    """
    return any(_header(head, 0, order) is not None for order in "<>")


def _header(content: bytes, at: int, order: str) -> _Matrix | None:
    """The matrix that begins at a byte; None if there is none."""
    if len(content) < at + _HEADER:
        return None
    code, rows, columns, imaginary, length = struct.unpack_from(order + "5i", content, at)
    computer, zero, precision, kind = code // 1000, code // 100 % 10, code // 10 % 10, code % 10
    # 0 little endian, 1 big endian; those after them are of machines that are gone.
    if code < 0 or computer != "<>".index(order) or zero or precision > 5 or kind > _SPARSE:
        return None
    name = bytes(content[at + _HEADER : at + _HEADER + max(0, length)])
    if min(rows, columns) < 0 or imaginary not in (0, 1) or name[-1:] != b"\0":
        return None
    dtype = np.dtype(order + _PRECISIONS[precision])
    text = name[:-1].decode("latin-1")
    start = at + _HEADER + length
    return _Matrix(text, (rows, columns), dtype, start, kind, bool(imaginary))


def open_source(path: Path, limits: Limits) -> Source:
    """Open a MATLAB 4 file; see `impactsig.io.formats`. Its matrices are mapped."""
    content = np.memmap(path, np.uint8, "r")
    order = "<" if _header(bytes(content[:4096]), 0, "<") is not None else ">"
    facts, notes, truncated = Facts(path), [], ""
    arrays: list[Array] = []
    for matrix in _matrices(content, order):
        if matrix is None or matrix.start + _bytes(matrix) > len(content):
            name = "a variable" if matrix is None else repr(matrix.name)
            truncated = f"{name} is not complete"
            break
        if matrix.kind == _TEXT:
            letters = _numbers(content, matrix).ravel(order="C")[:4096]
            facts.add((), matrix.name, "".join(chr(int(code) & 0xFF) for code in letters))
        elif matrix.kind == _SPARSE or matrix.imaginary:
            what = "is sparse" if matrix.kind == _SPARSE else "holds complex numbers"
            notes.append(f"{matrix.name!r} is left out: it {what}")
        elif matrix.shape == (1, 1):
            facts.add((), matrix.name, _numbers(content, matrix).item())
        else:
            arrays.append(_array(content, matrix))
    return source_of(path, "MATLAB 4", arrays, facts, notes, no_rate=_NO_RATE, truncated=truncated)


def _matrices(content: np.ndarray, order: str) -> Iterator[_Matrix | None]:
    """The matrices in order; None in place of one whose header is invalid."""
    at = 0
    while at < len(content):
        # A name is shorter than this; only so much of the map is copied.
        found = _header(bytes(content[at : at + 4096]), 0, order)
        if found is not None:
            found = found._replace(start=at + found.start)
        yield found
        if found is None:
            return
        at = found.start + _bytes(found)


def _bytes(matrix: _Matrix) -> int:
    rows, columns = matrix.shape
    return rows * columns * matrix.dtype.itemsize * (2 if matrix.imaginary else 1)


def _numbers(content: np.ndarray, matrix: _Matrix) -> np.ndarray:
    return np.ndarray(
        matrix.shape, matrix.dtype, content[matrix.start : matrix.start + _bytes(matrix)], order="F"
    )


def _array(content: np.ndarray, matrix: _Matrix) -> Array:
    def read(columns: list[int], first: int, last: int) -> np.ndarray:
        # A copy: a map of the file is not to outlive this.
        return np.array(
            along_time(_numbers(content, matrix))[first:last, columns], sample_type(matrix.dtype)
        )

    rows, columns = matrix.shape
    shape = (max(rows, columns),) if min(rows, columns) == 1 else matrix.shape
    return Array((matrix.name,), shape, matrix.dtype, read)
