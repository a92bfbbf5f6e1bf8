"""Tracking of rate and phase: kernels against their sums, the drift against dense algebra."""

import numpy as np
import pytest

from impactsig.intervals.phases._drift import fit_drift
from impactsig.intervals.phases._drift_kernels import second_differences, solve
from impactsig.intervals.phases._satellites import satellites
from impactsig.intervals.phases._tracking_kernels import coherence, window_scores
from impactsig.intervals.phases.tracking import (
    WEIGHT,
    best_path,
    spline_integral,
    tracked_phase,
    tracked_rate,
)


def test_the_score_of_a_window_is_the_sum_over_harmonics():
    rng = np.random.default_rng(0)
    cycles, centre, width = np.sort(rng.uniform(0, 60, 70)), np.array([10.0, 30.0]), 5.0
    rates = np.array([-0.01, 0.005, 0.02])
    low, high = np.searchsorted(cycles, centre - 12.5), np.searchsorted(cycles, centre + 12.5)
    scores = np.empty((2, 3))
    window_scores(cycles, low, high, centre, rates[0], 0.015, width, WEIGHT, scores)
    for k in range(2):
        since = cycles[low[k] : high[k]] - centre[k]
        weight = np.exp(-0.5 * (since / width) ** 2)
        for r in range(3):
            power = 0.0
            for h in range(1, 9):
                wave = np.exp(2j * np.pi * h * (1 + rates[r]) * since)
                power += WEIGHT[h - 1] * abs(np.sum(weight * wave)) ** 2
            norm = np.sqrt(np.sum(weight**2) * np.sum(weight))
            assert scores[k, r] == pytest.approx(power / norm, rel=1e-10)


@pytest.mark.parametrize("count", [4, 5, 8, 200])
def test_the_integral_of_a_spline_is_exact_for_cubics_and_that_of_scipy(count):
    from scipy.interpolate import CubicSpline

    rng, step = np.random.default_rng(count), 0.37
    knots = step * np.arange(count)
    x = np.concatenate([[0.0, knots[-1]], rng.uniform(0, knots[-1], 100)])
    cubic = np.poly1d([0.3, -1.0, 0.5, 2.0])
    u = x / knots[-1]
    exact = knots[-1] * cubic.integ()(u)
    found = spline_integral(cubic(knots / knots[-1]), step, x)
    np.testing.assert_allclose(found, exact, rtol=1e-13, atol=1e-14)
    values = rng.standard_normal(count)
    scipys = CubicSpline(knots, values).antiderivative()(x)
    np.testing.assert_allclose(spline_integral(values, step, x), scipys, atol=1e-13 * count)


def test_coherence_is_the_power_within_windows():
    rng = np.random.default_rng(1)
    centred, first = rng.uniform(-20, 20, 50), np.array([0, 20, 35])
    power = np.empty(2)
    coherence(centred, first, 1.0, 0.01, WEIGHT, power)
    for k, rate in enumerate((1.0, 1.01)):
        expected = 0.0
        for part in np.split(centred, first[1:]):
            for h in range(1, 9):
                expected += WEIGHT[h - 1] * abs(np.exp(2j * np.pi * h * rate * part).sum()) ** 2
        assert power[k] == pytest.approx(expected, rel=1e-10)


def test_the_best_path_is_the_best_of_all():
    rng = np.random.default_rng(2)
    score = rng.normal(size=(5, 3))
    change = 0.7 * (np.arange(3)[:, None] - np.arange(3)) ** 2
    paths = np.array(np.meshgrid(*[range(3)] * 5)).reshape(5, -1).T
    value = [score[np.arange(5), path].sum() - change[path[:-1], path[1:]].sum() for path in paths]
    np.testing.assert_array_equal(best_path(score, change), paths[int(np.argmax(value))])


def test_a_rate_that_changes_is_tracked_and_the_phase_kept():
    rng = np.random.default_rng(3)
    n = np.arange(600.0)
    cycles = n + 0.015 * n**2 / 1200 + 0.01 * rng.standard_normal(600)
    tracked = tracked_phase(tracked_rate(cycles, 0.026))
    rest = np.angle(np.exp(2j * np.pi * (tracked - tracked[300]))) / (2 * np.pi)
    assert rest.std() < 0.03


def test_the_spline_solves_the_dense_equations():
    rng = np.random.default_rng(4)
    count, ratio = 9, 3.0
    x = np.sort(rng.uniform(0, 8, 40))
    y = rng.standard_normal(40)
    place = np.minimum(x.astype(int), count - 2)
    basis = np.zeros((40, count))
    basis[np.arange(40), place] = 1 - (x - place)
    basis[np.arange(40), place + 1] = x - place
    bends = np.diff(np.eye(count), 2, axis=0)
    whole = basis.T @ basis + ratio * bends.T @ bends
    bands = np.zeros((3, count))
    for k in range(3):
        bands[k, : count - k] = np.diagonal(basis.T @ basis, -k)
        dense = np.diagonal(bends.T @ bends, -k)
        np.testing.assert_allclose(second_differences(count)[k, : count - k], dense, atol=1e-12)
    found, half, left = solve(
        bands, second_differences(count), basis.T @ y, y, place, 1 - (x - place), x - place, ratio
    )
    knots = np.linalg.solve(whole, basis.T @ y)
    np.testing.assert_allclose(found, knots, rtol=1e-9)
    assert half == pytest.approx(0.5 * np.linalg.slogdet(whole)[1], rel=1e-9)
    rest = y - basis @ knots
    assert left == pytest.approx(rest @ rest + ratio * np.sum(np.diff(knots, 2) ** 2), rel=1e-9)


def test_a_wander_too_small_to_bend_the_run_has_the_evidence_of_a_straight_phase():
    rng = np.random.default_rng(5)
    x = np.arange(200.0)
    y = 0.3 + 0.01 * x + 0.02 * rng.standard_normal(200)
    found = fit_drift(x, y, 1e-3, np.array([1e-7]))
    assert found.log_odds == pytest.approx(0, abs=1e-2)
    bent = fit_drift(x, y + 1e-5 * x**2, 1e-3)
    assert fit_drift(x, y, 1e-3).log_odds < 0 < bent.log_odds


def test_satellites_are_those_that_follow_at_one_delay():
    rng = np.random.default_rng(6)
    first = np.arange(100.0)
    echoes = first[::3] + 0.06 + 0.001 * rng.standard_normal(34)
    cycles = np.sort(np.concatenate((first, echoes)))
    found = satellites(cycles)
    np.testing.assert_array_equal(np.flatnonzero(found.which), np.searchsorted(cycles, echoes))
    assert found.delay == pytest.approx(0.06, abs=1e-3)
    assert found.share == 0.34
    assert satellites(first) is None
    # a second impact that nearly always comes is part of the motion
    assert satellites(np.sort(np.concatenate((first, first + 0.06)))) is None
