"""What numba is told here of calls is what it would work out by itself."""

import numba
import numpy as np
import pytest
from numba.core.compiler_lock import global_compiler_lock

from impactsig._compiling import _linking
from impactsig._compiling._linking import KNOWN, linked_once

pytestmark = pytest.mark.skipif(not KNOWN, reason="only one version of numba is told")


def arithmetic(x, n):
    return x + n, n + x, x * 2, n // 3, n % 4, x**2, -x, x < n, n == 3


def filled(values, first, last):
    copy = np.zeros(4)
    copy[first:last] = values
    return copy


@pytest.fixture(scope="module")
def call():
    compiled = {one: numba.njit(one) for one in (arithmetic, filled)}

    def told(function, *arguments):
        with global_compiler_lock, linked_once():
            return compiled[function](*arguments)

    return told


@pytest.mark.parametrize("x", [np.float32(0.3), 0.3, np.int32(5), 5])
def test_operations_have_the_types_that_numba_gives_them(call, x):
    found, expected = call(arithmetic, x, 7), numba.njit(arithmetic)(x, 7)
    assert found == expected
    assert [type(one) for one in found] == [type(one) for one in expected]


def test_a_slice_is_filled_only_with_what_has_its_shape(call):
    assert call(filled, np.ones(2), 1, 3).tolist() == [0, 1, 1, 0]
    with pytest.raises(ValueError, match="different size"):
        call(filled, np.ones(3), 1, 3)


def state():
    from impactsig._compiling import _typed_once, _worked_out_once

    changed = _typed_once.CHANGED + _worked_out_once.CHANGED
    return [getattr(owner, name) for owner, name, _ in changed], [new for *_, new in changed]


def test_numba_is_as_it_was_afterwards_even_after_an_error(call):
    before, new = state()
    with linked_once():
        within, _ = state()
    assert within == new
    with pytest.raises(numba.TypingError):
        call(arithmetic, "a", 7)
    after, _ = state()
    assert all(one is other for one, other in zip(before, after, strict=True))


def test_other_versions_of_numba_are_told_nothing(monkeypatch):
    monkeypatch.setattr(_linking, "KNOWN", False)
    before, _ = state()
    with linked_once():
        within, _ = state()
    assert all(one is other for one, other in zip(before, within, strict=True))


@pytest.mark.slow
def test_what_users_compile_is_compiled_by_numba_alone(call):
    with pytest.raises(ValueError, match="different size"):
        call(filled, np.ones(3), 1, 3)
    with pytest.raises(ValueError, match=r"slice of shape \(2,\) from input of shape \(3,\)"):
        numba.njit(filled)(np.ones(3), 1, 3)
