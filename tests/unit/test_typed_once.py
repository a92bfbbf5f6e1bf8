"""Variables have the types that numba gives them, and errors say where they are."""

import numba
import numpy as np
import pytest
from numba.core.compiler_lock import global_compiler_lock

from impactsig._compiling._linking import KNOWN, linked_once

pytestmark = pytest.mark.skipif(not KNOWN, reason="only one version of numba is told")


def widened(count, values):
    """Whole numbers that become floats and complex numbers after they were first read."""
    last = total = 0
    other = count
    for i in range(count):
        before = other
        last = total
        total = last + values[i]
        if i > 1:
            other = total * 2
        total += before
    return last, total, other


def falling(count):
    return 1.5 if count < 1 else falling_compiled(count - 1) * 2


falling_compiled = numba.njit(falling)


def grown(count):
    """A list whose items have a type only once the loop was read."""
    found, pair = [], (count, 0.5)
    for i in range(count):
        found.append(i * pair[1])
    first, second = pair
    return found, first + second


def missing(values):
    return values.shape[0] + values.no_such_attribute


@pytest.fixture
def compiled():
    def of(function):
        dispatcher = function if hasattr(function, "py_func") else numba.njit(function)

        def call(*arguments):
            with global_compiler_lock, linked_once():
                return dispatcher(*arguments)

        return call

    return of


@pytest.mark.parametrize("kind", [np.int32, np.float32, float, complex])
def test_a_variable_read_before_its_type_is_known(compiled, kind):
    values = np.array([1, 2, 3, 4], kind)
    found, expected = compiled(widened)(4, values), numba.njit(widened)(4, values)
    assert found == expected == widened(4, values)
    assert [type(one) for one in found] == [type(one) for one in expected]


def test_a_function_that_calls_itself(compiled):
    assert compiled(falling_compiled)(4) == 24.0


def test_a_list_that_begins_empty(compiled):
    assert compiled(grown)(3) == ([0.0, 0.5, 1.0], 3.5)


def test_an_error_tells_the_line(compiled):
    line = missing.__code__.co_firstlineno + 1
    with pytest.raises(numba.TypingError, match="no_such_attribute") as raised:
        compiled(missing)(np.ones(3))
    assert f"({line})" in str(raised.value)
    assert "During: typing of get attribute at" in str(raised.value)
