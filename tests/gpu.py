"""Two ways to test work for a GPU without one: numba's simulator, and the code for a device."""

from __future__ import annotations

import contextlib
import multiprocessing
import types
from concurrent.futures import ProcessPoolExecutor

import pytest

from impactsig.studies.device import parts_of_device


@contextlib.contextmanager
def simulating():
    """Call functions with executor="gpu" in a process in which numba simulates one.

    numba reads the variable when it is imported, hence the process.
    """
    pytest.importorskip("numba.cuda")
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("NUMBA_ENABLE_CUDASIM", "1")
            assert pool.submit(parts_of_device).result() == {"GPU": "simulated"}

        def called(function, *args, **options):
            return pool.submit(function, *args, executor="gpu", **options).result()

        yield called


def pretend_device(monkeypatch):
    """Let numba-cuda compile for a device of compute capability 8.0 that is not there."""
    from numba import cuda

    try:
        from numba.cuda.cudadrv import nvvm

        assert cuda.implementation == "NVIDIA"
        nvvm.NVVM()
    except Exception as error:
        pytest.skip(f"needs the compiler of impactsig[gpu] ({type(error).__name__})")
    from numba.cuda import codegen, dispatcher

    device = types.SimpleNamespace(compute_capability=(8, 0), id=0)
    context = types.SimpleNamespace(device=device)
    monkeypatch.setattr(dispatcher, "get_current_device", lambda: device)
    monkeypatch.setattr(codegen.devices, "get_context", lambda *number: context)
    monkeypatch.setattr(dispatcher._Kernel, "bind", lambda kernel: None)
