"""Executor on a GPU: a launch for each tile, of the same function that runs on CPUs."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ...errors import ImpactsigError
from .._cells import Job, Outcome, brief, seeded
from .._grid import Grid, Task
from ..device import RESIDENT, THREADS, blocks, simulated
from .pool import Threads

LARGEST = 2**20
"""Cells to a tile, at the most: to keep them takes a quarter of a second, and memory."""
RAISED = "raised an error on the GPU, which cannot tell what: call the function with these values"


class Gpu(Threads):
    """Executor on numba's current GPU; one thread launches while the caller stores results."""

    most = LARGEST

    def __init__(self, job: Job, grid: Grid) -> None:
        from ._gpu_kernel import compiled

        names = [*grid.axes, *(() if job.key is None else ("seed",))]
        self.job = job
        self.kinds = {name: _kind(grid.axes.get(name)) for name in names}
        self.kernel, self.fields = compiled(job.function, self.kinds)
        if not simulated():
            from numba import cuda

            self.least = RESIDENT * cuda.get_current_device().MULTIPROCESSOR_COUNT
        super().__init__(self._launch, 1)

    def _launch(self, task: Task) -> Outcome:
        """Evaluate all cells of a task in one launch."""
        begin = time.perf_counter()
        try:
            ended, found = self._run(seeded(self.job, task))
        except Exception as error:
            raise ImpactsigError(
                f"the GPU has failed: {brief(error)}. Finished tiles are kept if there is a "
                "directory: run the same sweep again; if memory was short, with a smaller tile"
            ) from error
        positions = np.flatnonzero(ended)
        if len(positions) < len(ended):
            found = {name: array[positions] for name, array in found.items()}
        groups = [(positions, found)] if len(positions) else []
        errors = dict.fromkeys(task.cells[ended == 0].tolist(), RAISED)
        return Outcome(groups, errors, time.perf_counter() - begin)

    def _run(self, task: Task) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Mask of the cells that finished, and the values of all."""
        from numba import cuda

        count = len(task.cells)
        columns = [cuda.to_device(task.columns[n].astype(kind)) for n, kind in self.kinds.items()]
        results = [cuda.device_array((count, *one.shape), one.dtype) for one in self.fields]
        ended = cuda.to_device(np.zeros(count, np.int8))
        self.kernel[blocks(count), THREADS](ended, *columns, *results)
        found = {
            one.name: result.copy_to_host()
            for one, result in zip(self.fields, results, strict=True)
        }
        return ended.copy_to_host(), found


def _kind(values: np.ndarray | None) -> np.dtype[Any]:
    """Types that compiled functions receive for these values on CPUs."""
    if values is None or values.dtype == np.uint64:
        return np.dtype(np.uint64)
    return np.dtype(np.float64 if values.dtype.kind == "f" else np.int64)
