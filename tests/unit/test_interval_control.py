"""Control that sees nothing but the intervals between impacts."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from impactsig import (
    Controlled,
    IntervalFeedback,
    InvalidInput,
    find_periodic_orbit,
    flows,
    orbit_period,
    orbit_stability,
    scenes,
    simulate,
)
from impactsig.control.stability.impact_map import impact_map_of

BEAM = scenes.karpodinis(20.3355)


@pytest.fixture(scope="module")
def orbits():
    return {n: find_periodic_orbit(BEAM, n, impacts=1) for n in (1, 2)}


def decay(orbit, feedback, laps=60):
    """Factor by which a motion beside the orbit comes nearer in a period of it."""
    beside = (orbit.state[0] + 1e-5, orbit.state[1])
    motion = simulate(Controlled(BEAM, feedback), periods=laps * orbit.periods, initial=beside)
    off = np.hypot(*(np.stack(motion.stroboscopic(), axis=1) - orbit.state).T)[:: orbit.periods]
    laps = np.arange(len(off))
    clear = (laps > 4) & np.cumprod(off > 1e-11).astype(bool)
    return math.exp(np.polyfit(laps[clear], np.log(off[clear]), 1)[0])


@pytest.mark.parametrize("parameter", ["amplitude", "load"])
@pytest.mark.parametrize("periods", [1, 2])
def test_the_impact_map_has_the_multipliers_of_the_orbit(orbits, periods, parameter):
    linear = impact_map_of(orbits[periods], parameter)
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


def test_bad_input_is_named(orbits):
    cases = [
        (lambda: IntervalFeedback("a", 1.0), "gain"),
        (lambda: IntervalFeedback(1.0, 0.0), "limit"),
        (lambda: IntervalFeedback(1.0, 1.0, target=-1.0), "target"),
        (lambda: IntervalFeedback(1.0, 1.0, delay=0), "delay"),
        (lambda: IntervalFeedback(1.0, 1.0, parameter="frequency"), "parameter"),
        (lambda: Controlled(flows.rossler(), IntervalFeedback(1.0, 1.0)), "controller"),
        (lambda: Controlled(scenes.okolewski(4, 0.8), IntervalFeedback(1.0, 1.0)), "parameter"),
        (lambda: orbit_stability(orbits[1], IntervalFeedback(1.0, 1.0, target=2.0)), "feedback"),
        (lambda: IntervalFeedback.fastest(BEAM, 1.0), "orbit"),
    ]
    for call, argument in cases:
        with pytest.raises(InvalidInput) as caught:
            call()
        assert caught.value.argument == argument
