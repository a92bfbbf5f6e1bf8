"""What numba is told here of calls is what it would work out by itself."""

import numba
import numpy as np
import pytest
from numba.core.compiler_lock import global_compiler_lock

from impactsig._linking import KNOWN, linked_once

pytestmark = pytest.mark.skipif(not KNOWN, reason="only one version of numba is told")


def extremes(a, b, n):
    return max(a, b), min(a, b), max(n, 2), min(n, 2), max(a, n, b), min(0.5, n), max(n, 1)


def arithmetic(x, n):
    return x + n, n + x, x * 2, n // 3, n % 4, x**2, -x, x < n, n == 3


def filled(values, first, last):
    copy = np.zeros(4)
    copy[first:last] = values
    return copy


@pytest.fixture(scope="module")
def call():
    compiled = {one: numba.njit(one) for one in (extremes, arithmetic, filled)}

    def told(function, *arguments):
        with global_compiler_lock, linked_once():
            return compiled[function](*arguments)

    return told


@pytest.mark.parametrize("a", [1.5, -0.0, np.nan, np.inf])
@pytest.mark.parametrize("b", [2.5, 0.0, np.nan])
@pytest.mark.parametrize("n", [-3, 2, 7])
def test_extremes_of_numbers_are_those_of_python(call, a, b, n):
    found, expected = call(extremes, a, b, n), extremes(a, b, n)
    np.testing.assert_equal(found, expected)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(expected))


@pytest.mark.parametrize("x", [np.float32(0.3), 0.3, np.int32(5), 5])
def test_operations_have_the_types_that_numba_gives_them(call, x):
    found, expected = call(arithmetic, x, 7), numba.njit(arithmetic)(x, 7)
    assert found == expected
    assert [type(one) for one in found] == [type(one) for one in expected]


def test_a_slice_is_filled_only_with_what_has_its_shape(call):
    assert call(filled, np.ones(2), 1, 3).tolist() == [0, 1, 1, 0]
    with pytest.raises(ValueError, match="different size"):
        call(filled, np.ones(3), 1, 3)


def test_numba_is_as_it_was_afterwards():
    from impactsig._worked_out_once import CHANGED

    before = [getattr(owner, name) for owner, name, _ in CHANGED]
    with linked_once():
        assert [getattr(owner, name) for owner, name, _ in CHANGED] == [new for *_, new in CHANGED]
    after = [getattr(owner, name) for owner, name, _ in CHANGED]
    assert all(one is other for one, other in zip(before, after, strict=True))
