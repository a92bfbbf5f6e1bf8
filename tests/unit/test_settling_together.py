"""Many runs past their transients side by side: each has the bits of the one followed alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Friction,
    Hertz,
    InvalidInput,
    KelvinVoigt,
    Oscillator,
    Rigid,
    Stop,
    bifurcation_diagram,
    lyapunov_spectrum,
    response_spectrum,
    scenes,
    tangent_map,
)
from impactsig.dynamics.diagrams._exponents import exponents_of
from impactsig.dynamics.diagrams.settling.settling import settle
from impactsig.dynamics.diagrams.settling.together import Settling, in_blocks
from impactsig.oscillators import Force

VALUES = np.linspace(19.5, 24.0, 24)
RNG = np.random.default_rng(21)


def mixed(value):
    """Oscillators of several layouts, one that is stepped, and one whose forcing does not recur."""
    beam = scenes.karpodinis(value)
    stops = {
        0: beam.stops,
        1: (*beam.stops, Stop(-1.2, beam.stops[0].law, side="lower")),
        2: (Stop(1.0, Hertz(50.0, damping=0.05)),),
        3: scenes.okolewski(1.1, 0.6, "soft").stops,
    }[int(value * 1e3) % 4]
    forces = beam.forces
    if value > 23.5:
        other = Force(0.05, 2**0.5 * forces[0].angular_frequency)
        forces = (*forces, other)
    return replace(beam, stops=stops, forces=forces)


def check_going_on(settling, alone, periods):
    """The next periods of each are those of the one that is followed alone."""
    courses, others = settling.on(periods)
    singles = [one.motion(n) for one, n in zip(alone, periods, strict=True)]
    seen = set(others)
    for k, motion in others.items():
        assert motion.final == singles[k].final
    for which, course in courses:
        seen |= set(which)
        strobes, resting = course.strobes(), course.sticking()
        gained = course.kinetic_energy_gained()
        times = [np.sort(RNG.uniform(singles[k].start, singles[k].stop, 9)) for k in which]
        for j, (k, places) in enumerate(zip(which, course.sample(times), strict=True)):
            single, totals = singles[k], {name: v[j] for name, v in course.totals.items()}
            assert single.final == (totals["displacement"], totals["velocity"], totals["phase"])
            assert single.energy_lost == totals["energy_lost"]
            assert (single.start, single.duration) == (totals["start"], totals["duration"])
            time, approach, stop = course.hits(j)
            assert time.tobytes() == single.impacts.time.tobytes()
            assert approach.tobytes() == single.impacts.approach_velocity.tobytes()
            assert stop.tolist() == single.impacts.stop_index.tolist()
            phase = single.final[2]
            assert strobes[j].T.tolist() == [x.tolist() for x in single.stroboscopic(phase)]
            assert gained[j] == single.kinetic_energy_gained()
            assert resting[j] == np.diff(single.sticks).sum() / single.duration
            assert [x.tolist() for x in places] == [x.tolist() for x in single.sample(times[j])]
    assert seen == set(range(len(alone)))


@pytest.mark.parametrize("ends", [True, False])
def test_each_is_followed_as_alone(ends):
    machines = [mixed(value) for value in VALUES]
    assert {one.forcing_recurs for one in machines} == {True, False}
    rule = {"tolerance": 1e-9, "ends": ends, "initial": (0.2, 0.3), "phase": 0.4}
    settling = Settling(machines, 60, **rule)
    alone = [settle(one, 60, **rule) for one in machines]
    for _ in range(2):
        for own, one in zip(settling.settled, alone, strict=True):
            assert (own.closed, own.status) == (one.closed, one.status)
            assert own.strobes.tobytes() == one.strobes.tobytes()
            for mine, other in zip(own.where, one.where, strict=True):
                assert mine.tolist() == other.tolist()
        periods = [one.closed or 7 for one in alone]
        check_going_on(settling, alone, periods)
        settling.close()  # and once more with the orbits found beside
        alone = [settle(one, 60, **rule).closing() for one in machines]
    assert sum(one.closed > 0 for one in alone) > 10


OTHERS = {
    "moving stops": [
        Oscillator(
            damping=0.1, base=BaseMotion(a, 0.9, stops=True),
            stops=(Stop(0.3, Rigid(0.8)), Stop(-0.4, KelvinVoigt(20.0, 0.2), "lower")),
        )
        for a in (0.5, 0.9, 1.3)
    ],
    "friction": [
        Oscillator(
            damping=0.02, forces=(Force(a, 0.7),), friction=Friction(0.2, 0.3),
            stops=(Stop(0.5, KelvinVoigt(30.0, 0.1)),),
        )
        for a in (0.1, 0.5, 1.0)
    ],
    "chatter and rest": [
        Oscillator(
            damping=0.1, load=1.0, stops=(Stop(0.0, Rigid(0.6)),), forces=(Force(a, 0.2),)
        )
        for a in (0.5, 1.1, 1.5)
    ],
}  # fmt: skip


@pytest.mark.parametrize("kind", list(OTHERS))
def test_what_each_does_next_is_what_it_does_alone(kind):
    rule = {"tolerance": 1e-9, "ends": False, "initial": (-0.1, 0.3), "phase": 7.0}
    alone = [settle(one, 9, **rule) for one in OTHERS[kind]]
    check_going_on(Settling(OTHERS[kind], 9, **rule), alone, [3, 1, 6])


def test_exponents_are_those_of_each_alone():
    machines = [mixed(value) for value in VALUES]
    closed = [k % 3 for k in range(len(machines))]
    at = [(0.1 + 0.01 * k, 0.2, 0.3 * k) for k in range(len(machines))]
    found = exponents_of(machines, closed, 12, at)
    for machine, n, (x, v, phase), own in zip(machines, closed, at, found, strict=True):
        start = {"initial": (x, v), "phase": phase}
        if n:
            growth = np.log(np.abs(tangent_map(machine, periods=n, **start).multipliers))
            wanted = growth * machine.angular_forcing_frequency / (2 * np.pi * n)
        else:
            wanted = lyapunov_spectrum(machine, periods=12, **start).exponents
        assert own.tolist() == wanted.tolist()
    assert exponents_of([], [], 12, []) == []


def test_diagrams_do_not_depend_on_what_is_followed_together():
    options = {"periods": 20, "transient": 60}
    whole = bifurcation_diagram(mixed, VALUES, workers=1, **options)
    threads = bifurcation_diagram(mixed, VALUES, workers=3, **options)
    swings = response_spectrum(mixed, VALUES, workers=1, **options)
    for k in (0, 7, 13, 23):
        one = bifurcation_diagram(mixed, VALUES[k : k + 1], workers=1, **options)
        for found in (whole, threads):
            assert found.strobe[k].tobytes() == one.strobe[0].tobytes()
            assert found.velocity[k].tobytes() == one.velocity[0].tobytes()
            assert found.energy_per_period[k] == one.energy_per_period[0]
        response = response_spectrum(mixed, VALUES[k : k + 1], workers=1, **options)
        assert swings.greatest[k] == response.greatest[0]


def test_blocks_keep_the_order_and_leave_other_systems_alone():
    systems = [scenes.karpodinis(22.0), "other", scenes.karpodinis(23.0), scenes.karpodinis(24.0)]
    seen = []

    def task(which):
        seen.append(which)
        return [10 * k for k in which]

    assert in_blocks(task, systems, 400, 1) == [0, 10, 20, 30]
    assert seen == [[0, 2, 3], [1]]
    assert in_blocks(task, systems, 10**9, 2) == [0, 10, 20, 30]


def test_one_without_forcing_is_refused():
    with pytest.raises(InvalidInput):
        bifurcation_diagram(lambda k: Oscillator(1.0, 0.1, k), [1.0, 2.0])
