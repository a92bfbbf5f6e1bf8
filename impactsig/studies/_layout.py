"""Names, types and shapes of a study's observables, fixed by the first successful cell.

"First" is meant by number, not by time, so that it does not depend on tiles or executor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidInput
from ._cells import Outcome, Signature, signature
from ._grid import Grid, Task


class Kind(NamedTuple):
    """Type and shape of one observable of one cell."""

    dtype: np.dtype
    shape: tuple[int, ...]


def missing(dtype: np.dtype) -> Any:
    """Value of a missing result: NaN; for integers the least, for unsigned ones the greatest."""
    if dtype.kind in "fc":
        return dtype.type(np.nan)
    limits = np.iinfo(dtype)
    return dtype.type(limits.max if dtype.kind == "u" else limits.min)


@dataclass(frozen=True)
class Layout:
    """The observables of every cell, by name."""

    kinds: dict[str, Kind]

    @classmethod
    def of(cls, outcome: Outcome, grid: Grid) -> Layout | None:
        """The layout of the first cell that succeeded; None if none did.

        Raises
        ------
        InvalidInput
            If an observable has the name of a parameter.
        """
        if not outcome.groups:
            return None
        _, found = min(outcome.groups, key=lambda group: group[0][0])
        kinds = {name: Kind(array.dtype, array.shape[1:]) for name, array in found.items()}
        for name in kinds:
            if name in grid.axes:
                raise InvalidInput("function", name, "observables named otherwise than parameters")
        return cls(kinds)

    def dimensions(self, name: str, grid: Grid) -> list[str]:
        """Names of an array's axes: those of the grid, then the observable's own."""
        return [*grid.axes, *(f"{name}_{n}" for n in range(len(self.kinds[name].shape)))]

    def conform(self, outcome: Outcome, task: Task) -> tuple[dict[str, np.ndarray], dict[int, str]]:
        """Arrays with a place for each cell of the task, and the errors of those left missing."""
        count = len(task.cells)
        arrays = {
            name: np.full((count, *kind.shape), missing(kind.dtype), kind.dtype)
            for name, kind in self.kinds.items()
        }
        errors = dict(outcome.errors)
        for positions, found in outcome.groups:
            alike = {name: array[0] for name, array in found.items()}
            if not self._fits(alike):
                gave, first = _in_words(signature(alike)), _in_words(self._own)
                text = f"gave {gave} where the first cell gave {first}"
                errors |= dict.fromkeys(task.cells[positions].tolist(), text)
                continue
            for name, array in found.items():
                arrays[name][positions] = array
        return arrays, dict(sorted(errors.items()))

    def _fits(self, found: dict[str, np.ndarray]) -> bool:
        return found.keys() == self.kinds.keys() and all(
            array.shape == self.kinds[name].shape
            and np.can_cast(array.dtype, self.kinds[name].dtype)
            for name, array in found.items()
        )

    @property
    def _own(self) -> Signature:
        return tuple((name, kind.dtype.str, kind.shape) for name, kind in self.kinds.items())

    def to_json(self) -> list[Any]:
        """As lists, to be stored."""
        return [list(one) for one in self._own]

    @classmethod
    def from_json(cls, stored: list[Any]) -> Layout:
        """What `to_json` gave."""
        return cls({name: Kind(np.dtype(kind), tuple(shape)) for name, kind, shape in stored})


def _in_words(own: Signature) -> str:
    return ", ".join(f"{name}: {np.dtype(kind).name} {shape}" for name, kind, shape in own)
