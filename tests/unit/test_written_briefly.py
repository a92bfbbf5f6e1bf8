"""What is written in fewer instructions reads, writes and lets go of what numba would."""

from __future__ import annotations

import gc

import numba
import numpy as np
import pytest
from numba.core.runtime import rtsys

from impactsig._compiling._linking import linked_once


def compiled(function):
    dispatcher = numba.njit(function, error_model="numpy")

    def call(*arguments):
        with linked_once():
            return dispatcher(*arguments)

    return call


def moved(array, rows, columns, by):
    """Add to elements, and find the sum of what they were; then write to a part of the array."""
    total = 0.0
    for i in rows:
        for j in columns:
            total += array[i, j]
            array[i, j] = array[i, j] + by
    part = array[1:, -2]
    part[-1] = -total
    return total, len(part), part[0]


@pytest.mark.parametrize(
    "array",
    [
        np.arange(12.0).reshape(3, 4),
        np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        np.arange(48.0).reshape(6, 8)[::2, ::-2],
        np.arange(12).reshape(3, 4),
    ],
    ids=["C", "F", "A", "whole numbers"],
)
@pytest.mark.parametrize("kind", [np.int64, np.int8, np.uint16])
def test_elements_are_where_numpy_has_them(array, kind):
    rows = np.array([0, 2, -1] if np.issubdtype(kind, np.signedinteger) else [0, 2, 2], kind)
    columns = np.array([1, 3], kind)
    ours, expected = array.copy(order="K"), array.copy(order="K")
    found = compiled(moved)(ours, rows, columns, 2.0)
    assert found == moved(expected, rows, columns, 2.0)
    assert np.array_equal(ours, expected)


def kept_in_turn(count):
    """Variables that hold one array after another, in branches and from the loop before."""
    last = np.zeros(1)
    total = 0.0
    for i in range(count):
        new = np.full(i + 1, 1.0 * i)
        if i % 3 == 1:
            last, pair = new, (new, i)
        else:
            pair = (last, i)
        total += pair[0][-1] + pair[0].shape[0] * pair[1]
    return total, last


@pytest.mark.usefixtures("counted")
def test_arrays_are_let_go_of_once_and_not_before():
    call = compiled(kept_in_turn)
    call(2)
    gc.collect()
    before = rtsys.get_allocation_stats()
    total, last = call(50)
    expected, of_python = kept_in_turn(50)
    assert total == expected
    assert np.array_equal(last, of_python)
    del last
    gc.collect()
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free > 50


def of_parts(values):
    squares = [one * one for one in values]
    return max(squares) + sum([1.0, 2.0])


def test_functions_and_lists_within_a_function_are_found():
    assert compiled(of_parts)(np.arange(4.0)) == 12.0


def test_numba_is_left_as_it_was_found():
    from numba.np import arrayobj

    before = arrayobj.make_array
    with linked_once():
        assert arrayobj.make_array is not before
    assert arrayobj.make_array is before
