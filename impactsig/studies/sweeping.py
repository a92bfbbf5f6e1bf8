"""`sweep`: evaluate a function on a grid, on any executor, in memory or in a store."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from .._arguments import Seed, choice, flag, instance, streams, thread_count, whole
from .._arguments import function as called
from .._arguments import path as path_of
from .._running.watched import progress as bar
from ..errors import ImpactsigWarning, InvalidInput
from ._cells import Job, Outcome, run_cells
from ._grid import Grid, Tiling, grid_of, tile_shape
from ._identity import identity_of, refuse_other
from ._results import Results
from ._store import Store, claim, locked
from .device import own_threads, parts_of_device
from .executors.gpu import Gpu
from .executors.payload import pack
from .executors.pool import Executor, Serial, Threads
from .executors.processes import Processes
from .fingerprint import code_of
from .study import Study, stored

if TYPE_CHECKING:
    from distributed import Client

TILE_SECONDS = 1.0
"""What a tile should take."""
TRIAL_SECONDS = 0.2
"""What cells are tried for before that is known."""
TILES_PER_WORKER = 4
"""At the least, so that workers end at about the same time."""

Local = Literal["serial", "threads", "processes", "gpu"]


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
    """Evaluate a function on every combination of its parameters.

    The cells of the grid are evaluated in tiles of about a second, in the thread of the caller, on
    threads, on processes, on a dask cluster or on a GPU. A cell depends only on its parameters and
    seed, so that results are the same to the last bit on all executors except the GPU (see Notes).

    With a directory, each tile is stored on disk as soon as it is complete. A study that was
    interrupted, by Ctrl-C or otherwise, continues when it is called again with the same arguments;
    completed tiles are not evaluated again. A worker process that dies is replaced. A cell whose
    function raises (including SystemExit), or kills its worker twice, is missing from the results,
    with its error in `Study.errors`, and the study continues. A KeyboardInterrupt raised by the
    function stops the study like Ctrl-C.

    Parameters
    ----------
    function : callable
        Function of the parameters of a cell, by name, that returns a number, an array, or a dict or
        NamedTuple of these, with the same structure for all cells. Python numbers become float64;
        NumPy numbers and arrays keep their type, except that booleans become int8.
    parameters : mapping of str to array_like, shape (n,)
        The values of every parameter; each is an axis of the grid.
    vectorized : bool
        Whether the function, for example a numba kernel, takes an array of each parameter, shape
        (cells,), and returns arrays of shape (cells, ...). It is then called once per tile.
    directory : path-like, optional
        Folder in which to store the study; by default it is in memory only. Needs
        ``impactsig[studies]``.
    executor : {"serial", "threads", "processes", "gpu"}
        Where cells are evaluated. Threads are for functions that release the global interpreter
        lock, such as `impactsig.simulate` and kernels compiled with ``nogil=True``. A GPU (NVIDIA,
        with ``impactsig[gpu]``) is for functions of one cell that numba can compile.
    workers : int, optional
        Number of threads or processes, by default the number of cores. The result does not depend
        on it.
    client : distributed.Client or str, optional
        Dask client, or address of its scheduler, to use instead of `executor`. Needs
        ``impactsig[studies]``, and the same code on the cluster.
    tile : int, optional
        Greatest number of cells in a tile. By default it is chosen by a trial such that a tile
        takes about a second; a continued study keeps its tiles.
    seed : int, SeedSequence or Generator, optional
        Seed from which a seed of 64 bits is derived for every cell, which the function receives as
        `seed` (a uint64 if compiled by numba, an array of uint64 if `vectorized`). It does not
        depend on tiles and executor.
    attributes : mapping of str to mapping, optional
        Attributes of axes and observables, such as ``{"frequency": {"units": "Hz"}}``, for the
        store, xarray and figures.
    progress : bool, optional
        Whether to show a progress bar; by default only in a terminal or notebook.

    Returns
    -------
    Study

    Raises
    ------
    InvalidInput
        If a parameter has no values, or some are not finite; if the directory contains a study of
        other parameters or other code (the error says which differ) or something else, or another
        sweep is running in it; if the function cannot be sent to other processes, or cannot run on
        a GPU; if there is no cluster, or no GPU.
    UnwritableFile
        If the directory cannot be written, or the disk is full. Completed tiles are kept.
    MissingExtra
        If a library of ``impactsig[studies]`` or ``impactsig[gpu]`` is needed and not there.

    Warns
    -----
    ImpactsigWarning
        If cells failed.

    See Also
    --------
    open_study, simulate_many, plot.parameter_study

    Notes
    -----
    "Other code" is recognised by the bytecode and constants of the function and its callees, by the
    modules of this package that it refers to and all that these import, and by the versions of
    Python, NumPy and the packages that it refers to. What those refer to in turn is not followed,
    nor are files that a function reads. Comments and docstrings do not count.

    On a GPU the function, plain or compiled by ``numba.njit``, runs from the same source, with a
    thread for each cell. It takes numbers and returns a number, or a tuple or NamedTuple of numbers
    or tuples of numbers, all of which become float64 or complex128. Arithmetic is in double
    precision, each operation rounded separately: sums, products, quotients and square roots have
    the same bits as on a CPU. Mathematical functions (sine, exponential, powers...) differ by a few
    units in the last place, which grow in chaotic motions. Studies on GPU and CPU are therefore
    different and cannot share a directory. The error of a cell that raises does not include its
    message; a division by zero does not raise but gives an infinity or NaN.

    Examples
    --------
    >>> from impactsig import sweep
    >>> study = sweep(lambda a, b: a * b, {"a": [1, 2], "b": [3, 4, 5]})
    >>> study["value"]
    array([[ 3.,  4.,  5.],
           [ 6.,  8., 10.]])
    """
    called("function", function, "a function of the parameters of a cell", None)
    units = {} if attributes is None else attributes
    instance("attributes", units, Mapping, "a mapping of names to attributes")  # type: ignore[type-abstract]
    choice("executor", executor, ("serial", "threads", "processes", "gpu"))
    grid = grid_of(parameters, () if seed is None else ("seed",))
    if tile is not None:
        tile = whole("tile", tile, least=1)
    key = None if seed is None else int(streams(seed, 1)[0].integers(2**64, dtype=np.uint64))
    job = Job(function, flag("vectorized", vectorized), key)
    code = code_of(function)
    if executor == "gpu":
        code |= parts_of_device()
    identity = identity_of(job, grid, code)
    with contextlib.ExitStack() as stack:
        store = None
        path = None if directory is None else path_of("directory", directory)
        if path is not None:
            there = claim(path)
            stack.enter_context(locked(path))
            if there:
                store = Store.open(path)
                refuse_other(store, identity, tile)
                store.mend_axes(units)
                if len(store.done) == len(store.tiling):
                    return _warn_of_failures(stored(store))
        pool = stack.enter_context(_executor(job, grid, code, executor, workers, client))
        first = None
        if store is None:
            if tile is None:
                tile, first = _tile_of_a_second(pool, grid)
            tiling = Tiling(grid, tile_shape(grid.shape, tile))
            store = Store.create(path, identity, tiling) if path else None
        else:
            tiling = store.tiling
        run = Results(tiling, store, units)
        if first is not None:
            run.learn(first)
        left = [n for n in range(len(tiling)) if n not in run.done]
        before = grid.size - sum(_cells(tiling, n) for n in left)
        advance = stack.enter_context(bar(grid.size, " cells", progress, done=before))
        for number, task, outcome in pool.run((n, tiling.task(n)) for n in left):
            run.take(number, task, outcome)
            advance(len(task.cells))
        study = run.study()
    return _warn_of_failures(study)


def _executor(
    job: Job,
    grid: Grid,
    code: dict[str, str],
    kind: Local,
    workers: int | None,
    client: Any,
) -> Executor:
    if kind not in get_args(Local):
        raise InvalidInput("executor", kind, f"one of {', '.join(get_args(Local))}")
    threads = thread_count(workers)
    if client is not None:
        if workers is not None or kind != "serial":
            raise InvalidInput(
                "client", client, "no executor or workers beside it", "The cluster has its own"
            )
        from .executors.cluster import Cluster

        return Cluster(client, pack(job, code))
    if kind == "gpu":
        own_threads(workers)
        if job.vectorized:
            raise InvalidInput(
                "vectorized", True, 'False with executor="gpu": it takes a function of one cell'
            )
        return Gpu(job, grid)
    if kind == "processes":
        return Processes(pack(job, code), threads)
    return Serial(job) if kind == "serial" else Threads(partial(run_cells, job), threads)


def _tile_of_a_second(pool: Executor, grid: Grid) -> tuple[int, Outcome | None]:
    """Cells of a tile that takes about a second, by trials spread over the grid.

    The first call may compile, so it is not counted; what it gave, of the first cell, is kept.
    Cells that fail are not counted either.
    """
    least = min(pool.least, grid.size)
    most = max(least, -(-grid.size // (TILES_PER_WORKER * pool.workers)))
    if most <= max(least, TILES_PER_WORKER):
        return least, None
    first, count, each = None, 1, TILE_SECONDS
    for trial in range(20):
        cells = np.unique(np.linspace(0, grid.size - 1, count).astype(int))
        ((_, _, outcome),) = pool.run([(None, grid.task(cells))])
        first = first or outcome
        fair = max(1, len(cells) - len(outcome.errors))
        each = max(outcome.seconds, 1e-9) / fair
        if trial and (outcome.seconds >= TRIAL_SECONDS / 2 or count == grid.size):
            break
        if trial:
            growth = min(max(2.0, TRIAL_SECONDS / max(outcome.seconds, 1e-6)), 16.0)
            count = min(int(count * growth), grid.size)
        else:
            count = least
    return min(max(least, round(TILE_SECONDS / each)), most, pool.most), first


def _cells(tiling: Tiling, number: int) -> int:
    return int(np.prod(tiling.shape(number)))


def _warn_of_failures(study: Study) -> Study:
    """Warn if cells failed; returns the study."""
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
