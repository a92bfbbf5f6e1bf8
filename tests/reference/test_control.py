"""Control of chaos: against many digits, closed forms, and what the thesis and papers report."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest

from impactsig import (
    OGY,
    Controlled,
    DelayedFeedback,
    Flow,
    Oscillator,
    RungeKutta,
    Stop,
    find_periodic_orbit,
    flows,
    orbit_period,
    orbit_stability,
    scenes,
    simulate,
    stability_chart,
)
from impactsig.control.running.delayed import DelayedRun
from impactsig.oscillators import Force, KelvinVoigt
from tests import naive_control

BEAM = scenes.karpodinis(20.3355)
LIMIT = 0.1
START = (0.3, 0.1)


@pytest.fixture(scope="module")
def first():
    return find_periodic_orbit(BEAM, 1, impacts=1)


@pytest.fixture(scope="module")
def second():
    return find_periodic_orbit(BEAM, 2, impacts=1)


@functools.lru_cache
def in_many_digits(end, **options):
    """Pieces, impacts and forcing period of the beam under a gain of 0.15 from 2 periods on."""
    with mpmath.workdps(25):
        omega = mpmath.mpf(BEAM.angular_forcing_frequency)
        period = 2 * mpmath.pi / omega
        known = (mpmath.mpf(0.03), omega, mpmath.mpf(0.25), mpmath.mpf(0.2), mpmath.mpf(0.15))
        start = tuple(mpmath.mpf(value) for value in START)
        pieces, hits = naive_control.controlled(
            *known, period, 2 * period, end * period, initial=start, **options
        )
    return pieces, [float(hit) for hit in hits], period


KINDS = {
    "velocity, limited": ({"limit": mpmath.mpf(LIMIT)}, {"limit": LIMIT}),
    "displacement": ({"velocity": False}, {"signal": "displacement"}),
    "with memory": (
        {"limit": mpmath.mpf(LIMIT), "memory": mpmath.mpf(0.5)},
        {"limit": LIMIT, "memory": 0.5},
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_motion_force_and_impacts_are_those_of_the_method_of_steps(kind):
    naive, given = KINDS[kind]
    pieces, hits, period = in_many_digits(5, **naive)
    motion = simulate(
        Controlled(BEAM, DelayedFeedback(0.15, 1, **given), start=2), periods=5, initial=START
    )
    shares = np.linspace(0.013, 4.987, 61)
    exact = np.array(
        [[float(c) for c in naive_control.state(pieces, own * period)] for own in shares]
    )
    time = shares * BEAM.forcing_period
    x, v = motion.sample(time)
    assert len(motion.impacts) == len(hits) >= 2
    np.testing.assert_allclose(motion.impacts.time / BEAM.time_unit, hits, rtol=0, atol=2e-11)
    for mine, own in zip((x, v, motion.force(time)), exact.T, strict=True):
        np.testing.assert_allclose(mine, own, rtol=0, atol=2e-11)
    assert np.abs(exact[:, 2]).max() > 0.02  # there was something to follow


@pytest.mark.parametrize(
    "given",
    [
        {"gain": 0.15, "limit": LIMIT},
        {"gain": 0.15, "signal": "displacement", "limit": 0.03},
        {"gain": 0.15, "limit": LIMIT, "memory": 0.5},
        {"gain": 1.2, "limit": 0.4},
        {"gain": -0.1},
    ],
)
def test_power_series_lose_nothing_but_rounding(given):
    """Seven periods against 25 digits; steps of Dormand and Prince's method lose more."""
    machine = scenes.karpodinis(21.3, restitution=0.6)
    known = {name: mpmath.mpf(own) for name, own in given.items() if name in ("limit", "memory")}
    with mpmath.workdps(25):
        omega = mpmath.mpf(machine.angular_forcing_frequency)
        period = 2 * mpmath.pi / omega
        numbers = (mpmath.mpf(value) for value in (0.03, omega, 0.25, 0.6, given["gain"]))
        pieces, hits = naive_control.controlled(
            *numbers, period, 2 * period, 7 * period, initial=(mpmath.mpf(-0.2), mpmath.mpf(0.25)),
            velocity=given.get("signal") != "displacement", **known,
        )  # fmt: skip
        shares = np.linspace(0.013, 6.987, 61)
        exact = [[float(c) for c in naive_control.state(pieces, a * period)] for a in shares]
    control = Controlled(machine, DelayedFeedback(**given), start=2)
    time = shares * machine.forcing_period
    for method, bound in ((None, 3e-14), (RungeKutta(1e-14), 1e-12)):
        motion = simulate(control, periods=7, initial=(-0.2, 0.25), method=method)
        assert len(motion.impacts) == len(hits) >= 3
        seen = np.stack([*motion.sample(time), motion.force(time)])
        assert np.abs(seen - np.transpose(exact)).max() < bound


@pytest.mark.parametrize("signal", ["velocity", "displacement"])
@pytest.mark.parametrize("law", [KelvinVoigt(50.0, 0.5), KelvinVoigt(5000.0, 2.0, ends="gap")])
def test_power_series_in_soft_contacts_are_the_steps_of_a_tight_tolerance(law, signal):
    machine = replace(scenes.karpodinis(21.3), stops=(Stop(1.0, law),))
    control = Controlled(machine, DelayedFeedback(0.15, 1, signal=signal, limit=0.05), start=4)
    found, close = (
        simulate(control, periods=9, method=method) for method in (None, RungeKutta(1e-14))
    )
    assert found.impact_count == close.impact_count >= 3
    time = np.linspace(0.01, 8.99, 300) * machine.forcing_period
    assert len(found._engine.line.laps) < len(close._engine.line.laps) / 3
    for mine, own in zip(found.sample(time), close.sample(time), strict=True):
        np.testing.assert_allclose(mine, own, rtol=0, atol=2e-12)
    np.testing.assert_allclose(found.force(time), close.force(time), rtol=0, atol=2e-12)


def test_the_order_is_that_of_the_method():
    """Steps of one length between the places where the delay is not smooth: error ~ h^8."""
    pieces, _, period = in_many_digits(5, limit=mpmath.mpf(LIMIT))
    x, v, _ = (float(c) for c in naive_control.state(pieces, 5 * period))
    errors = []
    lengths = (0.8, 0.4)
    for length in lengths:
        feedback = DelayedFeedback(0.15, 1, LIMIT)
        going = DelayedRun(BEAM, [feedback], START, 0.0, RungeKutta(), 1e-6)
        # No error is too great, so that every step is as long as it may be.
        going.engine._problem = going.engine._problem._replace(longest=length, tolerance=1e6)
        going.to(2.0, None)
        going.to(5.0, feedback)
        motion, _ = going.motion()
        errors.append(math.hypot(motion.final[0] - x, motion.final[1] - v))
    assert errors[0] < 1e-4
    assert math.log(errors[0] / errors[1]) / math.log(lengths[0] / lengths[1]) > 7.5


@pytest.mark.parametrize(
    ("gain", "periods", "locks"),
    [(0.15, 1, True), (0.01, 1, False), (0.15, 2, True), (0.015, 2, True)],
)
def test_the_cases_of_the_thesis(gain, periods, locks):
    motion = simulate(
        Controlled(BEAM, DelayedFeedback(gain, periods, LIMIT), start=200), periods=900
    )
    found = orbit_period(motion, tolerance=1e-6)
    _, rms = motion.effort()
    if locks:
        assert str(found) == f"period(1, {periods})"
        assert rms[-20:].max() < 3e-8
    else:
        assert not found
        assert rms[-20:].min() > 1e-5


def test_migration_from_orbit_to_orbit_and_back(first, second):
    near, far = DelayedFeedback(0.15, 1, LIMIT), DelayedFeedback(0.15, 2, LIMIT)
    motion = simulate(
        Controlled(BEAM, [(100, near), (300, far), (600, near), (800, None)]), periods=950
    )
    x, v = motion.stroboscopic()
    for at in (299, 799):
        assert math.hypot(x[at] - first.state[0], v[at] - first.state[1]) < 1e-6
    off = np.hypot(x[598:600] - second.state[0], v[598:600] - second.state[1])
    assert off.min() < 1e-6
    assert np.ptp(x[-60:]) > 0.05  # let go, it leaves
    intervals = np.diff(motion.impacts.time) / BEAM.forcing_period
    ends = motion.impacts.time[1:] / BEAM.forcing_period
    np.testing.assert_allclose(intervals[(ends > 250) & (ends < 300)], 1, atol=1e-6)
    np.testing.assert_allclose(intervals[(ends > 570) & (ends < 600)], 2, atol=1e-5)


# -- how fast it locks -------------------------------------------------------------------------


def decay(orbit, feedback, offset):
    """Factor per period of the orbit by which a motion that starts beside it comes nearer."""
    motion = simulate(
        Controlled(orbit.system, feedback),
        periods=160 * orbit.periods,
        initial=(orbit.state[0] + offset, orbit.state[1]),
        phase=orbit.phase,
    )
    x, v = (own[:: orbit.periods] for own in motion.stroboscopic(orbit.phase))
    off = np.hypot(x - orbit.state[0], v - orbit.state[1])
    laps = np.arange(len(off))
    seen = (laps > 2 * feedback.delay / orbit.periods) & (off > 1e-11)
    seen &= np.cumprod(off > 1e-12).astype(bool)
    assert seen.sum() >= 15
    return math.exp(np.polyfit(laps[seen], np.log(off[seen]), 1)[0])


@pytest.mark.parametrize(
    ("periods", "gain", "options"),
    [
        (1, 0.15, {"limit": LIMIT}),
        (1, 0.45, {"limit": LIMIT}),
        (1, 0.15, {"limit": 0.02}),  # within the pulses the limit matters, however near it is
        (1, 0.15, {"limit": LIMIT, "memory": 0.3}),
        (2, 0.015, {"limit": LIMIT}),
    ],
)
def test_decay_is_what_the_linearised_motion_says(first, second, periods, gain, options):
    orbit = first if periods == 1 else second
    feedback = DelayedFeedback(gain, periods, **options)
    told = orbit_stability(orbit, feedback)
    assert told.stable
    seen = np.mean([math.log(decay(orbit, feedback, offset)) for offset in (1e-5, -1e-5)])
    assert seen == pytest.approx(math.log(told.growth), rel=0.05)


@pytest.mark.parametrize(
    "feedback",
    [DelayedFeedback(0.05, 1, LIMIT), DelayedFeedback(0.1, 3, LIMIT, memory=0.3)],
    ids=["too weak", "three delays and a memory"],
)
def test_growth_where_control_fails(first, feedback):
    """A motion leaves an orbit that control does not hold as fast as the linearised motion does."""
    told = orbit_stability(first, feedback)
    assert not told.stable
    start = (first.state[0] + 1e-8, first.state[1])
    motion = simulate(Controlled(BEAM, feedback), periods=110, initial=start)
    x, v = motion.stroboscopic()
    off = np.log(np.hypot(x - first.state[0], v - first.state[1]))
    end = int(np.argmax(off > math.log(1e-4)))
    laps = np.flatnonzero(off[:end] > math.log(1e-6))
    assert len(laps) > 10
    assert np.polyfit(laps, off[laps], 1)[0] == pytest.approx(math.log(told.growth), rel=0.01)


def test_without_gain_the_multipliers_are_the_orbits(first):
    told = orbit_stability(first, DelayedFeedback(0.0, 1))
    np.testing.assert_allclose(told.multipliers[:2], first.multipliers, rtol=1e-8)
    assert np.abs(told.multipliers[2:]).max() < 1e-8  # what is fed back with no gain is forgotten
    assert told.exponent == pytest.approx(first.exponents[0], rel=1e-8)
    period = 2 * math.pi / BEAM.angular_forcing_frequency
    assert told.exponent == pytest.approx(math.log(abs(first.multipliers[0])) / period, rel=1e-8)


@pytest.mark.parametrize(
    ("stop", "gain", "signal"),
    [("soft", 0.05, "velocity"), ("rigid", 0.1, "displacement")],
)
def test_multipliers_where_no_pulse_is_left(first, stop, gain, signal):
    """A motion beside the orbit comes to multiply its difference by the greatest of them."""
    orbit = first
    if stop == "soft":
        oscillator = replace(BEAM, stops=(Stop(1.0, KelvinVoigt.equivalent(0.2, 500.0)),))
        orbit = find_periodic_orbit(oscillator, 1, guess=first.state)
    feedback = DelayedFeedback(gain, 1, signal=signal)
    told = orbit_stability(orbit, feedback)
    assert told.growth == abs(told.multipliers[0])
    assert abs(told.multipliers[0]) > 1.5 * abs(told.multipliers[1])
    start = (orbit.state[0] + (1e-5 if told.stable else 1e-9), orbit.state[1])
    motion = simulate(
        Controlled(orbit.system, feedback), periods=26, initial=start, phase=orbit.phase
    )
    off = motion.stroboscopic(orbit.phase)[0] - orbit.state[0]
    ratios = (off[1:] / off[:-1])[(np.abs(off[:-1]) > 1e-8) & (np.abs(off[:-1]) < 5e-6)]
    assert len(ratios) >= 4
    np.testing.assert_allclose(ratios[-4:], told.multipliers[0].real, rtol=2e-3)


def test_chart_agrees_with_single_orbits_and_the_rule_of_odd_numbers(first):
    """At twice the delay (1, 1) stays unstable: over the delay it has one multiplier above 1.

    Nakajima's rule: orbits with an odd number of them cannot be stabilised.
    """
    chart = stability_chart(first, [0.0, 0.05, 0.15], [1, 2], limit=LIMIT, laps=200)
    assert chart.complete
    assert not chart.errors
    assert list(chart.parameters["delay"]) == [1, 2]
    growth = chart["growth"]
    np.testing.assert_allclose(growth[0], abs(first.multipliers[0]), rtol=1e-3)
    assert growth[2, 0] < 1 < growth[1, 0]
    assert (growth[:, 1] > 1).all()
    assert growth[2, 0] == orbit_stability(first, DelayedFeedback(0.15, 1, LIMIT), laps=200).growth


# -- OGY -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("parameter", "limit"), [("amplitude", 0.03), ("load", 0.1)])
@pytest.mark.parametrize("periods", [1, 2])
def test_ogy_stabilises_orbits_with_an_effort_that_decays(first, second, periods, parameter, limit):
    orbit = first if periods == 1 else second
    how = OGY(orbit, limit=limit, parameter=parameter)
    motion = simulate(Controlled(BEAM, how, start=100), periods=800, initial=START)
    assert str(orbit_period(motion, tolerance=1e-9)) == f"period(1, {periods})"
    _, rms = motion.effort()
    assert rms[:100].max() == 0
    assert 1e-4 < rms[100:].max() <= limit
    assert rms[-100:].max() < 1e-13


def test_ogy_leaves_the_stable_multiplier(first, second):
    for orbit in (first, second):
        how = OGY(orbit, limit=0.03)
        assert how.multipliers[0] == pytest.approx(orbit.multipliers[1], rel=1e-6)
        assert abs(how.multipliers[1]) < 1e-9


def test_ogy_moves_between_orbits_and_its_motion_is_that_of_the_perturbed_oscillator(first, second):
    schedule = [(50, OGY(first, 0.03)), (300, OGY(second, 0.03)), (600, None)]
    motion = simulate(Controlled(BEAM, schedule), periods=700, initial=START)
    x, v = motion.stroboscopic()
    assert math.hypot(x[299] - first.state[0], v[299] - first.state[1]) < 1e-9
    off = np.hypot(x[598:600] - second.state[0], v[598:600] - second.state[1])
    assert off.min() < 1e-9
    # Newton's law: the velocity gained between impacts is the integral of all forces.
    period = BEAM.forcing_period
    nudged = np.flatnonzero(motion.effort()[1][:-1] > 1e-4)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    tried = 0
    for n in nudged:
        edges = np.concatenate([[n * period], motion.impacts.time, [(n + 1) * period]])
        edges = np.unique(edges[(edges >= n * period) & (edges <= (n + 1) * period)])
        for low, high in zip(edges[:-1] + 1e-9, edges[1:] - 1e-9, strict=True):
            time = (low + high) / 2 + (high - low) / 2 * nodes
            x, v = motion.sample(time)
            force = 0.25 * np.cos(BEAM.angular_forcing_frequency * time / BEAM.time_unit)
            push = force + motion.force(time) - 0.06 * v - x
            gained = push @ weights * (high - low) / 2 / BEAM.time_unit
            ends = motion.sample([low, high])[1]
            assert ends[1] - ends[0] == pytest.approx(gained, abs=1e-11)
            tried += 1
    assert tried >= 5


# -- flows ---------------------------------------------------------------------------------------


def constant_rate(t, y, c):
    return (c,)


def test_a_flow_with_a_delay_in_closed_form():
    """y' = c, and from tau on y' = c + K (y(t - tau) - y): two laps of the method of steps."""
    c, gain, tau = 1.3, 0.7, 2.0
    flow = Flow(constant_rate, initial=(0.0,), parameters=(c,))
    course = simulate(Controlled(flow, DelayedFeedback(gain, tau, signal=0)), duration=3 * tau)
    s = np.linspace(0, tau, 50)
    first_lap = c * s + c * tau * np.exp(-gain * s)
    start = c * tau * (1 + np.exp(-gain * tau))
    second_lap = c * s + (start + gain * c * tau * s) * np.exp(-gain * s)
    np.testing.assert_allclose(course.sample(s)[:, 0], c * s, atol=1e-13)
    np.testing.assert_allclose(course.sample(tau + s)[:, 0], first_lap, atol=1e-12)
    np.testing.assert_allclose(course.sample(2 * tau + s)[:, 0], second_lap, atol=1e-12)
    force = gain * (first_lap - second_lap)
    np.testing.assert_allclose(course.force(2 * tau + s)[1:-1], force[1:-1], atol=1e-12)


def test_a_limit_in_closed_form():
    """With a limit the first lap begins at -F0, until the distance has fallen to F0 / K."""
    c, gain, tau, limit = 1.0, 0.5, 2.0, 0.4
    flow = Flow(constant_rate, initial=(0.0,), parameters=(c,))
    course = simulate(
        Controlled(flow, DelayedFeedback(gain, tau, limit, signal=0)), duration=2 * tau
    )
    # The distance y - y(t - tau) falls from c tau at the rate F0 (both sides gain c).
    s = np.linspace(0, tau, 80)
    until = (c * tau - limit / gain) / limit
    assert until > tau  # the limit lasts for the whole lap
    np.testing.assert_allclose(course.force(tau + s)[1:-1], -limit, atol=1e-13)
    wide = simulate(Controlled(flow, DelayedFeedback(gain, tau, 0.8, signal=0)), duration=2 * tau)
    until = (c * tau - 0.8 / gain) / 0.8
    distance = np.where(s < until, c * tau - 0.8 * s, 0.8 / gain * np.exp(-gain * (s - until)))
    np.testing.assert_allclose(wide.sample(tau + s)[:, 0], c * s + distance, atol=1e-12)


@pytest.mark.parametrize(("delay", "turns"), [(5.881, 1), (17.52, 3)])
def test_roessler_is_controlled_as_pyragas_did(delay, turns):
    """Pyragas' orbits of one and three turns, K = 0.2 on y, with a limit, as he advises.

    Without one the feedback of 17.5 also has another attractor, on which it does not vanish.
    """
    feedback = DelayedFeedback(0.2, delay, limit=0.1, signal="y")
    course = simulate(Controlled(flows.rossler(), feedback, start=100), duration=900)
    time = np.linspace(800, 900, 4001)
    assert np.abs(course.force(time)).max() < 0.01
    before = np.abs(course.force(np.linspace(100, 120, 400))).max()
    assert before == pytest.approx(0.1)
    y = course.sample(time)[:, 1]
    crest = (y[1:-1] > y[:-2]) & (y[1:-1] > y[2:])
    assert np.count_nonzero(crest) == pytest.approx(100 / delay * turns, abs=1.5)


def test_a_single_force_on_a_linear_oscillator():
    """Without stops and with a delay of one period the steady motion feels no force at all."""
    oscillator = Oscillator(damping=0.1, forces=(Force(1.0, 0.8),))
    motion = simulate(Controlled(oscillator, DelayedFeedback(0.3, 1)), periods=100)
    _, rms = motion.effort()
    assert rms[2] > 1e-3
    assert rms[-1] < 1e-9
    response = 1 / complex(1 - 0.64, 0.08)
    assert motion.final[0] == pytest.approx(response.real, abs=1e-9)
    assert motion.final[1] == pytest.approx(-0.8 * response.imag, abs=1e-9)
