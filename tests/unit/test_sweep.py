"""A study in memory: cells, tiles, seeds, failures, and arguments that cannot be."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from impactsig import ImpactsigWarning, InvalidInput, sweep
from impactsig.studies._cells import seeds
from impactsig.studies._grid import Grid, Tiling, tile_shape
from tests.cells import of_seed, of_seeds, poisoned, same, waves
from tests.cells_compiled import Moments, logistic

AXES = {"a": np.arange(4), "b": np.linspace(0.1, 0.9, 7)}


def test_the_study_is_a_loop_over_the_grid():
    study = sweep(waves, AXES)
    assert study.observables == ("sine", "powers", "count")
    assert study.complete
    assert study.shape == (4, 7)
    assert study["powers"].shape == (4, 7, 3)
    assert study["count"].dtype == np.int64
    for i, a in enumerate(AXES["a"]):
        for j, b in enumerate(AXES["b"]):
            one = waves(int(a), float(b))
            assert study["sine"][i, j] == one["sine"]
            assert (study["powers"][i, j] == one["powers"]).all()


@pytest.mark.parametrize("tile", [1, 2, 3, 7, 8, 14, 28, 1000])
def test_tiles_change_nothing(tile):
    assert same(sweep(waves, AXES, tile=tile), sweep(waves, AXES))


@pytest.mark.parametrize("shape", [(1,), (10,), (3, 5), (4, 1, 6), (2, 3, 4, 5)])
@pytest.mark.parametrize("cells", [1, 2, 5, 7, 12, 500])
def test_every_cell_is_in_one_tile(shape, cells):
    grid = Grid({f"p{n}": np.arange(length) for n, length in enumerate(shape)})
    block = tile_shape(shape, cells)
    assert np.prod(block) <= cells
    tiling = Tiling(grid, block)
    tasks = [tiling.task(tile) for tile in range(len(tiling))]
    every = np.concatenate([task.cells for task in tasks])
    np.testing.assert_array_equal(np.sort(every), np.arange(grid.size))
    for task in tasks:
        places = np.unravel_index(task.cells, shape)
        for place, column in zip(places, task.columns.values(), strict=True):
            np.testing.assert_array_equal(place, column)


def test_a_kernel_gets_a_tile_at_once():
    axes = {"growth": np.linspace(3.5, 4, 40), "start": np.array([0.1, 0.2, 0.3])}
    study = sweep(logistic, axes, vectorized=True, tile=7)
    whole = np.meshgrid(*axes.values(), indexing="ij")
    wanted = logistic(*(one.ravel() for one in whole))
    assert study.observables == Moments._fields
    np.testing.assert_array_equal(study["mean"].ravel(), wanted.mean)
    assert same(study, sweep(logistic, axes, vectorized=True))


def test_numbers_of_python_become_floats():
    """A cell's 0 is another's 0.5."""
    study = sweep(lambda a: a or 0.5, {"a": [0, 1]})
    np.testing.assert_array_equal(study["value"], [0.5, 1.0])
    assert sweep(lambda a: a > 0, {"a": [0, 1]})["value"].tolist() == [0.0, 1.0]
    assert sweep(lambda a: np.bool_(a > 0), {"a": [0, 1]})["value"].dtype == np.int8
    assert sweep(lambda a: a + 1j, {"a": [0, 1]})["value"].dtype == np.complex128
    assert sweep(lambda a: np.float32(a), {"a": [0, 1]})["value"].dtype == np.float32


def test_parameters_arrive_as_they_are_given():
    seen = []
    sweep(lambda a, b: seen.append((a, b)) or 0, {"a": [3], "b": [0.25, 1]})
    assert seen[-2:] == [(3, 0.25), (3, 1.0)]
    assert {type(a) for a, _ in seen} == {int}


# -- cells that fail -------------------------------------------------------------------------------


@pytest.mark.parametrize("tile", [1, 3, 28])
def test_a_poisoned_cell_is_missing_and_says_why(tile):
    axes = {"a": np.arange(4), "b": np.arange(7)}
    with pytest.warns(ImpactsigWarning, match="1 of 28 cells failed; the first, at a = 1, b = 3: "):
        study = sweep(poisoned, axes, tile=tile)
    assert study.errors == {(1, 3): "ValueError: no solution here"}
    wanted = np.add.outer(np.arange(4.0), np.arange(7.0))
    wanted[1, 3] = np.nan
    np.testing.assert_array_equal(study["value"], wanted)
    assert study.complete
    assert "1 of 28 cells failed" in repr(study)


@pytest.mark.parametrize("bad", [[0], [4], [0, 1, 2, 3], [0, 9], list(range(9)), list(range(10))])
def test_a_vectorized_tile_is_halved_until_the_bad_cell_is_found(bad):
    calls = []

    def picky(a):
        calls.append(len(a))
        if np.isin(a, bad).any():
            raise ArithmeticError("bad")
        return np.sqrt(a)

    with pytest.warns(ImpactsigWarning):
        study = sweep(picky, {"a": np.arange(10)}, vectorized=True, tile=10)
    assert sorted(study.errors) == [(cell,) for cell in bad]
    if len(bad) == 10:
        assert study.observables == ()
        return
    wanted = np.sqrt(np.arange(10.0))
    wanted[bad] = np.nan
    np.testing.assert_array_equal(study["value"], wanted)
    assert len(calls) <= 1 + 8 * len(bad)


@pytest.mark.parametrize(
    ("kind", "missing"),
    [
        (np.float32, np.nan),
        (np.complex128, complex(np.nan)),
        (np.int16, -(2**15)),
        (np.uint8, 255),
        (np.bool_, -128),
    ],
)
def test_what_stands_for_no_result(kind, missing):
    with pytest.warns(ImpactsigWarning):
        study = sweep(lambda a: kind(1 // a), {"a": [1, 0]})
    np.testing.assert_array_equal(study["value"], np.array([1, missing], study["value"].dtype))


@pytest.mark.parametrize("tile", [1, 2, 6])
def test_the_first_cell_that_succeeds_says_what_is_given(tile):
    """By number, so that it does not depend on tiles: here cell 2."""
    results = [None, None, np.int32(5), np.int64(6), 0.5, {"other": 1}]

    def odd(a):
        if a == 1:
            raise RuntimeError
        return results[a]

    with pytest.warns(ImpactsigWarning, match="5 of 6 cells failed"):
        study = sweep(odd, {"a": range(6)}, tile=tile)
    assert study["value"].tolist() == [-(2**31)] * 2 + [5] + [-(2**31)] * 3
    assert study.errors[(0,)].startswith("TypeError: numbers for 'value', not NoneType")
    assert study.errors[(1,)] == "RuntimeError"
    assert study.errors[(3,)] == "gave value: int64 () where the first cell gave value: int32 ()"
    assert "float64" in study.errors[(4,)]
    assert study.errors[(5,)].startswith("gave other: float64 ()")


# -- seeds -----------------------------------------------------------------------------------------


def test_seeds_are_those_of_splitmix64():
    """The first outputs for the seed 1234567, as published with Vigna's C code."""
    wanted = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    assert seeds(1234567, np.arange(3)).tolist() == wanted


def test_a_cell_has_one_seed_whatever_the_tiles():
    axes = {"a": np.arange(50)}
    study = sweep(of_seed, axes, seed=7)
    assert same(study, sweep(of_seed, axes, seed=7, tile=3))
    assert same(study, sweep(of_seeds, axes, seed=7, tile=8, vectorized=True))
    assert same(study, sweep(of_seed, axes, seed=np.random.SeedSequence(7)))
    assert not same(study, sweep(of_seed, axes, seed=8))
    noise = study["value"] - np.arange(50)[:, None]
    assert len(np.unique(noise)) == 100


def test_without_a_seed_none_is_given():
    assert sweep(lambda a, **more: len(more), {"a": [1]})["value"] == [0.0]


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "values",
    [[], [[1, 2]], 3.0, "abc", ["x"], [1, np.nan], [np.inf], [None], [[1], [1, 2]], [1j], [True]],
)
def test_ranges_that_are_none(values):
    with pytest.raises(InvalidInput, match=r"parameters\['a'\].*finite numbers"):
        sweep(waves, {"a": values})


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"parameters": {}}, "parameters"),
        ({"parameters": [1, 2]}, "parameters"),
        ({"parameters": {"a b": [1]}}, "parameters"),
        ({"parameters": {"seed": [1]}, "seed": 1}, "parameters"),
        ({"function": 3}, "function"),
        ({"executor": "cloud"}, "executor"),
        ({"executor": "threads", "workers": 0}, "workers"),
        ({"tile": 0}, "tile"),
        ({"tile": 2.5}, "tile"),
        ({"seed": "x"}, "seed"),
        ({"client": 5}, "client"),
        ({"client": "tcp://127.0.0.1:9", "workers": 2}, "client"),
    ],
)
def test_arguments_that_cannot_be(arguments, named):
    given = {"function": waves, "parameters": AXES} | arguments
    with pytest.raises(InvalidInput, match=f"^{named}: got"):
        sweep(given.pop("function"), given.pop("parameters"), **given)


@pytest.mark.parametrize(
    ("function", "told"),
    [
        (lambda a: np.append(a, 1.0), "shape"),
        (lambda a: a.sum(), "shape"),
        (lambda a: "text", "numbers"),
        (lambda a: {}, "one observable or more"),
        (lambda a: {"a": a}, "named otherwise than parameters"),
    ],
)
def test_a_vectorized_function_that_gives_something_else_is_refused(function, told):
    """At once: that is no poisoned cell."""
    with pytest.raises(InvalidInput, match=told):
        sweep(function, {"a": np.arange(10.0)}, vectorized=True)


def test_an_unknown_observable_is_named():
    with pytest.raises(InvalidInput, match="observable: got cosine; required: one of sine, powers"):
        sweep(waves, AXES)["cosine"]


def test_progress_is_told_to_whoever_asks(capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sweep(waves, AXES, progress=True, tile=3)
    assert "28.0/28.0" in capsys.readouterr().err
    sweep(waves, AXES, tile=3)
    assert capsys.readouterr().err == ""


def test_to_xarray():
    pytest.importorskip("xarray")
    told = {"a": {"units": "Hz"}, "sine": {"long_name": "a sine"}}
    data = sweep(waves, AXES, attributes=told).to_xarray()
    assert dict(data.sizes) == {"a": 4, "b": 7, "powers_0": 3}
    assert data.a.attrs == {"units": "Hz"}
    assert data.sine.attrs == {"long_name": "a sine"}
    assert float(data.sine.sel(a=2, b=0.1)) == np.sin(0.2) / 3
