"""What a sweep costs beside the cells themselves, at tiles of one second, on every executor.

A tile sleeps for a second, so that what is measured is the waiting that the sweep adds, on a busy
machine too; what it computes is told beside it, as processor time. Each study is kept on disk.
Start-up (of processes, for dask too) is the wall time of a study of one tile a worker, less its
second; it is paid once and told apart. Writes results/sweeps.json and sweeps.md.

    python -m benchmarks.sweeps
"""

from __future__ import annotations

import logging
import tempfile
import time
from pathlib import Path

import numpy as np

from impactsig import sweep

from .detection import markdown
from .saving import save, versions

CELLS = 1000
"""Cells of a tile."""
TILES = 12
"""Tiles for each worker."""
WORKERS = 2
TARGET = 0.05


def a_second(a, b):
    """A tile."""
    time.sleep(1.0)
    return {"one": np.sin(a * b), "two": np.cos(a + b)}


def timed(tiles, options):
    """Wall and processor time of a study of so many tiles [s]."""
    axes = {"a": np.arange(float(tiles)), "b": np.linspace(0, 1, CELLS)}
    with tempfile.TemporaryDirectory() as folder:
        wall, own = time.perf_counter(), time.process_time()
        sweep(
            a_second, axes, vectorized=True, tile=CELLS, directory=Path(folder, "study"), **options
        )
        return time.perf_counter() - wall, time.process_time() - own


def row(executor, workers, options):
    """Overhead of one executor."""
    brief, _ = timed(workers, options)
    wall, own = timed(TILES * workers, options)
    return {
        "executor": executor,
        "workers": workers,
        "tiles": TILES * workers,
        "start-up s": brief - 1.0,
        "wall s": wall,
        "ideal s": float(TILES),
        "overhead": (wall - brief - (TILES - 1)) / (TILES - 1),
        "own ms a tile": own / (TILES * workers) * 1e3,
        "within 5 %": (wall - brief - (TILES - 1)) / (TILES - 1) <= TARGET,
    }


def each_cell():
    """Processor time of a cell that does nothing, in a function of one cell [µs]."""
    axes = {"a": np.arange(100.0), "b": np.arange(1000.0)}
    start = time.process_time()
    sweep(lambda a, b: a, axes, tile=1000)
    return (time.process_time() - start) / 1e5 * 1e6


def resumed():
    """Time to open a finished study of 1000 tiles, every chunk read and checked [s]."""
    axes = {"a": np.arange(1000.0), "b": np.arange(100.0)}
    with tempfile.TemporaryDirectory() as folder:
        options = {"vectorized": True, "tile": 100, "directory": Path(folder, "study")}
        start = time.perf_counter()
        sweep(both, axes, **options)
        written = time.perf_counter() - start
        start = time.perf_counter()
        sweep(both, axes, **options)
        return written, time.perf_counter() - start


def both(a, b):
    """Two observables at no cost."""
    return {"one": a, "two": b}


def main():
    from distributed import Client, LocalCluster

    timed(1, {})  # zarr is loaded
    rows = [
        row("serial", 1, {}),
        row("threads", WORKERS, {"executor": "threads", "workers": WORKERS}),
        row("processes", WORKERS, {"executor": "processes", "workers": WORKERS}),
    ]
    with (
        LocalCluster(
            n_workers=WORKERS, threads_per_worker=1, dashboard_address=None,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):  # fmt: skip
        rows.append(row("dask", WORKERS, {"client": client}))
    written, opened = resumed()
    found = {
        "about": versions("numpy", "zarr", "distributed"),
        "rows": rows,
        "cell µs": each_cell(),
        "1000 tiles of no work, written s": written,
        "the same, opened and checked s": opened,
    }
    text = markdown(rows)
    text += (
        f"\na cell of no work in a function of one cell: {found['cell µs']:.2f} µs of processor\n"
    )
    text += f"1000 tiles of no work: written {written:.2f} s, opened and checked {opened:.2f} s\n"
    save("sweeps", found, text)
    print(text)


if __name__ == "__main__":
    main()
