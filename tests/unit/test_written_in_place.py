"""What is written where it is called gives what numba's functions give."""

from __future__ import annotations

import gc
import itertools
import math

import numba
import numpy as np
import pytest
from numba.core.event import install_recorder
from numba.core.runtime import rtsys

from impactsig._compiling._linking import KNOWN, linked_once

NUMBERS = [0.0, -0.0, 1.5, -2.0, math.inf, -math.inf, math.nan]


def extremes(a, b, c):
    return max(a, b), min(a, b), max(a, b, c), min(a, b, c), max(a, 1), min(2, b, 0.5)


def arrays(n):
    first, second, third = np.empty(n), np.empty((n, 3), np.int64), np.empty((2, n, 2), float)
    none, marks = np.zeros((n, 2)), np.zeros(n, np.bool_)
    first[:] = 1.0
    second[:] = 2
    third[:] = 3.0
    return first.sum(), second.sum(), third.sum(), none, marks, second


def whole(x):
    return int(x), int(-x)


def compiled(function, *arguments):
    """Compiled with this package's way, and the names of what numba compiled for it."""
    dispatcher = numba.njit(function, error_model="numpy")
    with install_recorder("numba:compile") as recorder, linked_once():
        found = dispatcher(*arguments)
    names = {one.data["dispatcher"].py_func.__qualname__ for _, one in recorder.buffer}
    return dispatcher, found, names


def same(a, b):
    return repr(a) == repr(b) and type(a) is type(b)


@pytest.mark.parametrize("kind", [float, np.float32, int])
def test_extremes_are_those_of_python(kind):
    values = NUMBERS if kind is not int else [0, 1, -3, 7]
    dispatcher, _, names = compiled(extremes, kind(1), kind(2), kind(3))
    if KNOWN:
        assert not any("ol_m" in one for one in names)
    plain = numba.njit(extremes, error_model="numpy")
    for three in itertools.product(values, repeat=3):
        given = tuple(kind(one) for one in three)
        found = dispatcher(*given)
        assert all(map(same, found, plain(*given)))
        expected = [max(given[:2]), min(given[:2]), max(given), min(given)]
        assert all(same(float(a), float(b)) for a, b in zip(found, expected, strict=False))


@pytest.mark.usefixtures("counted")
def test_arrays_have_shape_and_type_and_are_released():
    dispatcher = compiled(arrays, 1)[0]
    gc.collect()
    before = rtsys.get_allocation_stats()
    *sums, none, marks, second = dispatcher(5)
    assert sums == [5.0, 30, 60.0]
    assert (none.shape, none.dtype, none.any()) == ((5, 2), np.float64, False)
    assert (marks.shape, marks.dtype, marks.any()) == ((5,), np.bool_, False)
    assert (second.shape, second.dtype) == ((5, 3), np.int64)
    del none, marks, second
    gc.collect()
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free > 0


def test_sizes_that_cannot_be_are_refused():
    dispatcher = compiled(arrays, 1)[0]
    with pytest.raises((ValueError, MemoryError)):
        dispatcher(2**62)


def test_whole_numbers_are_cut():
    assert compiled(whole, 2.7)[1] == (2, -2)
