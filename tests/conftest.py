"""What several tests need: hypothesis' settings, and real recordings if any."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]

# Tests run side by side: more threads of linear algebra would only wait for each other.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Bytecode is kept, as the kernels beside it are: without it every process that a test starts
# compiles the package anew, and every worker rewrites the assertions of all tests.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# The same examples in every run of CI; new ones on a developer's machine.
settings.register_profile("ci", derandomize=True, deadline=None)
settings.register_profile("here", deadline=None)  # a first call compiles
settings.load_profile("here")
if os.environ.get("CI"):
    settings.load_profile("ci")

SHARED = Path(os.environ.get("IMPACTSIG_SHARED_DATA", ROOT.parent / "shared" / "data"))


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Modules and tests are a million objects and no garbage: leave them out of collections.

    Some libraries collect whenever a file is closed, which took half a second each time.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
        CALLED.extend(kernels_called())


CALLED: list[str] = []
"""Kernels of the package that were called while tests were collected."""


def kernels_called():
    """Kernels that have been called in this process."""
    for name, module in list(sys.modules.items()):
        if name.startswith("impactsig."):
            for one, value in vars(module).items():
                if hasattr(value, "py_func") and value.signatures:
                    yield f"{name}.{one}"


@pytest.fixture
def called_while_collecting():
    return CALLED


@pytest.fixture(scope="session")
def shared_data():
    """Path of a real recording; the test is skipped where the recordings are absent."""

    def path(relative):
        found = SHARED / relative
        if not found.exists():
            pytest.skip(f"real recording {relative} is not here (set IMPACTSIG_SHARED_DATA)")
        return found

    return path


@pytest.fixture(autouse=True)
def _no_figure_stays_open():
    """Twenty open figures are a warning in whichever test opens the next."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture
def little_work(monkeypatch):
    """Ends sooner what creeps on a stiff stop, or bounces a thousand times in a period."""
    from impactsig.simulation import run

    monkeypatch.setattr(run, "LEGS_AT_LEAST", 10_000)
    monkeypatch.setattr(run, "LEGS_PER_PERIOD", 1000)


@pytest.fixture
def counted():
    """Counts the arrays that compiled code allocates and releases."""
    from numba.core.registry import cpu_target
    from numba.core.runtime import _nrt_python, rtsys

    rtsys.initialize(cpu_target.target_context)
    _nrt_python.memsys_enable_stats()
    yield
    _nrt_python.memsys_disable_stats()


@pytest.fixture
def ax():
    from matplotlib.figure import Figure

    return Figure().subplots()


@pytest.fixture
def without_figures(monkeypatch):
    """Pages of reports without their figures: to draw them takes most of a page's time."""
    from tests.drawing import leave_out_figures

    leave_out_figures(monkeypatch)
