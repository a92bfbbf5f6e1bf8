"""How fast orbits are come to under delayed feedback: flows, friction, rest."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import lambertw

from impactsig import (
    Controlled,
    DelayedFeedback,
    Flow,
    Friction,
    KelvinVoigt,
    Oscillator,
    Rigid,
    Stop,
    find_periodic_orbit,
    flows,
    orbit_stability,
    simulate,
    stability_chart,
)
from impactsig.control.stability._oscillator_pieces import of_oscillator
from impactsig.control.stability._variation import State
from impactsig.oscillators import Force
from tests import naive_control

ROSSLER = flows.rossler()


@pytest.fixture(scope="module")
def cycle():
    return find_periodic_orbit(ROSSLER, period=5.88)


# -- orbits of flows -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("near", "period", "multiplier"),
    [
        (5.88, 5.88108845586, -2.403953527),
        pytest.param(11.76, 11.7586260717, -3.51200698, marks=pytest.mark.slow),
    ],
)
def test_cycles_of_roessler_are_those_of_the_tables(near, period, multiplier):
    """Periods and expanding multipliers of its shortest cycles, [Cvitanovic2020]_, extras."""
    orbit = find_periodic_orbit(ROSSLER, period=near)
    assert orbit.found
    assert not orbit.stable
    assert orbit.period == pytest.approx(period, abs=1e-9)
    assert orbit.multipliers[0].real == pytest.approx(multiplier, rel=1e-8)
    assert orbit.multipliers[1] == pytest.approx(1, abs=1e-7)


def test_an_orbit_and_its_multipliers_in_closed_form():
    """The unit circle, on which r' = r (1 - r^2) / 2 and z' = -z/5: exp(-T), exp(-T / 5), 1."""

    def rates(t, y):
        grow = (1 - y[0] ** 2 - y[1] ** 2) / 2
        return y[0] * grow - y[1], y[1] * grow + y[0], -0.2 * y[2]

    orbit = find_periodic_orbit(Flow(rates, (0.5, 0.0, 0.3)), period=6.0, guess=(1.1, 0.1, 0.1))
    turn = 2 * math.pi
    assert orbit.found
    assert orbit.stable
    assert orbit.period == pytest.approx(turn, rel=1e-12)
    assert math.hypot(*orbit.state[:2]) == pytest.approx(1, rel=1e-12)
    expected = [1, math.exp(-turn / 5), math.exp(-turn)]
    np.testing.assert_allclose(orbit.multipliers.real, expected, rtol=1e-8)
    points = orbit.sample([0.0, turn / 4, 5 * turn / 4])
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 1, rtol=1e-11)
    np.testing.assert_allclose(points[1], points[2], atol=1e-12)


# -- multipliers under control ---------------------------------------------------------------------


def by_lambert(rate, gain, delay, branches=(0, -1)):
    """exp(s tau) of s = rate - K + K exp(-s tau), which z' = rate z + K (z(t - tau) - z) has."""
    own = rate - gain
    return np.array(
        [np.exp(own * delay + lambertw(gain * delay * np.exp(-own * delay), n)) for n in branches]
    )


def driven(t, y, rate):
    return (rate * y[0] + math.cos(t),)


@pytest.mark.parametrize("laps", [1, 2])
def test_a_forced_flow_in_closed_form(laps):
    """x' = x / 5 + cos t under control: an equation with constant coefficients."""
    rate, gain, turn = 0.2, 0.7, 2 * math.pi
    orbit = find_periodic_orbit(Flow(driven, (0.0,), (rate,)), period=turn, guess=(0.0,))
    assert orbit.forced
    assert orbit.state[0] == pytest.approx(-rate / (1 + rate**2), abs=1e-11)
    assert orbit.multipliers[0].real == pytest.approx(math.exp(rate * turn), rel=1e-10)
    told = orbit_stability(orbit, DelayedFeedback(gain, laps * turn, signal=0))
    # Over one period of the orbit, of which a delay has several.
    known = by_lambert(rate, gain, laps * turn, range(-4, 5)) ** (1 / laps)
    assert told.growth == pytest.approx(np.abs(known).max(), rel=1e-9)
    # The greatest real part of s, of exp(s t).
    own, tau = rate - gain, laps * turn
    roots = [own + lambertw(gain * tau * np.exp(-own * tau), n) / tau for n in range(-4, 5)]
    assert told.exponent == pytest.approx(max(s.real for s in roots), abs=1e-10)


def test_a_cycle_in_closed_form():
    """Beside the unit circle a third coordinate, controlled: its multipliers are Lambert's."""

    def rates(t, y):
        grow = (1 - y[0] ** 2 - y[1] ** 2) / 2
        return y[0] * grow - y[1], y[1] * grow + y[0], 0.1 * y[2]

    orbit = find_periodic_orbit(Flow(rates, (1.0, 0.0, 0.0)), period=6.3, guess=(1.0, 0.0, 0.0))
    told = orbit_stability(orbit, DelayedFeedback(0.5, orbit.period, signal="z"))
    known = by_lambert(0.1, 0.5, orbit.period, (0, 1, -1))
    assert not told.stable  # an odd number of them above 1 cannot be stabilised
    assert told.multipliers[0].real == pytest.approx(known[0].real, rel=1e-9)
    # The one along the circle is left out.
    assert np.abs(told.multipliers - 1).min() > 0.05
    np.testing.assert_allclose(
        np.sort_complex(told.multipliers[1:3]), np.sort_complex(known[1:]), rtol=1e-7
    )


def roessler(y):
    return np.array([-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - 5.7)])


def slopes(y):
    return np.array([[0, -1, -1], [1, 0.2, 0], [y[2], 0, y[0] - 5.7]])


@pytest.mark.parametrize("gain", [pytest.param(0.2, marks=pytest.mark.slow), 1.0])
def test_multipliers_of_controlled_roessler_are_the_naive_ones(cycle, gain):
    rough, fine = (
        naive_control.flow_multipliers(roessler, slopes, cycle.state, cycle.period, 1, gain, steps)
        for steps in (120, 240)
    )
    told = orbit_stability(cycle, DelayedFeedback(gain, cycle.period, signal="y"))
    for own in told.multipliers[:2]:
        one, two = (values[np.argmin(np.abs(values - own))] for values in (rough, fine))
        assert (4 * two - one) / 3 == pytest.approx(own, abs=1e-3)  # without the h^2 of the rule


@pytest.mark.parametrize(("gain", "memory"), [(0.2, 0.0), (0.15, 0.0), (0.5, 0.0), (0.4, 0.3)])
def test_controlled_roessler_comes_to_its_orbit_as_fast_as_told(cycle, gain, memory):
    """The force, once a period, obeys the recurrence that the greatest multipliers make."""
    feedback = DelayedFeedback(gain, cycle.period, signal="y", memory=memory)
    told = orbit_stability(cycle, feedback)
    assert told.stable
    start = cycle.state + np.array([1e-4, 0, 0])
    course = simulate(
        Controlled(ROSSLER, feedback), duration=70 * cycle.period, initial=start.tolist()
    )
    force = course.force((np.arange(12, 70) + 0.3) * cycle.period)
    force = force[: int(np.argmax(np.abs(force) < 1e-11)) or None]
    rows = np.stack([force[1:-1], force[:-2]], axis=1)
    share = np.linalg.lstsq(rows, force[2:], rcond=None)[0]
    seen = np.abs(np.roots([1, -share[0], -share[1]])).max()
    assert math.log(seen) == pytest.approx(math.log(told.growth), rel=0.05)


def test_a_chart_of_a_flow(cycle):
    chart = stability_chart(cycle, [0.0, 0.2, 1.0], [1, 2], signal="y")
    np.testing.assert_allclose(chart.parameters["delay"], [cycle.period, 2 * cycle.period])
    growth = chart["growth"]
    np.testing.assert_allclose(growth[0], abs(cycle.multipliers[0]), rtol=1e-6)
    assert growth[1, 0] < 1 < growth[2, 0]


# -- friction and rest -----------------------------------------------------------------------------

SLOW, SWIFT = (Force(1.0, 0.3),), (Force(1.0, 0.8),)
MACHINES = {
    "rubs": Oscillator(damping=0.1, forces=(Force(1.0, 0.7),), friction=Friction(0.05)),
    "sticks": Oscillator(damping=0.1, forces=SLOW, friction=Friction(0.5)),
    "sticks and slips": Oscillator(damping=0.1, forces=SLOW, friction=Friction(0.4, 0.6)),
    "rubs and hits": Oscillator(
        damping=0.05, forces=SWIFT, stops=(Stop(0.8, Rigid(0.7)),), friction=Friction(0.05)
    ),
    "rubs before a soft stop": Oscillator(
        damping=0.05, forces=SWIFT, stops=(Stop(0.8, KelvinVoigt(20.0, 0.3)),),
        friction=Friction(0.05),
    ),
    "a stop that only pushes": Oscillator(
        damping=0.05, forces=SWIFT, stops=(Stop(0.8, KelvinVoigt(20.0, 1.3, "force")),)
    ),
}  # fmt: skip


# Velocity feedback of what sticks harder than it slips is refused: test_bad_input_to_stability.
@pytest.mark.parametrize(
    ("machine", "signal"),
    [
        pair
        for pair in itertools.product(MACHINES, ("velocity", "displacement"))
        if pair != ("sticks and slips", "velocity")
    ],
)
def test_differences_from_orbits_that_rub_and_stick(machine, signal):
    """Lap by lap, from the first, they are those of the linearised motion."""
    oscillator, off, laps = MACHINES[machine], 1e-6, 6
    settled = simulate(oscillator, periods=300).final[:2]
    orbit = find_periodic_orbit(oscillator, 1, guess=settled)
    assert orbit.found
    feedback = DelayedFeedback(0.15, 1, signal=signal)
    free, held = (of_oscillator(orbit, own) for own in (replace(feedback, gain=0.0), feedback))
    pieces = len(held.pieces)
    state = State(np.array([[off], [0.0]]), [np.zeros((pieces, 28, 1))], [np.zeros((pieces, 1, 1))])
    told = [off]
    for k in range(laps):
        state = (held if k else free).lap(state)
        told.append(state.now[0, 0])
    motion = simulate(
        Controlled(oscillator, feedback),
        periods=laps + 0.01,
        phase=orbit.phase,
        initial=(orbit.state[0] + off, orbit.state[1]),
    )
    seen = motion.stroboscopic(orbit.phase)[0] - orbit.state[0]
    np.testing.assert_allclose(seen, told, rtol=2e-3, atol=1e-4 * off)
    if held.linear:
        growth = orbit_stability(orbit, feedback).growth
        assert growth == pytest.approx(greatest(held), rel=1e-6)


def greatest(variation):
    """Modulus of the greatest eigenvalue of the map of a lap, as a full matrix."""
    pieces = len(variation.pieces)
    size = 2 + pieces * 28
    columns = np.eye(size)
    state = State(
        columns[:2], [columns[2:].reshape(pieces, 28, size)], [np.zeros((pieces, 1, size))]
    )
    after = variation.lap(state)
    lap = np.concatenate([after.now, after.late[0].reshape(-1, size)])
    return np.abs(np.linalg.eigvals(lap)).max()


@pytest.mark.parametrize("signal", ["velocity", "displacement"])
def test_a_rest_at_a_stop_leaves_nothing_of_a_difference(signal):
    oscillator = Oscillator(
        damping=0.1, load=0.3, forces=(Force(1.0, 0.5),), stops=(Stop(0.0, Rigid(0.5)),)
    )
    settled = simulate(oscillator, periods=60, phase=4.0).final[:2]
    orbit = find_periodic_orbit(oscillator, 1, guess=settled, phase=4.0)
    assert orbit.motion().stick_count
    for memory in (0.0, 0.4):
        told = orbit_stability(orbit, DelayedFeedback(0.5, 1, signal=signal, memory=memory))
        assert told.stable
        assert told.growth == memory
    assert orbit_stability(orbit, DelayedFeedback(0.5, 1, signal=signal)).exponent == -math.inf
    motion = simulate(
        Controlled(oscillator, DelayedFeedback(0.5, 1, signal=signal)),
        periods=4.01,
        phase=4.0,
        initial=(orbit.state[0] + 1e-5, orbit.state[1]),
    )
    off = motion.stroboscopic(4.0)[0] - orbit.state[0]
    assert off[0] > 9e-6
    assert np.abs(off[2:]).max() < 1e-12
