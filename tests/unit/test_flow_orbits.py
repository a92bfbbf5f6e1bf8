"""Periodic orbits of flows: what may be given, and what comes back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactsig import Flow, InvalidInput, find_periodic_orbit, flows
from impactsig.dynamics.periodic.flow_shooting import depends_on_time


def driven(t, y):
    return (math.cos(t) - 0.5 * y[0],)


def fast(t, y):
    return (math.cos(2 * math.pi * 100 * t) - 0.5 * y[0],)


def mathieu(t, y):
    return y[1], -(1 + 0.3 * math.cos(2 * t)) * y[0] - 0.2 * y[1]


def switched(t, y):
    return ((1.0 if t % 10 < 5 else -1.0) - 0.5 * y[0],)


def away(t, y):
    return (1.0 + y[0] ** 2,)


def test_a_forced_flow_is_found_without_a_guess_at_exactly_its_period():
    orbit = find_periodic_orbit(Flow(driven, (0.0,)), period=2 * math.pi)
    assert orbit.found
    assert orbit.stable
    assert orbit.forced
    assert orbit.period == 2 * math.pi
    assert orbit.state[0] == pytest.approx(0.5 / 1.25, abs=1e-12)  # (a cos t + sin t) / (1 + a^2)
    time = np.array([[0.3, 1.0], [2.0, 7.0]])
    expected = (0.5 * np.cos(time) + np.sin(time)) / 1.25
    np.testing.assert_allclose(orbit.sample(time)[..., 0], expected, atol=1e-11)


@pytest.mark.parametrize(
    ("flow", "period"),
    [
        (Flow(fast, (0.0,)), 0.01),
        (Flow(mathieu, (0.0, 0.0)), math.pi),
        (Flow(switched, (0.0,)), 10.0),
    ],
)
def test_a_force_is_seen_whatever_its_period(flow, period):
    assert depends_on_time(flow, period)
    assert depends_on_time(flow, 0.7 * period)


def test_a_flow_without_a_force_has_none():
    for flow in (flows.lorenz(), flows.rossler()):
        assert not depends_on_time(flow, 3.0)


def test_an_orbit_of_a_fast_force_keeps_its_period():
    orbit = find_periodic_orbit(Flow(fast, (0.0,)), period=0.01, guess=(1e-4,))
    assert orbit.found
    assert orbit.period == 0.01
    omega = 2 * math.pi * 100
    assert orbit.state[0] == pytest.approx(0.5 / (0.25 + omega**2), abs=1e-9)


def test_an_orbit_gone_round_twice_is_not_taken_for_one_of_two_turns():
    orbit = find_periodic_orbit(flows.rossler(), period=11.76)
    assert orbit.found
    once, back = orbit.sample([0.0, orbit.period / 2])
    assert np.abs(once - back).max() > 0.1


def test_what_is_not_found_says_so():
    orbit = find_periodic_orbit(flows.rossler(), period=0.4, guess=(9.0, 0.0, 2.0))
    assert orbit.status == "not converged"  # Rössler's flow has no orbit of so short a period
    assert "not converged" in repr(orbit)
    middle = math.sqrt(8 / 3 * 27)
    orbit = find_periodic_orbit(flows.lorenz(), period=1.0, guess=(middle - 0.01, middle, 27.0))
    assert orbit.status == "at rest"
    assert not orbit.found
    np.testing.assert_allclose(orbit.state, (middle, middle, 27), rtol=1e-9)
    with pytest.raises(InvalidInput) as error:
        find_periodic_orbit(Flow(away, (0.0,)), period=2.0)
    assert error.value.argument == "period"


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: find_periodic_orbit("lorenz", period=1.5), "system"),
        (lambda: find_periodic_orbit(Flow(driven, (0.0, 1.0)), period=1.5), "function"),
        (lambda: find_periodic_orbit(flows.lorenz(), period=0), "period"),
        (lambda: find_periodic_orbit(flows.lorenz(), period=math.nan), "period"),
        (lambda: find_periodic_orbit(flows.lorenz(), period=1.5, guess=(1, 2)), "initial"),
        (lambda: find_periodic_orbit(flows.lorenz(), period=1.5, tolerance=0), "tolerance"),
    ],
)
def test_bad_input_names_the_argument(make, argument):
    with pytest.raises(InvalidInput) as error:
        make()
    assert error.value.argument == argument
