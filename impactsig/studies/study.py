"""The result of a parameter study, in memory or in a directory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import path
from .._extras import library
from .._showing import Shown, figures
from ..errors import InvalidInput
from ._store import EXTRA, Store

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class Study(Shown):
    """Values of a function on a grid of parameters.

    ``study["name"]`` is an observable as an array: the axes of the grid first, in the order of
    `parameters`, then those of the observable itself. Unknown values are NaN; for integers the
    smallest value of the type, for unsigned ones the largest.

    Attributes
    ----------
    parameters : dict of str to ndarray
        The values on each axis.
    observables : tuple of str
        Names of the observables; "value" if the function gave no names.
    done : ndarray of bool, shape of the grid
        Which cells have been evaluated, including those with errors.
    errors : dict of tuple of int to str
        Error messages of the cells that failed, by their indices on the axes.
    attributes : dict of str to dict
        Attributes of axes and observables, such as their units.
    directory : Path or None
        Folder of the study, or None if it is in memory.

    See Also
    --------
    sweep, open_study, plot.parameter_study

    Examples
    --------
    >>> from impactsig import sweep
    >>> study = sweep(lambda a, b: a * b, {"a": [1, 2], "b": [3, 4, 5]})
    >>> study.observables, float(study["value"][1, 2]), study.errors
    (('value',), 10.0, {})
    """

    parameters: dict[str, np.ndarray]
    observables: tuple[str, ...]
    done: np.ndarray
    errors: dict[tuple[int, ...], str]
    attributes: dict[str, dict[str, Any]]
    directory: Path | None
    _values: Mapping[str, np.ndarray] | Store = field(repr=False)

    @property
    def shape(self) -> tuple[int, ...]:
        """Values on each axis."""
        return tuple(map(len, self.parameters.values()))

    @property
    def complete(self) -> bool:
        """Whether all cells have been evaluated."""
        return bool(self.done.all())

    def __getitem__(self, name: str) -> np.ndarray:
        """An observable on the grid; a stored study reads and verifies it each time.

        Raises
        ------
        InvalidInput
            If there is none of this name.
        UnreadableFile
            If a file was damaged since the study was opened.
        """
        if name not in self.observables:
            raise InvalidInput("observable", name, f"one of {', '.join(self.observables)}")
        return self._values.read(name) if isinstance(self._values, Store) else self._values[name]

    def to_xarray(self) -> xarray.Dataset:
        """All observables as labelled arrays in memory.

        To open a study larger than memory, use
        ``xarray.open_zarr(directory / "results.zarr", consolidated=False)``, which reads on demand.

        Raises
        ------
        MissingExtra
            If xarray is not installed.
        """
        xarray = library("xarray", EXTRA, "A study as labelled arrays")
        axes = list(self.parameters)
        variables = {}
        for name in self.observables:
            values = self[name]
            own = [f"{name}_{n}" for n in range(values.ndim - len(axes))]
            variables[name] = ([*axes, *own], values, self.attributes.get(name, {}))
        coordinates = {
            name: (name, values, self.attributes.get(name, {}))
            for name, values in self.parameters.items()
        }
        return xarray.Dataset(variables, coordinates)

    def plot(self, observable: str | None = None, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw an observable over one or two parameters; see `impactsig.plot.parameter_study`."""
        axes: Axes = figures("parameter_study")(self, observable, ax, **options)
        return axes

    def __repr__(self) -> str:
        axes = ", ".join(f"{name}: {len(values)}" for name, values in self.parameters.items())
        parts = [f"{axes}; {', '.join(self.observables) or 'no observables'}"]
        left = self.done.size - int(self.done.sum())
        if left:
            parts.append(f"{left} of {self.done.size} cells still to do")
        if self.errors:
            parts.append(f"{len(self.errors)} of {self.done.size} cells failed")
        return f"Study({'; '.join(parts)})"


def open_study(directory: Any) -> Study:
    """Open a study that is stored in a directory, finished or not.

    Parameters
    ----------
    directory : path-like
        The directory that was given to `sweep`.

    Returns
    -------
    Study
        The study; cells that have not been evaluated are False in `done`.

    Raises
    ------
    UnreadableFile
        If there is no study.
    MissingExtra
        If zarr is not installed.

    See Also
    --------
    sweep, results.Study, plot.parameter_study

    Examples
    --------
    >>> import tempfile
    >>> from impactsig import open_study, sweep
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     kept = sweep(lambda a: 2 * a, {"a": [1.0, 2.0]}, directory=f"{folder}/study")
    ...     print(open_study(f"{folder}/study")["value"])
    [2. 4.]
    """
    return stored(Store.open(path("directory", directory)))


def stored(store: Store) -> Study:
    """The study that a store holds."""
    grid, tiling = store.tiling.grid, store.tiling
    done = np.zeros(grid.shape, bool)
    for tile in store.done:
        done[tiling.place(tile)] = True
    return Study(
        grid.axes,
        tuple(store.layout.kinds) if store.layout else (),
        done,
        by_indices(store.errors, grid.shape),
        store.attributes(),
        store.directory,
        store,
    )


def by_indices(errors: dict[int, str], shape: tuple[int, ...]) -> dict[tuple[int, ...], str]:
    """Errors by the grid indices of their cells, in order."""
    return {tuple(map(int, np.unravel_index(cell, shape))): errors[cell] for cell in sorted(errors)}
