"""Control that sees nothing but the intervals between spikes."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from impactsig import (
    OGY,
    Controlled,
    Hertz,
    IntervalFeedback,
    InvalidInput,
    KelvinVoigt,
    Stop,
    find_periodic_orbit,
    flows,
    orbit_period,
    orbit_stability,
    scenes,
    simulate,
)
from impactsig.control.stability.crossing_map import crossing_maps_of
from impactsig.control.stability.impact_map import impact_maps_of

BEAM = scenes.karpodinis(20.3355)
SOFT = {
    "linear": replace(BEAM, stops=(Stop(1.0, KelvinVoigt(50.0, 2.0)),)),
    "hertz": replace(BEAM, stops=(Stop(1.0, Hertz(300.0, restitution=0.5)),)),
}
ROSSLER = flows.rossler()
SEEN = {"signal": "x", "level": 0.0}


@pytest.fixture(scope="module")
def orbits():
    return {n: find_periodic_orbit(BEAM, n, impacts=1) for n in (1, 2)}


@pytest.fixture(scope="module")
def turns():
    return {m: find_periodic_orbit(ROSSLER, period=5.88 * m) for m in (1, 2)}


@functools.cache
def soft_orbit(stop, periods):
    return find_periodic_orbit(SOFT[stop], periods, impacts=1)


def differences(orbit, feedback, laps=60):
    """Of a motion beside the orbit from it, once in each period of it."""
    beside = (orbit.state[0] + 1e-5, orbit.state[1])
    motion = simulate(
        Controlled(orbit.system, feedback), periods=laps * orbit.periods, initial=beside
    )
    return (np.stack(motion.stroboscopic(), axis=1) - orbit.state)[:: orbit.periods]


def decay(orbit, feedback, floor=1e-11):
    """Factor by which a motion beside the orbit comes nearer in a period of it."""
    return slope(np.hypot(*differences(orbit, feedback).T), floor)


def greatest_multiplier(orbit, feedback):
    """That of the recurrence which the differences fulfil, by Prony's method.

    Where several multipliers are equally great, differences do not shrink as one exponential.
    """
    off = np.diff(differences(orbit, feedback), axis=0)[3:]
    size = np.hypot(*off.T)
    off = off[: int(np.argmax(size < 1e-9))]
    many = 3
    rows = np.concatenate([off[k : len(off) - many + k, :, None] for k in range(many + 1)], axis=2)
    rows /= np.linalg.norm(rows, axis=(1, 2), keepdims=True)
    rows = rows.reshape(-1, many + 1)
    past = np.linalg.lstsq(rows[:, :many], rows[:, many], rcond=None)[0]
    return np.abs(np.roots([1.0, *-past[::-1]])).max()


def slope(off, floor):
    """Factor from one entry to the next, from the fifth until they are lost in rounding."""
    laps = np.arange(len(off))
    clear = (laps > 4) & np.cumprod(off > floor).astype(bool)
    assert clear.sum() > 8
    return math.exp(np.polyfit(laps[clear], np.log(off[clear]), 1)[0])


def decay_of_flow(orbit, feedback, many, laps=40):
    """The same, seen in the intervals between crossings, of which the orbit has so many."""
    silent = replace(feedback, gain=0.0)
    alone = simulate(Controlled(ROSSLER, silent), duration=3 * orbit.period, initial=orbit.state)
    on_it = alone.spikes.intervals()[:many]
    beside = simulate(
        Controlled(ROSSLER, feedback), duration=laps * orbit.period, initial=orbit.state + 1e-4
    )
    intervals = beside.spikes.intervals()
    intervals = intervals[: len(intervals) // many * many].reshape(-1, many)
    return slope(np.linalg.norm(intervals - on_it, axis=1), 1e-10)


@pytest.mark.parametrize("parameter", ["amplitude", "load"])
@pytest.mark.parametrize("periods", [1, 2])
def test_the_impact_map_has_the_multipliers_of_the_orbit(orbits, periods, parameter):
    (linear,), intervals = impact_maps_of(orbits[periods], parameter)
    assert intervals == pytest.approx([periods], abs=1e-9)
    found = np.sort(np.linalg.eigvals(linear.matrix))
    assert found == pytest.approx(np.sort(orbits[periods].multipliers), rel=1e-7)


def test_it_locks_the_beam_from_its_chaos(orbits):
    feedback = IntervalFeedback.fastest(orbits[1], limit=0.03)
    assert orbit_stability(orbits[1], feedback).stable
    motion = simulate(Controlled(BEAM, feedback, start=50), periods=700)
    assert str(orbit_period(motion, tolerance=1e-9)) == "period(1, 1)"
    x, v = motion.stroboscopic()
    assert (x[-1], v[-1]) == pytest.approx(tuple(orbits[1].state), abs=1e-9)
    assert motion.effort()[1][-20:].max() < 1e-9


@pytest.mark.parametrize(
    ("periods", "options"),
    [
        (1, {"gain": -4.0, "target": 1.0, "memory": 0.3, "parameter": "load"}),
        (1, {"gain": -0.7 / 0.767, "target": 1.0, "memory": 0.3}),
        (1, {"gain": -0.38 / 0.767, "memory": 0.7}),
        (2, {"gain": -0.3, "target": 2.0}),
        (2, {"gain": -0.2}),
    ],
)
def test_the_decay_seen_is_that_predicted(orbits, periods, options):
    feedback = IntervalFeedback(limit=0.1, **options)
    predicted = orbit_stability(orbits[periods], feedback).growth
    assert predicted < 1
    seen = decay(orbits[periods], feedback)
    assert math.log(seen) == pytest.approx(math.log(predicted), rel=0.05)


@pytest.mark.parametrize("parameter", ["amplitude", "load"])
@pytest.mark.parametrize("periods", [1, 2])
def test_at_the_fastest_gain_the_multiplier_is_that_predicted(orbits, periods, parameter):
    """Three are equally great there, two of them one: a single exponential reads a tenth high."""
    feedback = IntervalFeedback.fastest(orbits[periods], limit=0.1, parameter=parameter)
    predicted = orbit_stability(orbits[periods], feedback)
    assert np.sum(np.abs(predicted.multipliers) > 0.99 * predicted.growth) == 3
    seen = greatest_multiplier(orbits[periods], feedback)
    assert seen == pytest.approx(predicted.growth, rel=0.02)
    assert decay(orbits[periods], feedback, floor=1e-12) > 1.08 * predicted.growth


@pytest.mark.parametrize(("stop", "periods"), [("linear", 1), ("linear", 2), ("hertz", 2)])
def test_so_it_is_at_soft_stops(stop, periods):
    orbit = soft_orbit(stop, periods)
    feedback = IntervalFeedback.fastest(orbit, limit=0.1)
    predicted = orbit_stability(orbit, feedback).growth
    assert greatest_multiplier(orbit, feedback) == pytest.approx(predicted, rel=0.02)


def test_a_gain_too_small_does_not_hold_the_orbit(orbits):
    feedback = IntervalFeedback(-0.2, limit=0.03, target=1.0)
    assert not orbit_stability(orbits[1], feedback).stable
    motion = simulate(Controlled(BEAM, feedback), periods=300, initial=tuple(orbits[1].state))
    x, _ = motion.stroboscopic()
    assert abs(x[-40:] - orbits[1].state[0]).max() > 1e-3


def test_it_goes_from_orbit_to_orbit(orbits):
    near, far = (IntervalFeedback.fastest(orbits[n], limit=0.03) for n in (1, 2))
    motion = simulate(Controlled(BEAM, [(0, near), (400, far)]), periods=900)
    ends = motion.impacts.time[1:] / BEAM.forcing_period
    intervals = motion.impacts.intervals() / BEAM.forcing_period
    assert intervals[(ends > 380) & (ends < 400)] == pytest.approx(1, abs=1e-9)
    assert intervals[(ends > 870) & (ends < 900)] == pytest.approx(2, abs=1e-9)


def test_the_motion_and_force_are_those_of_the_moved_parameter(orbits):
    """Between two impacts the path is that of the oscillator with the parameter it had there."""
    feedback = IntervalFeedback(-0.5, limit=0.5, target=1.0)
    motion = simulate(Controlled(BEAM, feedback), periods=40, initial=(0.3, 0.1))
    impacts = motion.impacts.time
    for a, b in pairwise(impacts[3:9]):
        k = int(np.searchsorted(impacts, a))
        last = (a - impacts[k - 1]) / BEAM.forcing_period
        by = -0.5 * (last - 1.0)
        by = by if abs(by) <= 0.5 else 0.0
        time = np.linspace(a, b, 12)[1:-1]
        phase = 2 * math.pi * time / BEAM.forcing_period
        assert motion.force(time) == pytest.approx(by * np.cos(phase), abs=1e-9)
        start = a + 1e-9
        x, v = motion.sample(start)
        own = scenes.karpodinis(20.3355, amplitude=0.25 + by)
        alone = simulate(
            own, duration=b - a, initial=(float(x), float(v)),
            phase=2 * math.pi * (start / BEAM.forcing_period % 1),
        )  # fmt: skip
        assert motion.sample(time)[0] == pytest.approx(alone.sample(time - start)[0], abs=1e-9)


@pytest.mark.parametrize("stop", SOFT)
@pytest.mark.parametrize("periods", [1, 2])
def test_soft_impacts_have_the_multipliers_of_the_orbit(stop, periods):
    orbit = soft_orbit(stop, periods)
    (linear,), _ = impact_maps_of(orbit, "amplitude")
    found = np.sort(np.linalg.eigvals(linear.matrix))
    assert found == pytest.approx(np.sort(orbit.multipliers), rel=1e-7)


@pytest.mark.parametrize(
    ("stop", "periods", "share"),
    [("linear", 1, 0.88), ("linear", 2, 0.9), ("hertz", 1, 0.7), ("hertz", 2, 0.95)],
)
def test_the_decay_at_soft_stops_is_that_predicted(stop, periods, share):
    """A little off the fastest gain, where one multiplier leads."""
    orbit = soft_orbit(stop, periods)
    feedback = IntervalFeedback.fastest(orbit, limit=0.1)
    feedback = replace(feedback, gain=share * feedback.gain)
    predicted = orbit_stability(orbit, feedback).growth
    assert 0.3 < predicted < 0.99
    assert math.log(decay(orbit, feedback, floor=1e-10)) == pytest.approx(
        math.log(predicted), rel=0.05
    )


@pytest.mark.parametrize(("stop", "periods", "limit"), [("linear", 1, 0.1), ("hertz", 2, 0.05)])
def test_it_locks_soft_impacts_from_chaos(stop, periods, limit):
    orbit = soft_orbit(stop, periods)
    feedback = IntervalFeedback.fastest(orbit, limit=limit)
    motion = simulate(Controlled(SOFT[stop], feedback, start=50), periods=1000)
    assert str(orbit_period(motion, tolerance=1e-7)) == f"period(1, {periods})"
    assert motion.effort()[1][-20:].max() < 1e-8


def test_the_map_of_crossings_has_the_multipliers_of_the_orbit(turns):
    for many, orbit in turns.items():
        maps, intervals = crossing_maps_of(orbit, 2, **SEEN)
        assert len(maps) == many
        assert intervals.sum() == pytest.approx(orbit.period, rel=1e-10)
        lap = np.linalg.multi_dot([np.eye(2), *[one.matrix for one in reversed(maps)]])
        found = np.linalg.eigvals(lap)
        assert found[np.argmax(abs(found))] == pytest.approx(orbit.multipliers[0].real, rel=1e-6)


@pytest.mark.parametrize(("many", "delay"), [(1, None), (2, 2)])
def test_the_decay_of_a_flow_is_that_predicted(turns, many, delay):
    best = IntervalFeedback.fastest(turns[many], limit=0.3, parameter=2, delay=delay, **SEEN)
    feedback = replace(best, gain=0.9 * best.gain)
    predicted = orbit_stability(turns[many], feedback).growth
    assert orbit_stability(turns[many], best).growth < predicted < 1
    seen = decay_of_flow(turns[many], feedback, many)
    assert math.log(seen) == pytest.approx(math.log(predicted), rel=0.05)


def test_it_goes_between_orbits_of_a_flow(turns):
    one = IntervalFeedback.fastest(turns[1], limit=0.3, parameter=2, **SEEN)
    two = IntervalFeedback.fastest(turns[2], limit=0.8, parameter=2, delay=2, **SEEN)
    course = simulate(Controlled(ROSSLER, [(50, one), (600, two)]), duration=3000)
    ends, intervals = course.spikes.time[1:], course.spikes.intervals()
    near = (ends > 560) & (ends < 600)
    assert intervals[near] == pytest.approx(turns[1].period, abs=1e-7)
    last = intervals[-6:]
    assert last[:4] == pytest.approx(last[2:], abs=1e-6)
    assert abs(last[1] - last[0]) > 0.5
    assert abs(course.force(np.linspace(2950, 3000, 50))).max() < 1e-5


def test_a_target_holds_lorenz_orbit_of_a_positive_multiplier():
    orbit = find_periodic_orbit(flows.lorenz(), period=1.5586)
    assert orbit.multipliers[0].real > 4
    feedback = IntervalFeedback.fastest(orbit, limit=0.5, parameter=1, signal="z", level=27.0)
    assert orbit_stability(orbit, feedback).growth < 0.3
    course = simulate(Controlled(orbit.system, feedback), duration=300)
    assert course.spikes.intervals()[-5:] == pytest.approx(orbit.period / 2, abs=1e-7)


def test_a_controlled_flow_is_that_of_the_moved_parameter(turns):
    feedback = IntervalFeedback(1.0, 0.4, target=5.9, parameter=2, memory=0.2, **SEEN)
    course = simulate(Controlled(ROSSLER, feedback), duration=60)
    crossings = course.spikes.time
    before, seen = 0.0, 0
    for k in range(2, len(crossings)):
        by = 0.2 * before + (crossings[k - 1] - crossings[k - 2] - 5.9)
        before = by if abs(by) <= 0.4 else 0.0
        seen += before != 0.0
        time = np.linspace(crossings[k - 1], crossings[k], 7)[1:-1]
        assert course.force(time) == pytest.approx(before, abs=1e-12)
        own = flows.rossler(c=5.7 + before)
        start = tuple(course.sample(crossings[k - 1]))
        alone = simulate(own, duration=crossings[k] - crossings[k - 1], initial=start)
        apart = alone.sample(time - crossings[k - 1]) - course.sample(time)
        assert abs(apart).max() < 1e-9
    assert seen > 2
    assert course.sample(crossings)[:, 0] == pytest.approx(0, abs=1e-9)
    assert course.sample(60.0) == pytest.approx(course.final, abs=1e-9)


@pytest.mark.parametrize("strength", [0.28, 0.34, 0.4])
def test_impacts_are_made_as_strong_as_asked_for(orbits, strength):
    """From chaos, by nothing but their instants."""
    feedback = IntervalFeedback.fastest(orbits[1], limit=0.05, strength=strength)
    motion = simulate(Controlled(BEAM, feedback, start=50), periods=1200)
    assert motion.impacts.approach_velocity[-20:] == pytest.approx(strength, rel=1e-8)
    moved = feedback.nudged(BEAM, feedback.offset)
    orbit = find_periodic_orbit(moved, 1, impacts=1, guess=tuple(motion.final[:2]))
    assert orbit_stability(orbit, feedback).stable
    assert not orbit.stable


def test_orbits_of_what_is_regulated_are_those_that_are_held(orbits):
    feedback = IntervalFeedback.fastest(orbits[1], limit=0.05, strength=0.34)
    own = Controlled(BEAM, feedback)
    found = find_periodic_orbit(own, 1, impacts=1)
    assert found.found
    assert found.stable
    assert found.motion(1.5).impacts.approach_velocity[0] == pytest.approx(0.34, rel=1e-8)
    alone = feedback.nudged(BEAM, feedback.offset)
    unstable = find_periodic_orbit(alone, 1, impacts=1)
    predicted = orbit_stability(unstable, feedback).growth
    assert abs(found.multipliers).max() == pytest.approx(predicted, rel=1e-2)


def test_an_orbit_that_chaos_does_not_visit_is_come_to_by_way_of_others():
    """At this soft stop the motion is periodic and does not come near (1, 2)."""
    soft = SOFT["linear"]
    orbit = find_periodic_orbit(soft, 2, impacts=1)
    direct = IntervalFeedback.fastest(orbit, limit=0.1)
    missed = simulate(Controlled(soft, direct, start=50), periods=1500)
    assert str(orbit_period(missed)) == "period(6, 8)"
    strength = 1.1 * orbit.motion(1.5).impacts.approach_velocity[0]
    by_way = IntervalFeedback.fastest(orbit, limit=0.1, strength=strength)
    motion = simulate(Controlled(soft, [(50, by_way), (1300, direct)]), periods=1500)
    assert str(orbit_period(motion, tolerance=1e-7)) == "period(1, 2)"
    assert motion.effort()[1][-20:].max() < 1e-8


def test_bad_input_is_named(orbits, turns):
    cases = [
        (lambda: IntervalFeedback("a", 1.0), "gain"),
        (lambda: IntervalFeedback(1.0, 0.0), "limit"),
        (lambda: IntervalFeedback(1.0, 1.0, target=-1.0), "target"),
        (lambda: IntervalFeedback(1.0, 1.0, delay=0), "delay"),
        (lambda: IntervalFeedback(1.0, 1.0, parameter="frequency"), "parameter"),
        (lambda: IntervalFeedback(1.0, 1.0, parameter=-1), "parameter"),
        (lambda: Controlled(ROSSLER, IntervalFeedback(1.0, 1.0)), "parameter"),
        (lambda: Controlled(ROSSLER, IntervalFeedback(1.0, 1.0, parameter=3)), "parameter"),
        (lambda: Controlled(ROSSLER, IntervalFeedback(1.0, 1.0, parameter=1)), "level"),
        (
            lambda: Controlled(ROSSLER, IntervalFeedback(1, 1, parameter=1, level=0, signal="w")),
            "signal",
        ),
        (lambda: Controlled(BEAM, IntervalFeedback(1.0, 1.0, parameter=1)), "parameter"),
        (
            lambda: IntervalFeedback.fastest(turns[1], 0.1, parameter=2, level=30.0, signal="x"),
            "level",
        ),
        (lambda: IntervalFeedback.fastest(turns[2], 0.1, parameter=2, **SEEN), "target"),
        (lambda: IntervalFeedback.fastest(turns[2], 0.1, parameter=2, delay=1, **SEEN), "delay"),
        (
            lambda: IntervalFeedback.fastest(turns[1], 0.1, parameter=2, strength=1.0, **SEEN),
            "strength",
        ),
        (lambda: IntervalFeedback.fastest(orbits[1], 0.1, strength=1e-5), "strength"),
        (lambda: Controlled(BEAM, IntervalFeedback(1.0, 1.0, level=0.5)), "level"),
        (
            lambda: find_periodic_orbit(
                Controlled(ROSSLER, IntervalFeedback(1.0, 1.0, parameter=2, **SEEN)), period=5.88
            ),
            "system",
        ),
        (lambda: OGY(turns[1], 0.1), "orbit"),
        (lambda: Controlled(scenes.okolewski(4, 0.8), IntervalFeedback(1.0, 1.0)), "parameter"),
        (lambda: orbit_stability(orbits[1], IntervalFeedback(1.0, 1.0, target=2.0)), "target"),
        (lambda: IntervalFeedback.fastest(BEAM, 1.0), "orbit"),
    ]
    for call, argument in cases:
        with pytest.raises(InvalidInput) as caught:
            call()
        assert caught.value.argument == argument
