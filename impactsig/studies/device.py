"""numba's current GPU: whether there is one, and what bits may depend on there."""

from __future__ import annotations

from typing import Any, Literal, get_args

from .._arguments import choice
from ..errors import InvalidInput, MissingExtra

Executor = Literal["threads", "gpu"]
"""What moves many machines."""
EXTRA = "gpu"
THREADS = 64
"""In a block."""
BLOCKS = 128
"""In a launch, at the least: numba warns of fewer. Those that have no cell end at once."""
RESIDENT = 512
"""Cells to each multiprocessor below which a launch takes as long with fewer."""


def parts_of_device() -> dict[str, str]:
    """Properties of the device that the bits may depend on besides the code, by name.

    Raises
    ------
    MissingExtra
        If numba-cuda is not installed.
    InvalidInput
        If there is no GPU that it can use.
    """
    try:
        from numba import cuda
    except ImportError:
        raise MissingExtra("numba-cuda", EXTRA, "Work on a GPU") from None
    if simulated():
        return {"GPU": "simulated"}
    if cuda.implementation != "NVIDIA":
        raise MissingExtra("numba-cuda", EXTRA, "Work on a GPU")
    from ._cells import brief
    from .fingerprint import digest

    try:
        if cuda.is_available():
            from numba.cuda.cudadrv import nvvm

            major, minor = cuda.get_current_device().compute_capability
            functions = digest(nvvm.LibDevice().get())
            return {"GPU": f"compute capability {major}.{minor}", "libdevice": functions}
        why = " ".join(str(cuda.cuda_error() or "NVVM, its compiler, is missing").split())
    except Exception as error:
        why = brief(error)
    raise InvalidInput(
        "executor", "gpu", "a machine with an NVIDIA GPU, its driver and impactsig[gpu]",
        f'Here, {why.rstrip(".")}. Take executor="threads" or, in a sweep, "processes"',
    )  # fmt: skip


def on_gpu(executor: Any, workers: Any) -> bool:
    """Whether machines are to be moved by a GPU, not by threads.

    Raises
    ------
    InvalidInput
        If `executor` is neither, or there is no GPU.
    MissingExtra
        If numba-cuda is not installed.
    """
    if choice("executor", executor, get_args(Executor)) != "gpu":
        return False
    own_threads(workers)
    parts_of_device()
    return True


def own_threads(workers: Any) -> None:
    """Refuse a number of threads, which a GPU has of its own."""
    if workers is not None:
        raise InvalidInput("workers", workers, 'none with executor="gpu"', "It has its own")


def simulated() -> bool:
    """Whether numba simulates a GPU, as it does where NUMBA_ENABLE_CUDASIM is 1."""
    from numba import config

    return bool(config.ENABLE_CUDASIM)


def blocks(count: int) -> int:
    """Blocks of a launch of so many threads."""
    return max(1 if simulated() else BLOCKS, -(-count // THREADS))
