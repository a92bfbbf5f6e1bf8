"""Collect the outcomes of tiles, in a store or in arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ._cells import Outcome
from ._grid import Task, Tiling
from ._layout import Layout
from ._store import Store
from .study import Study, by_indices, stored


class Results:
    """Collects the outcomes of tiles, in a store or in arrays."""

    def __init__(
        self, tiling: Tiling, store: Store | None, attributes: Mapping[str, Mapping[str, Any]]
    ) -> None:
        self.tiling, self.store, self.attributes = tiling, store, attributes
        self.layout = store.layout if store else None
        self.done = store.done if store else set()
        self.arrays: dict[str, np.ndarray] = {}
        self.errors: dict[int, str] = {}
        self.held: dict[int, tuple[Task, Outcome]] = {}
        self.first = 0  # tile of which no layout is known

    def learn(self, trial: Outcome) -> None:
        """Fix the layout by the outcome of a first cell, if it succeeded."""
        self.layout = Layout.of(trial, self.tiling.grid)
        if self.layout is not None:
            self._lay_out(self.layout)

    def take(self, number: int, task: Task, outcome: Outcome) -> None:
        """Keep the outcome of a tile.

        Until it is known what the first cell that succeeds gives, tiles are held back.
        """
        self.held[number] = task, outcome
        if self.layout is None:
            self._find_layout()
        if self.layout is not None:
            for one in list(self.held):
                self._keep(one, *self.held.pop(one), self.layout)

    def _find_layout(self) -> None:
        for number in range(self.first, len(self.tiling)):
            self.first = number  # 1e5 tiles may fail before one that does not
            if number in self.done:
                continue
            if number not in self.held:
                return
            _, outcome = self.held[number]
            self.layout = Layout.of(outcome, self.tiling.grid)
            if self.layout is not None:
                self._lay_out(self.layout)
                return
            self._keep(number, *self.held.pop(number), Layout({}))

    def _lay_out(self, layout: Layout) -> None:
        if self.store is not None:
            self.store.lay_out(layout, self.attributes)
            return
        nothing = layout.conform(Outcome([], {}, 0.0), self.tiling.grid.task(np.arange(1)))[0]
        for name, one in nothing.items():
            shape = self.tiling.grid.shape + one.shape[1:]
            self.arrays[name] = np.full(shape, one.flat[0], one.dtype)

    def _keep(self, number: int, task: Task, outcome: Outcome, layout: Layout) -> None:
        arrays, errors = layout.conform(outcome, task)
        self.done.add(number)
        if self.store is not None:
            self.store.write(number, arrays, errors)
            return
        self.errors |= errors
        for name, values in arrays.items():
            shape = self.tiling.shape(number) + values.shape[1:]
            self.arrays[name][self.tiling.place(number)] = values.reshape(shape)

    def study(self) -> Study:
        """The finished study."""
        if self.store is not None:
            self.store.tidy()
            return stored(self.store)
        grid = self.tiling.grid
        return Study(
            grid.axes,
            tuple(self.arrays),
            np.ones(grid.shape, bool),
            by_indices(self.errors, grid.shape),
            {name: dict(values) for name, values in self.attributes.items()},
            None,
            self.arrays,
        )
