"""Sweeps on a GPU: on a device where there is one, in numba's simulator of one everywhere.

The simulator runs Python, a thread a cell, so it has the very bits of Python. What a device does
can be told without one from the code that it would run, where numba-cuda's compiler is there.
"""

from __future__ import annotations

import functools
import shutil
import sys

import numpy as np
import pytest

from impactsig import ImpactsigError, ImpactsigWarning, InvalidInput, MissingExtra, sweep
from impactsig.studies import sweeping
from impactsig.studies._cells import Job, Outcome
from impactsig.studies._grid import grid_of
from impactsig.studies.device import parts_of_device
from impactsig.studies.executors import gpu as _gpu
from tests import cells_device as cells
from tests.cells import contents, same
from tests.gpu import pretend_device, simulating

MAP = {"growth": np.linspace(3.4, 4, 25), "start": [0.1, 0.2, 0.7]}
BALL = {"restitution": np.linspace(0.1, 0.9, 13), "amplitude": [0.0, 0.05, 0.1]}


@pytest.fixture(scope="module")
def simulator():
    """A sweep in a process in which numba simulates a GPU."""
    with simulating() as called:
        yield functools.partial(called, sweep)


@pytest.fixture
def device():
    """A GPU; without one the test is skipped."""
    try:
        parts_of_device()
    except ImpactsigError as error:
        pytest.skip(f"needs a GPU: {error}")
    return functools.partial(sweep, executor="gpu")


@pytest.fixture(params=["simulator", pytest.param("device", marks=pytest.mark.gpu)])
def on_gpu(request):
    """A sweep on either."""
    return request.getfixturevalue(request.param)


# -- the same as on a CPU --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("function", "tile"), [(cells.logistic, None), (cells.compiled_logistic, 7)]
)
def test_exactly_rounded_operations_give_the_bits_of_a_cpu(on_gpu, function, tile):
    """A hundred steps of a chaotic map, in which one rounding more or less would show."""
    study = on_gpu(function, MAP, tile=tile)
    assert study.observables == ("last", "mean", "above")
    assert same(study, sweep(function, MAP))


def test_in_the_simulator_all_functions_give_the_bits_of_python(simulator):
    study, wanted = simulator(cells.bouncing, BALL), sweep(cells.bouncing, BALL)
    assert study["phases"].shape == (13, 3, 3)
    assert same(study, wanted)


@pytest.mark.gpu
def test_functions_of_the_mathematical_library_agree_to_rounding(device):
    study, wanted = device(cells.bouncing, BALL), sweep(cells.bouncing, BALL)
    for name in wanted.observables:
        np.testing.assert_allclose(study[name], wanted[name], rtol=1e-14, atol=1e-15)


def test_the_seeds_of_cells(on_gpu):
    study = on_gpu(cells.of_seed, {"a": range(30)}, seed=5, tile=8)
    wanted = sweep(cells.of_seed, {"a": range(30)}, seed=5)
    assert not wanted.errors
    assert same(study, wanted)
    assert len(np.unique(study["value"] % 1)) == 30


def test_whole_numbers_tuples_and_complex_ones(on_gpu):
    axes = {"n": np.arange(-5, 6), "step": np.array([2, 3], np.uint8)}
    study = on_gpu(cells.count, axes)
    assert study["value"].shape == (11, 2, 2)
    assert same(study, sweep(cells.count, axes))
    axes = {"a": [0.5, 1.5], "n": [1, 4]}
    study = on_gpu(cells.complex_power, axes)
    assert study["value"].dtype == np.complex128
    np.testing.assert_allclose(study["value"], sweep(cells.complex_power, axes)["value"], 1e-14)


def test_what_is_bound_or_has_a_default(on_gpu):
    function = functools.partial(cells.bouncing, 0.5)
    axes = {"amplitude": [0.0, 0.1]}
    study, wanted = on_gpu(function, axes), sweep(cells.bouncing, {"restitution": [0.5], **axes})
    np.testing.assert_allclose(study["phases"], wanted["phases"][0], rtol=1e-14)
    axes = {"phase": [0.2, 0.7]}
    study = on_gpu(functools.partial(function, amplitude=0.1), axes)
    wanted = sweep(functools.partial(function, amplitude=0.1), axes)
    np.testing.assert_allclose(study["phases"], wanted["phases"], rtol=1e-14)


# -- cells that fail -------------------------------------------------------------------------------


def test_a_cell_that_raises_is_missing(on_gpu):
    axes = {"a": np.arange(1.0, 4.0), "b": np.arange(1.0, 6.0)}
    study = on_gpu(cells.quotient, axes, tile=4)
    with pytest.warns(ImpactsigWarning):
        wanted = sweep(cells.quotient, axes)
    assert study.errors == {place: _gpu.RAISED for place in wanted.errors}
    assert list(study.errors) == [(0, 2), (1, 2), (2, 2)]
    np.testing.assert_array_equal(study["value"], wanted["value"])


def test_a_study_whose_cells_all_raise(on_gpu):
    study = on_gpu(cells.quotient, {"a": [1.0, 2.0], "b": [3.0]})
    assert study.observables == ()
    assert len(study.errors) == 2


# -- in a directory --------------------------------------------------------------------------------


def test_a_study_goes_on_where_it_was(on_gpu, tmp_path):
    pytest.importorskip("zarr")
    on_gpu(cells.logistic, MAP, tile=9, directory=tmp_path / "whole")
    whole = contents(tmp_path / "whole")
    shutil.copytree(tmp_path / "whole", tmp_path / "cut")
    for lost in ("done/1.json", "results.zarr/mean/c/3/0"):
        (tmp_path / "cut" / lost).unlink()
    study = on_gpu(cells.logistic, MAP, directory=tmp_path / "cut")
    assert study.complete
    assert contents(tmp_path / "cut") == whole


def test_gpu_and_cpu_do_not_share_a_directory(on_gpu, tmp_path):
    pytest.importorskip("zarr")
    on_gpu(cells.logistic, MAP, directory=tmp_path / "gpu")
    with pytest.raises(InvalidInput, match=r"^directory: .*code: GPU \(.* there, none here\)"):
        sweep(cells.logistic, MAP, directory=tmp_path / "gpu")
    sweep(cells.logistic, MAP, directory=tmp_path / "cpu")
    with pytest.raises(InvalidInput, match=r"code: GPU \(none there, .* here\)"):
        on_gpu(cells.logistic, MAP, directory=tmp_path / "cpu")


# -- what a GPU cannot do --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("function", "axes", "why"),
    [
        (cells.an_array, {"a": [1.0]}, "what it returns is array"),
        (cells.no_number, {"a": [1.0]}, "what it returns is Tuple"),
        (cells.maybe, {"a": [1.0]}, "what it returns is OptionalType"),
        (cells.of_strings, {"a": [1.0]}, "UnsupportedBytecodeError"),
        (cells.logistic, {"growth": [1.0]}, "TypeError: missing a required argument: 'start'"),
        (cells.logistic, MAP | {"end": [1]}, "unexpected keyword argument 'end'"),
        (np.sin, {"a": [1.0]}, "it is of type ufunc"),
    ],
)
def test_functions_that_a_gpu_cannot_run_are_refused(simulator, function, axes, why):
    with pytest.raises(
        InvalidInput, match=rf'^function: .*required: for a GPU.*{why}.*executor="processes"'
    ):
        simulator(function, axes)


@pytest.mark.parametrize(
    ("argument", "value"), [("vectorized", True), ("workers", 2), ("client", "tcp://here:1")]
)
def test_options_of_other_executors_are_refused(simulator, argument, value):
    with pytest.raises(InvalidInput, match=f"^{argument}: "):
        simulator(cells.logistic, MAP, **{argument: value})


def test_without_numba_cuda_the_extra_is_named(monkeypatch):
    cuda = pytest.importorskip("numba.cuda")
    monkeypatch.setattr(cuda, "implementation", "Built-in")
    with pytest.raises(MissingExtra, match=r"numba-cuda.*impactsig\[gpu\]"):
        sweep(cells.logistic, MAP, executor="gpu")
    monkeypatch.setitem(sys.modules, "numba.cuda", None)
    monkeypatch.delattr(sys.modules["numba"], "cuda")
    with pytest.raises(MissingExtra, match=r"numba-cuda.*impactsig\[gpu\]"):
        sweep(cells.logistic, MAP, executor="gpu")


def test_without_a_gpu_it_says_so(monkeypatch):
    cuda = pytest.importorskip("numba.cuda")
    monkeypatch.setattr(cuda, "implementation", "NVIDIA")
    monkeypatch.setattr(cuda, "is_available", lambda: False)
    monkeypatch.setattr(cuda, "cuda_error", lambda: "no\ndriver", raising=False)
    with pytest.raises(InvalidInput, match=r"^executor: .*NVIDIA GPU.*Here, no driver.*process"):
        sweep(cells.logistic, MAP, executor="gpu")


def test_a_gpu_that_fails_ends_the_sweep(monkeypatch):
    gpu = object.__new__(_gpu.Gpu)
    gpu.job = Job(cells.logistic, False, None)

    def run(task):
        raise RuntimeError("CUDA_ERROR_OUT_OF_MEMORY")

    monkeypatch.setattr(gpu, "_run", run)
    with pytest.raises(ImpactsigError, match=r"GPU has failed: .*OUT_OF_MEMORY.*smaller tile"):
        gpu._launch(grid_of(MAP).task(np.arange(3)))


# -- tiles -----------------------------------------------------------------------------------------


class Timed:
    """An executor on which up to `least` cells take as long as one."""

    workers, least, most = 1, 1000, 20_000

    def __init__(self, seconds):
        self.seconds, self.tried = seconds, []

    def run(self, tasks):
        for label, task in tasks:
            self.tried.append(len(task.cells))
            seconds = self.seconds * -(-len(task.cells) // self.least)
            yield label, task, Outcome([], {}, seconds)


@pytest.mark.parametrize(
    ("cells_", "seconds", "wanted"),
    [
        (10, 1, 10),  # there is room for all
        (1000, 1, 1000),
        (3000, 1, 1000),  # in four tiles each would take as long
        (50_000, 3, 1000),
        (50_000, 0.2, 5000),
        (50_000, 0.01, 12_500),  # four tiles
        (500_000, 0.01, 20_000),  # no more fit memory
    ],
)
def test_a_tile_fills_the_gpu(cells_, seconds, wanted):
    pool = Timed(seconds)
    assert sweeping._tile_of_a_second(pool, grid_of({"a": range(cells_)}))[0] == wanted
    assert pool.tried[:2] in ([], [1, 1000])  # the first compiles


# -- the code of a device --------------------------------------------------------------------------


@pytest.fixture
def assembly(monkeypatch):
    """What a device would run for a function."""
    pretend_device(monkeypatch)
    from impactsig.studies.executors import _gpu_kernel

    def compiled(function, **kinds):
        kinds = kinds or {"a": float, "b": float}
        types_ = {name: np.dtype(kind) for name, kind in kinds.items()}
        (kernel,) = _gpu_kernel.compiled(function, types_)[0].overloads.values()
        return kernel.library.get_asm_str()

    return compiled


def test_products_and_sums_are_not_fused(assembly):
    def horner(a, b):
        return a * b + a

    text = assembly(horner)
    assert "mul.rn.f64" in text
    assert "add.rn.f64" in text
    assert "fma." not in text


def test_a_thread_that_raises_stores_nothing(assembly):
    """It leaves before the first store, the mark of a cell that came to an end among them."""

    def positive(a, b):
        if a < b:
            raise ValueError("below")
        return a

    lines = assembly(positive).splitlines()
    stores = [n for n, line in enumerate(lines) if "st.global" in line]
    leaves = [n for n, line in enumerate(lines) if "@%p" in line and "bra" in line]
    assert len(stores) == 2
    assert len(leaves) == 2
    assert max(leaves) < min(stores)


@pytest.mark.parametrize(
    ("function", "kinds"),
    [
        (cells.compiled_logistic, {"growth": float, "start": float}),
        (cells.bouncing, {"restitution": float, "amplitude": float}),
        (cells.of_seed, {"a": np.int64, "seed": np.uint64}),
        (cells.count, {"n": np.int64, "step": np.int64}),
        (cells.complex_power, {"a": float, "n": np.int64}),
        (cells.quotient, {"a": float, "b": float}),
    ],
)
def test_it_compiles_for_a_device(assembly, function, kinds):
    assert ".visible .entry" in assembly(function, **kinds)
