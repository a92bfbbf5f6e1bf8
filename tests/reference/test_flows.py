"""Lorenz' and Rössler's flows: high-precision solutions, known orbits and averages, Sauer 1994."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.spatial import cKDTree

from impactsig import flows, integrate_and_fire, simulate, threshold_crossings


@pytest.fixture(scope="module")
def exact_lorenz():
    """Lorenz' flow and the integral of its signal, to 18 digits (Taylor series)."""
    with mpmath.workdps(22):
        beta = mpmath.mpf(8 / 3)

        def rates(t, y):
            return [
                10 * (y[1] - y[0]),
                y[0] * (28 - y[2]) - y[1],
                y[0] * y[1] - beta * y[2],
                (y[0] + 2) ** 2,
            ]

        start = [mpmath.mpf(value) for value in (*flows.lorenz().initial, 0)]
        yield mpmath.odefun(rates, 0, start, tol=mpmath.mpf(10) ** -18)


def _error(function, time):
    """Distance of an instant from the root nearby."""
    root = mpmath.findroot(function, mpmath.mpf(float(time)), tol=1e-34)
    return abs(float(root - mpmath.mpf(float(time))))


def test_lorenz_spikes(exact_lorenz):
    # Errors grow as exp(0.9 t); over 2 time units the spikes must be right to nearly all digits.
    with mpmath.workdps(22):
        train = integrate_and_fire(flows.lorenz(), 20, duration=2.0)
        assert len(train) >= 4
        for n, time in enumerate(train.time, start=1):
            assert _error(lambda t, n=n: exact_lorenz(t)[3] - 20 * n, time) < 2e-13
        train = threshold_crossings(
            flows.lorenz(), 24.5, signal="z", direction="both", duration=2.0
        )
        assert len(train) >= 4
        for time in train.time:
            assert _error(lambda t: exact_lorenz(t)[2] - 24.5, time) < 2e-13


def test_lorenz_states(exact_lorenz):
    with mpmath.workdps(22):
        time = np.linspace(0, 2, 21)
        states = simulate(flows.lorenz(), duration=2.0).sample(time)
        exact = np.array([[float(v) for v in exact_lorenz(float(t))[:3]] for t in time])
    np.testing.assert_allclose(states, exact, rtol=0, atol=1e-11)


def test_lorenz_is_symmetric_to_the_bit():
    # (x, y, z) -> (-x, -y, z) changes no rounding.
    x, y, z = flows.lorenz().initial
    one = threshold_crossings(flows.lorenz(), 0.5, direction="up", count=100)
    other = threshold_crossings(
        flows.lorenz(), -0.5, direction="down", count=100, initial=(-x, -y, z)
    )
    np.testing.assert_array_equal(one.time, other.time)


@pytest.mark.slow
def test_the_mean_interval_is_the_threshold_by_the_mean_signal():
    # <x> = 0, <x^2> = <x y> = beta <z> and <z> = 23.55 of Lorenz' attractor.
    train = integrate_and_fire(flows.lorenz(), 20, count=40_001, transient=50)
    assert train.intervals().mean() == pytest.approx(20 / (8 / 3 * 23.55 + 4), rel=0.005)
    # <x> = a <z> of Rössler's, from the averages of y' and x'.
    train = integrate_and_fire(flows.rossler(), 20, count=10_001, transient=200)
    motion = simulate(flows.rossler(), duration=10_000, transient=200)
    z = motion.sample(np.linspace(motion.start, motion.stop, 200_000))[:, 2]
    mean = 20 / (20 + 0.2 * z.mean())
    assert train.intervals().mean() == pytest.approx(mean, rel=1e-3)


def test_rosslers_shortest_orbit():
    # Proven by interval arithmetic (the CAPD library's Poincaré maps): through x = 0 at
    # y = -8.38094174282..., z = 0.02959006063..., with a period in the span below.
    start = (0.0, -8.3809417428299, 0.02959006063066)
    train = threshold_crossings(flows.rossler(), 0.0, count=3, initial=start)
    assert 5.8810884555537228 - 1e-12 < train.time[0] < 5.881088455554079 + 1e-12
    assert train.intervals() == pytest.approx([5.8810884555539] * 2, abs=1e-10)
    back = simulate(flows.rossler(), duration=train.time[0], initial=start).final
    np.testing.assert_allclose(back, start, rtol=0, atol=2e-12)


def test_rosslers_mean_period():
    train = threshold_crossings(flows.rossler(), 0.0, count=5001, transient=500)
    # Near that of the shortest orbit, around which the others wind.
    assert train.intervals().mean() == pytest.approx(5.87, abs=0.03)


@pytest.mark.parametrize("flow", [flows.lorenz(), flows.rossler()], ids=lambda flow: flow.name)
def test_intervals_predict_the_next_one(flow):
    # Sauer 1994: vectors of intervals fix the state, hence the interval that follows; a shuffled
    # neighbour is as wrong as any two intervals are different, sqrt(2) standard deviations.
    intervals = integrate_and_fire(flow, 20, count=6001, transient=100).intervals()
    shuffled = np.random.default_rng(1).permutation(intervals)
    assert _prediction_error(intervals) < 0.5
    assert _prediction_error(shuffled) > 1.2


def _prediction_error(x, dimension=4, known=4000):
    """RMS error of the nearest neighbour's prediction, by the standard deviation."""
    vectors = np.lib.stride_tricks.sliding_window_view(x[:-1], dimension)
    following = x[dimension:]
    nearest = cKDTree(vectors[:known]).query(vectors[known + 50 :])[1]
    error = following[nearest] - following[known + 50 :]
    return np.sqrt(np.mean(error**2)) / x.std()
