"""One parameter study: cells in tiles, on any executor, into memory or a store that resumes."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .._arguments import Seed, streams, whole
from ..errors import ImpactsigWarning, InvalidInput
from ._cells import Job, Outcome, name_of, run_cells
from ._fingerprint import code_of, digest
from ._grid import Grid, Task, Tiling, grid_of, tile_shape
from ._layout import Layout
from ._payload import pack
from ._pool import Serial, Threads
from ._processes import Processes
from ._progress import progress as bar
from ._store import Store, claim
from .study import Study, by_indices, stored

if TYPE_CHECKING:
    from distributed import Client

TILE_SECONDS = 1.0
"""What a tile should take."""
TRIAL_SECONDS = 0.2
"""What cells are tried for before that is known."""
TILES_PER_WORKER = 4
"""At the least, so that workers end at about the same time."""

Local = Literal["serial", "threads", "processes"]


def sweep(
    function: Callable[..., Any],
    parameters: Mapping[str, Any],
    *,
    vectorized: bool = False,
    directory: Any = None,
    executor: Local = "serial",
    workers: int | None = None,
    client: Client | str | None = None,
    tile: int | None = None,
    seed: Seed = None,
    attributes: Mapping[str, Mapping[str, Any]] | None = None,
    progress: bool | None = None,
) -> Study:
    """Call a function on every combination of its parameters.

    The cells of the grid are worked out in tiles of about a second, in the caller's thread, on
    threads, on processes or on a dask cluster. A cell depends on nothing but its parameters and
    seed, so the results are the same, to the last bit, on all of them.

    With a directory each tile is on disk as soon as it is done. A study that is killed at any
    instant, or stopped by Ctrl-C, goes on when it is called again with the same arguments: tiles
    that are done are not worked out again. A worker process that dies is replaced. A cell whose
    function raises, or kills its worker twice, is missing from the results with its error in
    `Study.errors`, and the study goes on.

    Parameters
    ----------
    function : callable
        Takes the parameters of a cell by name and returns a number, an array, or a dict or
        NamedTuple of such, alike for all cells. Python's numbers become float64; NumPy's and
        arrays keep their type, but that truth values become int8.
    parameters : mapping of str to array_like, shape (n,)
        The values of every parameter, an axis of the grid each.
    vectorized : bool
        The function, a numba kernel for example, takes an array of each parameter, shape
        (cells,), and returns arrays of shape (cells, ...): it is called once a tile.
    directory : path-like, optional
        Where to keep the study; in memory only by default. Needs ``impactsig[studies]``.
    executor : {"serial", "threads", "processes"}
        Where cells are worked out. Threads are for functions that let go of the interpreter, such
        as `impactsig.simulate` and kernels compiled with ``nogil=True``.
    workers : int, optional
        Threads or processes; as many as there are cores by default.
    client : distributed.Client or str, optional
        Work on this dask cluster, or on that of the scheduler at this address, in place of
        `executor`. Needs ``impactsig[studies]`` here, and the same code there.
    tile : int, optional
        Cells in a tile, at most. By default cells are tried to see how many take about a second;
        a study that is taken up again keeps its tiles.
    seed : int, SeedSequence or Generator, optional
        Makes a seed for every cell, a whole number of 64 bits that the function receives as
        `seed` (an array of uint64 if `vectorized`): the same for the same cell, whatever the tiles
        and the executor.
    attributes : mapping of str to mapping, optional
        What to say of axes and observables, such as ``{"frequency": {"units": "Hz"}}``; it goes
        into the store, into xarray and onto figures.
    progress : bool, optional
        Whether to show how far it is and the time remaining; by default where a terminal or
        notebook is watching.

    Returns
    -------
    Study

    Raises
    ------
    InvalidInput
        If a parameter has no values, or some that are no finite numbers; if the directory holds a
        study of other parameters or other code (it says which differ) or something else; if the
        function cannot be sent to other processes; if there is no cluster.
    UnwritableFile
        If the directory cannot be written, or the disk is full. What is done is kept.
    MissingExtra
        If a library of ``impactsig[studies]`` is needed and not there.

    Warns
    -----
    ImpactsigWarning
        If cells failed.

    Notes
    -----
    "Other code" is told by the bytecode and constants of the function and of what it calls, by the
    sources of this package, and by the versions of Python, NumPy and the packages that it refers
    to. What those refer to in turn is not followed, nor are files that a function reads.

    Examples
    --------
    >>> study = sweep(lambda a, b: a * b, {"a": [1, 2], "b": [3, 4, 5]})
    >>> study["value"]
    array([[ 3.,  4.,  5.],
           [ 6.,  8., 10.]])
    """
    if not callable(function):
        raise InvalidInput("function", function, "a function of the parameters of a cell")
    grid = grid_of(parameters, () if seed is None else ("seed",))
    if tile is not None:
        tile = whole("tile", tile, least=1)
    key = None if seed is None else int(streams(seed, 1)[0].integers(2**64, dtype=np.uint64))
    job = Job(function, bool(vectorized), key)
    code = code_of(function)
    identity = _identity(job, grid, code)
    path = None if directory is None else Path(directory)
    store = None
    if path is not None and claim(path):
        store = Store.open(path)
        _compare(store, identity, tile)
        if len(store.done) == len(store.tiling):
            return _told(stored(store))
    with _executor(job, code, executor, workers, client) as pool:
        if store is None:
            block = tile_shape(grid.shape, tile or _tile_of_a_second(pool, grid))
            tiling = Tiling(grid, block)
            store = Store.create(path, identity, tiling) if path else None
        else:
            tiling = store.tiling
        run = _Run(tiling, store, attributes or {})
        left = [n for n in range(len(tiling)) if n not in run.done]
        before = grid.size - sum(_cells(tiling, n) for n in left)
        with bar(grid.size, before, progress) as advance:
            for number, task, outcome in pool.run((n, tiling.task(n)) for n in left):
                run.take(number, task, outcome)
                advance(len(task.cells))
    return _told(run.study())


class _Run:
    """Where outcomes go: into the store, or into arrays."""

    def __init__(
        self, tiling: Tiling, store: Store | None, attributes: Mapping[str, Mapping[str, Any]]
    ) -> None:
        self.tiling, self.store, self.attributes = tiling, store, attributes
        self.layout = store.layout if store else None
        self.done = store.done if store else set()
        self.arrays: dict[str, np.ndarray] = {}
        self.errors: dict[int, str] = {}
        self.held: dict[int, tuple[Task, Outcome]] = {}

    def take(self, number: int, task: Task, outcome: Outcome) -> None:
        """Keep what came of a tile.

        Until it is known what the first cell that succeeds gives, tiles are held back.
        """
        self.held[number] = task, outcome
        if self.layout is None:
            self._find_layout()
        if self.layout is not None:
            for one in list(self.held):
                self._keep(one, *self.held.pop(one), self.layout)

    def _find_layout(self) -> None:
        for number in range(len(self.tiling)):
            if number in self.done:
                continue
            if number not in self.held:
                return
            task, outcome = self.held[number]
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
        """The study, all tiles done."""
        if self.store is not None:
            self.store.tidy()
            return stored(self.store)
        grid = self.tiling.grid
        return Study(
            grid.axes,
            tuple(self.arrays),
            np.ones(grid.shape, bool),
            by_indices(self.errors, grid.shape),
            {name: dict(told) for name, told in self.attributes.items()},
            None,
            self.arrays,
        )


def _identity(job: Job, grid: Grid, code: dict[str, str]) -> dict[str, Any]:
    """What makes a study the same study."""
    return {
        "function": name_of(job.function),
        "vectorized": job.vectorized,
        "seed": job.key,
        "parameters": {
            name: f"{_brief(values)} ({values.dtype}, {digest(values.tobytes())})"
            for name, values in grid.axes.items()
        },
        "order": list(grid.axes),
        "code": code,
    }


def _brief(values: np.ndarray) -> str:
    if len(values) == 1:
        return f"{values[0]:.12g}"
    return f"{len(values)} values from {values[0]:.12g} to {values[-1]:.12g}"


def _compare(store: Store, identity: dict[str, Any], tile: int | None) -> None:
    """Refuse to go on with another study, and say what makes it another."""
    other = []
    then, now = store.identity, identity
    for kind in ("parameters", "code"):
        for name in sorted(then[kind].keys() | now[kind].keys()):
            before, after = then[kind].get(name), now[kind].get(name)
            if before == after:
                continue
            if kind == "code":
                told = "changed" if before and after else "no longer used" if before else "new"
                versions = (before, after)
                if before and after and max(map(len, versions)) < 32:
                    told = f"{before} there, {after} here"
                other.append(f"code: {name} ({told})")
            else:
                there, here = ((one or "none").rpartition(" (")[0] or "none" for one in (before, after))
                told = "other values" if there == here else f"{there} there, {here} here"
                other.append(f"{name} ({told})")
    for name in ("function", "vectorized", "seed"):
        if then[name] != now[name]:
            other.append(f"{name} ({then[name]} there, {now[name]} here)")
    if not other and then["order"] != now["order"]:
        other.append(f"order of parameters ({', '.join(then['order'])} there)")
    if tile is not None and store.tiling.block != tile_shape(store.tiling.grid.shape, tile):
        other.append(f"tile (blocks of {store.tiling.block} there)")
    if other:
        raise InvalidInput(
            "directory",
            store.directory,
            f"the directory of this very study; in it differ: {'; '.join(other)}",
            "Give another directory, or call as before to go on with that study",
        )


def _executor(job: Job, code: dict[str, str], kind: Local, workers: int | None, client: Any) -> Any:
    if kind not in ("serial", "threads", "processes"):
        raise InvalidInput("executor", kind, '"serial", "threads" or "processes"')
    if workers is not None:
        workers = whole("workers", workers, least=1)
    if client is not None:
        if workers is not None or kind != "serial":
            raise InvalidInput(
                "client", client, "no executor or workers beside it", "The cluster has its own"
            )
        from ._cluster import Cluster

        return Cluster(client, pack(job, code))
    workers = workers or os.cpu_count() or 1
    if kind == "processes":
        return Processes(pack(job, code), workers)
    return Serial(job) if kind == "serial" else Threads(partial(run_cells, job), workers)


def _tile_of_a_second(pool: Any, grid: Grid) -> int:
    """How many cells to a tile, from trials of some that are spread over the grid.

    The first call may compile, so it is not counted. Cells that fail are not counted either.
    """
    most = -(-grid.size // (TILES_PER_WORKER * pool.workers))
    if most <= TILES_PER_WORKER:
        return 1
    count, each = 1, TILE_SECONDS
    for trial in range(20):
        cells = np.unique(np.linspace(0, grid.size - 1, count).astype(int))
        ((_, _, outcome),) = pool.run([(None, grid.task(cells))])
        fair = max(1, len(cells) - len(outcome.errors))
        each = max(outcome.seconds, 1e-9) / fair
        if trial and (outcome.seconds >= TRIAL_SECONDS / 2 or count == grid.size):
            break
        if trial:
            growth = min(max(2.0, TRIAL_SECONDS / max(outcome.seconds, 1e-6)), 16.0)
            count = min(int(count * growth), grid.size)
    return min(max(1, round(TILE_SECONDS / each)), most)


def _cells(tiling: Tiling, number: int) -> int:
    return int(np.prod(tiling.shape(number)))


def _told(study: Study) -> Study:
    """Say that cells failed, if some did."""
    if study.errors:
        place, text = next(iter(study.errors.items()))
        where = ", ".join(
            f"{name} = {values[index]:.12g}"
            for (name, values), index in zip(study.parameters.items(), place, strict=True)
        )
        warnings.warn(
            f"{len(study.errors)} of {study.done.size} cells failed; the first, at {where}: {text}",
            ImpactsigWarning,
            stacklevel=3,
        )
    return study
