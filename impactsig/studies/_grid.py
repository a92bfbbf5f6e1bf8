"""The cells of a study in C order (the last axis fastest), and their division into tiles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidInput


class Task(NamedTuple):
    """Some cells: their numbers on the grid, and arrays of their parameters."""

    cells: np.ndarray
    columns: dict[str, np.ndarray]

    def part(self, first: int, last: int) -> Task:
        """Select some of the cells."""
        columns = {name: column[first:last] for name, column in self.columns.items()}
        return Task(self.cells[first:last], columns)


@dataclass(frozen=True)
class Grid:
    """Every combination of the values on the axes."""

    axes: dict[str, np.ndarray]

    @property
    def shape(self) -> tuple[int, ...]:
        """Values on each axis."""
        return tuple(map(len, self.axes.values()))

    @property
    def size(self) -> int:
        """Cells."""
        return prod(self.shape)

    def task(self, cells: np.ndarray) -> Task:
        """Cells by their numbers."""
        places = np.unravel_index(cells, self.shape)
        columns = {
            name: values[place]
            for (name, values), place in zip(self.axes.items(), places, strict=True)
        }
        return Task(cells, columns)


@dataclass(frozen=True)
class Tiling:
    """A grid divided into blocks of one shape, smaller at the far ends, in C order."""

    grid: Grid
    block: tuple[int, ...]

    @property
    def counts(self) -> tuple[int, ...]:
        """Tiles along each axis."""
        shape = self.grid.shape
        return tuple(-(-n // b) for n, b in zip(shape, self.block, strict=True))

    def __len__(self) -> int:
        return prod(self.counts)

    def place(self, tile: int) -> tuple[slice, ...]:
        """Slices of the grid that a tile covers."""
        corner = np.unravel_index(tile, self.counts)
        return tuple(
            slice(int(k) * b, min((int(k) + 1) * b, n))
            for k, b, n in zip(corner, self.block, self.grid.shape, strict=True)
        )

    def shape(self, tile: int) -> tuple[int, ...]:
        """Shape of a tile."""
        return tuple(part.stop - part.start for part in self.place(tile))

    def task(self, tile: int) -> Task:
        """The cells of a tile."""
        ranges = [np.arange(part.start, part.stop) for part in self.place(tile)]
        cells = np.ravel_multi_index(np.ix_(*ranges), self.grid.shape)
        return self.grid.task(cells.ravel())


def tile_shape(shape: tuple[int, ...], cells: int) -> tuple[int, ...]:
    """Blocks of at most so many cells: parts of a row, else whole rows, else whole planes..."""
    block = []
    for length in reversed(shape):
        pieces = -(-length // max(1, min(length, cells)))
        block.append(-(-length // pieces))  # all about equally long
        cells //= block[-1]
    return tuple(reversed(block))


def grid_of(parameters: Any, reserved: tuple[str, ...] = ()) -> Grid:
    """The grid of these values.

    Raises
    ------
    InvalidInput
        If an axis is empty, not one-dimensional, or holds what is no finite number; or has no name
        that a function could have for a parameter.
    """
    if not isinstance(parameters, Mapping) or not parameters:
        raise InvalidInput(
            "parameters", parameters, "a mapping from a parameter's name to its values"
        )
    axes = {}
    for name, given in parameters.items():
        if not isinstance(name, str) or not name.isidentifier() or name in reserved:
            raise InvalidInput("parameters", name, "the name of a parameter of the function")
        try:
            values = np.array(given)
        except ValueError:
            values = np.array(None)
        numeric = values.ndim == 1 and values.dtype.kind in "iuf"
        if not numeric or not len(values) or not np.isfinite(values).all():
            raise InvalidInput(
                f"parameters[{name!r}]", given, "one or more finite numbers, in one dimension"
            )
        if values.dtype.kind == "f":
            values = values.astype(np.float64)
        values.flags.writeable = False
        axes[name] = values
    return Grid(axes)
