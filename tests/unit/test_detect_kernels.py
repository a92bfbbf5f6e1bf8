"""Kernels of the force detector that take a short way, beside the long one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactsig.detect.instrument.line import PLACES, Line
from impactsig.detect.pulses._damped_step import UNBOUND, damped_step
from impactsig.detect.pulses._half_sine_kernels import is_half_sine
from impactsig.detect.pulses._knots import add_bend, add_sample, no_knots, solve_knots
from impactsig.detect.pulses.shape._shared_shape_kernels import _invert_all
from impactsig.detect.search._background_kernels import next_marked
from impactsig.detect.search.events.event_kernels import (
    _leading,
    explained,
    near_crests,
    strongest_first,
)
from impactsig.detect.search.judging_kernels import with_neighbors
from impactsig.detect.signal.grid import Grid
from impactsig.detect.signal.ladder import HALF_SINE_GAIN, MATCH, ladder
from impactsig.detect.signal.order_kernels import (
    centre_of,
    median_of,
    put_in_order,
    quantile,
    select,
    value_at,
)
from tests.naive_force import leading

KINDS = {
    "normal": lambda rng, n: rng.standard_normal(n),
    "few values": lambda rng, n: rng.integers(0, 4, n).astype(float),
    "all the same": lambda rng, n: np.full(n, 2.5),
    "in order": lambda rng, n: np.arange(float(n)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_selection_is_what_sorting_tells(kind):
    rng = np.random.default_rng(1)
    for n in (1, 2, 3, 10, 301):
        values = KINDS[kind](rng, n)
        ordered = np.sort(values)
        for wanted in {0, n // 3, n // 2, n - 1}:
            mixed = values.copy()
            assert select(mixed, 0, n - 1, wanted) == ordered[wanted]
            np.testing.assert_array_equal(np.sort(mixed), ordered)
            assert np.all(mixed[:wanted] <= ordered[wanted])
            assert np.all(mixed[wanted:] >= ordered[wanted])
        assert median_of(values.copy(), n) == ordered[n // 2]
        for share in (0.0, 0.5, 0.9, 0.97, 1.0):
            assert quantile(values, share) == pytest.approx(np.quantile(values, share), rel=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_order_and_centre_are_those_of_numpy(kind):
    """To the last bit, and equal values in the order in which they come."""
    rng = np.random.default_rng(2)
    for n in (1, 2, 3, 4, 7, 64, 301):
        values = KINDS[kind](rng, n)
        order, room = np.empty(n, np.int64), np.empty(n, np.int64)
        put_in_order(values, order, room)
        np.testing.assert_array_equal(order, np.argsort(values, kind="stable"))
        assert centre_of(values.copy(), n) == np.median(values)


def test_values_between_points_are_those_of_numpy():
    rng = np.random.default_rng(3)
    for n in (1, 2, 5, 30):
        places, values = np.cumsum(rng.uniform(0.1, 1.0, n)), rng.standard_normal(n)
        values[n // 2 :] = values[n // 2]
        for x in (*rng.uniform(-1.0, places[-1] + 1.0, 50), *places):
            # numpy's own may add and multiply in one step.
            expected = np.interp(x, places, values)
            assert value_at(x, places, values) == pytest.approx(expected, rel=1e-14, abs=1e-15)


def test_the_next_marked_sample_wherever_it_lies():
    for n in (0, 1, 7, 8, 9, 40):
        for at in range(n):
            mask = np.zeros(n, np.uint8)
            mask[at] = 1
            for i in range(n + 1):
                assert next_marked(mask, i) == (at if i <= at else n)


def test_neighbors_of_what_is_marked():
    marked = np.array([1, 0, 0, 0, 1, 0, 0], bool)
    np.testing.assert_array_equal(with_neighbors(marked), [1, 1, 0, 1, 1, 1, 0])


@pytest.mark.parametrize("seed", range(5))
def test_leading_crests_are_those_of_comparing_all_with_all(seed):
    rng, widths = np.random.default_rng(seed), ladder(1500.0).width.astype(float)
    n = 400
    crests = np.column_stack(
        (
            rng.uniform(0, 20_000, n),
            rng.integers(0, len(widths), n),
            np.exp(rng.standard_normal(n)),
            np.exp(rng.normal(3.0, 1.0, n)),
        )
    )
    order = np.argsort(-crests[:, 3], kind="stable")
    out = np.empty(n, np.int64)
    kept = _leading(crests, order, widths, out)
    expected = leading(crests, order, widths, explained)
    assert 10 < len(expected) < n - 10
    np.testing.assert_array_equal(out[:kept], expected)


@pytest.mark.parametrize("kind", KINDS)
def test_the_strongest_is_first_and_equal_ones_stay_in_order(kind):
    sure = KINDS[kind](np.random.default_rng(2), 500)
    slow = sorted(range(500), key=lambda k: -sure[k])  # which keeps the order of equal ones
    np.testing.assert_array_equal(strongest_first(-sure), slow)


def test_crests_near_a_span_are_those_that_may_explain_some_of_it_in_three_links():
    rng = np.random.default_rng(4)
    before, own, after = (
        np.column_stack((np.sort(rng.uniform(100 * k, 100 * (k + 1), 30)), rng.random((30, 3))))
        for k in range(3)
    )
    width = 4
    link = 0.5 * (width / MATCH + width)
    low, high = 100.0 - 3 * link, 200.0 + 3 * link
    out, doubt = np.empty((90, 4)), np.empty(90)
    widths = np.array([width, 1000])  # no crest is of the second
    count = near_crests(before, own, after, 100, 200, widths, out, doubt)
    every = np.concatenate((before, own, after))
    expected = every[(every[:, 0] >= low) & (every[:, 0] < high)]
    assert len(own) < len(expected) < len(every)
    np.testing.assert_array_equal(out[:count], expected)
    np.testing.assert_array_equal(doubt[:count], -expected[:, 3])


@pytest.mark.parametrize("width", [1.0, 3.0, 12.0, 40.0])
@pytest.mark.parametrize("apart", [0.0, 2.5, 9.0, 30.0])
def test_what_a_half_sine_explains_of_a_response_is_its_means_over_centre_and_flanks(width, apart):
    wide = 11.0
    length = wide / MATCH

    def mean(a, b):
        t = np.linspace(a, b, 200_001)
        inside = np.abs(t) < 0.5 * length
        return np.trapezoid(np.where(inside, np.cos(np.pi * t / length), 0.0), t) / (b - a)

    near, far = 1.5 * width + 0.5, 5.5 * width + 4.5
    sides = mean(apart - far, apart - near) + mean(apart + near, apart + far)
    centre = mean(apart - 0.5 * width, apart + 0.5 * width)
    expected = HALF_SINE_GAIN * (centre - 0.5 * sides)
    assert explained(apart, width, wide) == pytest.approx(expected, abs=1e-7)


def test_the_inverses_of_many_matrices_are_those_of_each():
    roots = np.random.default_rng(6).standard_normal((13, 5, 5))
    every = roots @ roots.transpose(0, 2, 1) + 0.1 * np.eye(5)
    lower = np.ascontiguousarray(np.tril(every).transpose(1, 2, 0))
    _invert_all(lower, np.empty(13))
    expected = np.tril(np.linalg.inv(every)).transpose(1, 2, 0)
    np.testing.assert_allclose(lower, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("second", "one"), [(0.0, True), (0.75, False), (1.0, False)])
def test_one_half_sine_is_told_from_two(second, one):
    at = np.arange(60)
    noise = np.random.default_rng(5).standard_normal(60)

    def pulse(start):
        return 20.0 * np.sin(np.pi * np.clip((at - start) / 20.0, 0.0, 1.0))

    means = noise + pulse(10.3) + (pulse(10.3 + 20.0 * second) if second else 0.0)
    feet = 10.3, 30.3 + 20.0 * second
    assert is_half_sine(means, *feet, 0.0, 1.4 * 60) == one


@pytest.mark.parametrize("spans", [1.3, 2.6, PLACES - 0.3, PLACES + 0.4, PLACES + 0.6, 40.2])
def test_spans_side_by_side_are_the_record(spans):
    grid = Grid(4096.0, 20.0)
    record = np.random.default_rng(3).standard_normal(int(spans * grid.span))
    count = grid.count(len(record))
    line = Line(grid, len(record))
    for k in range(count + 3):
        if k < count:
            first, last = grid.bounds(k, len(record))
            line.samples(k)[:] = record[first:last]
        if 0 <= k - 3 < count:  # a few are loaded ahead of the one that is looked at
            line.join(k - 3)
            seen, origin = line.around(k - 3, grid.margin)
            np.testing.assert_array_equal(seen, record[origin : origin + len(seen)])
            first, last = grid.bounds(k - 3, len(record))
            assert origin == max(0, first - grid.margin)
            assert origin + len(seen) == (last + grid.margin if k - 3 < count - 1 else last)


def test_a_damped_step_solves_the_damped_equations():
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((9, 4))
    square, right = rows.T @ rows, rng.standard_normal(4)
    normal = np.full((4, 5), np.nan)
    normal[:, :4] = np.tril(square) + np.triu(np.full((4, 4), np.nan), 1)
    normal[:, 4] = right
    low, step = np.empty((4, 4)), np.empty(4)
    assert damped_step(normal, 0.5, UNBOUND, low, step)
    damped = square + 0.5 * np.diag(np.diag(square))
    np.testing.assert_allclose(step, np.linalg.solve(damped, right), rtol=1e-9)
    normal[2, 2] = -1.0
    assert not damped_step(normal, 0.5, UNBOUND, low, step)


def test_heights_at_knots_are_those_of_least_squares_with_the_prior():
    rng = np.random.default_rng(6)
    count, prior = 9, 0.3
    knots = no_knots(count)
    rows, values = [], []
    for place, weight, value in rng.uniform(0.0, [8.0, 2.0, 1.0], (30, 3)):
        b = int(place)
        add_sample(knots, b, place - b, weight, value)
        row = np.zeros(count)
        row[b : b + 2] = 1.0 - (place - b), place - b
        rows.append(math.sqrt(weight) * row)
        values.append(math.sqrt(weight) * value)
    for b in range(1, count - 1):
        add_bend(knots, b, prior)
        row = np.zeros(count)
        row[b - 1 : b + 2] = 1.0, -2.0, 1.0
        rows.append(math.sqrt(prior) * row)
        values.append(0.0)
    heights = np.empty(count)
    assert solve_knots(knots, heights)
    np.testing.assert_allclose(heights, np.linalg.lstsq(rows, values)[0], rtol=1e-9)
    assert not solve_knots(no_knots(count), heights)
