"""Random machines with stops one behind the other, laws that are functions, bases that carry."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import impactsig
from impactsig import BaseMotion, Force, Friction, KelvinVoigt, Oscillator, Rigid, Stop
from tests.stress.balance import check

pytestmark = pytest.mark.usefixtures("little_work")


def firm(velocity):
    return 0.9 / (1 + 0.3 * velocity)


def random_machine(rng):
    """An oscillator and a start between its stops."""

    def soft():
        stiffness = 10 ** rng.uniform(0, 9)
        ratio = rng.choice([0.0, 10 ** rng.uniform(-3, 0.3)])
        return KelvinVoigt(
            stiffness, 2 * ratio * np.sqrt(stiffness), ends=("gap", "force")[rng.integers(2)]
        )

    stops = []
    for side, sign in (("upper", 1), ("lower", -1)):
        at = 10 ** rng.uniform(-4, 0.5)
        for _ in range(rng.integers(0, 4)):
            stops.append(Stop(sign * at, soft(), side))
            at += 10 ** rng.uniform(-5, 0)
        if rng.random() < 0.5:
            law = Rigid(
                firm if rng.random() < 0.2 else rng.choice([0, 1e-6, 0.3, 0.8, 1 - 1e-9, 1])
            )
            stops.append(Stop(sign * at, law, side))
    omega = 10 ** rng.uniform(-2, 2)
    size = 10 ** rng.uniform(-1.5, 1.5) * max(1.0, omega**2)
    forces = [Force(size, omega, rng.uniform(0, 7))]
    if rng.random() < 0.4:
        forces.append(Force(size * rng.uniform(0, 1), omega * rng.uniform(0.3, 3)))
    base = None
    if rng.random() < 0.4:
        hangs = rng.random(3) < 0.5
        base = BaseMotion(
            10 ** rng.uniform(-2, 0), omega * rng.choice([1, 0.37]), rng.uniform(0, 7),
            *(bool(part) for part in hangs),
        )  # fmt: skip
    friction = None
    if rng.random() < 0.7:
        kinetic = size * rng.choice([0.0, 10 ** rng.uniform(-4, 0.3)])
        friction = Friction(kinetic, kinetic + size * rng.choice([0, rng.uniform(0, 0.5)]))
    machine = Oscillator(
        mass=rng.uniform(0.5, 2),
        damping=rng.choice([0.0, 10 ** rng.uniform(-3, 1.5)]),
        stiffness=rng.choice([0.0, 1.0, 10 ** rng.uniform(-2, 3)]),
        forces=tuple(forces),
        load=rng.choice([0.0, size * rng.normal()]),
        base=base,
        stops=tuple(stops),
        friction=friction,
    )
    start = base.amplitude * np.cos(base.phase) if base is not None and base.stops else 0.0
    return machine, (start, rng.choice([0.0, rng.normal() * omega]))


def run(seed, tally):
    rng = np.random.default_rng(seed)
    try:
        machine, initial = random_machine(rng)
    except impactsig.InvalidInput:  # undamped resonance
        tally["refused"] += 1
        return
    motion = impactsig.simulate(machine, periods=12, initial=initial)
    if motion.status == "work limit":
        # Honest work: no turning on the spot between two modes at a tie.
        turns, phase = np.diff(motion._segments[:, 0]), np.diff(motion._segments[:, 1])
        assert np.mean(2 * np.pi * turns + phase > 0) > 0.4
    tally.update(check(machine, motion, 0.0, most=200))
    tally[motion.status] += 1
    tally["impacts"] += motion.impact_count
    tally["sticks"] += motion.stick_count


def battery(seeds):
    """Counts of what the machines did, and of what was looked at."""
    tally = Counter()
    for seed in seeds:
        run(seed, tally)
    assert tally["complete"] + tally["work limit"] + tally["refused"] == len(seeds)
    return tally


def test_no_random_machine_breaks_an_invariant():
    tally = battery(range(40))
    assert tally["work limit"] < 6
    assert tally["spans"] > 3000
    assert tally["impacts"] > 6000
    assert tally["sticks"] > 500


@pytest.mark.slow
def test_no_random_machine_of_many_breaks_an_invariant():
    tally = battery(range(10_000, 20_000))
    assert tally["work limit"] < 800
    assert tally["spans"] > 1_000_000
    assert tally["rests"] > 40_000
    assert tally["rebounds"] > 500_000
    assert tally["impacts"] > 5_000_000
    assert tally["sticks"] > 500_000
