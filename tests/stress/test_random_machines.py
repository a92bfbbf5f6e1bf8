"""Random machines over the whole range of parameters, and the invariants of every motion."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import impactsig
from impactsig import BaseMotion, Force, Friction, KelvinVoigt, Oscillator, Rigid, Stop
from impactsig.simulation import run as _run
from tests.stress.balance import check

RESTITUTIONS = (0.0, 1e-6, 0.2, 0.6, 0.9, 1 - 1e-12, 1.0)
PERIODS = 12


def random_soft(rng, ends):
    damping = rng.choice([0, 10 ** rng.uniform(-3, 5)])
    return KelvinVoigt(10 ** rng.uniform(0, 12), damping, ends)


def random_stops(rng, ends):
    """One to four stops, and the room between the first of either side."""
    upper = rng.choice([0.0, 1.0, -1.0]) * 10 ** rng.uniform(-6, 1)
    room = 10 ** rng.uniform(-3, 1)
    stops = []
    for side, sign, at in (("upper", 1, upper), ("lower", -1, upper - room)):
        if side == "lower" and rng.random() < 0.5:
            continue
        if rng.random() < 0.15:  # a soft one before the other
            stops.append(Stop(at, random_soft(rng, ends), side))
            at += sign * 10 ** rng.uniform(-4, 0)
        law = random_soft(rng, ends) if rng.random() < 0.3 else Rigid(rng.choice(RESTITUTIONS))
        stops.append(Stop(at, law, side))
    return stops, upper, room


def random_machine(rng, rubs, ends):
    """An oscillator, and a start between its stops."""
    omega = 10 ** rng.uniform(-3, 3)
    # An acceleration a displaces a / omega^2 in a period: keep the numbers of one size.
    size = 10 ** rng.uniform(-2, 2) * max(1.0, omega**2)
    forces = [Force(size, omega, rng.uniform(0, 7))]
    if rng.random() < 0.3:
        forces.append(Force(size * rng.uniform(0, 1), omega * rng.uniform(0.3, 3)))
    base = None
    if rng.random() < 0.3:
        base = BaseMotion(
            10 ** rng.uniform(-2, 0), omega, rng.uniform(0, 7), stops=rng.random() < 0.5
        )
    friction = None
    if rubs:  # from next to none to more than the forcing can move
        kinetic = size * 10 ** rng.uniform(-3, 0.5)
        friction = Friction(kinetic, kinetic * rng.choice([1.0, 1.3]))
    stops, upper, room = random_stops(rng, ends)
    machine = Oscillator(
        mass=rng.choice([1.0, 10 ** rng.uniform(-2, 2)]),
        damping=rng.choice([0.0, 10 ** rng.uniform(-4, 2)]),
        stiffness=rng.choice([0.0, 1.0, 10 ** rng.uniform(-3, 3)]),
        forces=tuple(forces),
        load=rng.choice([0.0, size * rng.normal()]),
        base=base,
        stops=tuple(stops),
        friction=friction,
    )
    start = upper - rng.choice([0.0, rng.uniform(0, 1)]) * room
    phase = rng.uniform(0, 2 * np.pi)
    if base is not None and base.stops:
        start += base.amplitude * np.cos(phase + base.phase)
    return machine, (start, rng.normal() * omega), phase


def run(seed, tally, rubs, ends):
    rng = np.random.default_rng(seed)
    try:
        machine, initial, phase = random_machine(rng, rubs, ends)
    except impactsig.InvalidInput:  # undamped resonance, so seldom that the tests count it
        tally["refused"] += 1
        return
    motion = impactsig.simulate(machine, periods=PERIODS, initial=initial, phase=phase)
    length = PERIODS * machine.forcing_period
    if motion.status == "complete":
        assert motion.duration == pytest.approx(length, rel=1e-14)
    else:  # it gave up, and says so, after no more work than it may do
        assert motion.status == "work limit"
        assert motion.duration < length
    assert motion.impact_count <= _run.LEGS_AT_LEAST + _run.LEGS_PER_PERIOD * (PERIODS + 1)
    first = int(rng.integers(len(motion._segments))) if rng.random() < 0.5 else 0
    tally.update(check(machine, motion, phase, first))
    tally[motion.status] += 1
    tally["impacts"] += motion.impact_count
    tally["sticks"] += motion.stick_count


KINDS = [
    pytest.param(False, "gap", id="smooth"),
    pytest.param(True, "gap", id="rubbing"),
    pytest.param(False, "force", id="only pushed"),
]


@pytest.mark.parametrize(("rubs", "ends"), KINDS)
def test_no_random_machine_breaks_an_invariant(rubs, ends):
    tally = Counter()
    for seed in range(50):
        run(seed, tally, rubs, ends)
    assert tally["complete"] > 40
    assert tally["impacts"] > 600
    assert tally["sticks"] > 6
    assert tally["spans"] > 300


@pytest.mark.slow
@pytest.mark.usefixtures("little_work")
@pytest.mark.parametrize(("rubs", "ends"), KINDS)
def test_no_random_machine_of_a_hundred_thousand_breaks_an_invariant(rubs, ends):
    tally = Counter()
    for seed in range(100_000, 134_000):
        run(seed, tally, rubs, ends)
    assert tally["complete"] > 29_000
    assert tally["spans"] > 900_000
    assert tally["rests"] > 15_000
    assert tally["rebounds"] > 1_000_000
    assert tally["refused"] < 100
