"""Random machines of every kind of part, event by event against a slow twin."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactsig
from impactsig import BaseMotion, Force, Friction, KelvinVoigt, Oscillator, Rigid, Stop
from impactsig.simulation.basis import events as _events
from tests.naive_contacts import Machine

KINDS = {
    getattr(_events, name): name
    for name in ("IMPACT", "STICK", "RELEASE", "TOUCH", "PART", "REVERSE", "MARK")
}
SPAN = 6.0


def firm(velocity):
    return 0.9 / (1 + 0.3 * velocity)


def random_machine(rng):
    """An oscillator with events to spare, a start in the frame of its stops, and a phase."""

    def soft():
        stiffness = 10 ** rng.uniform(0.5, 4)
        ratio = rng.choice([0.0, rng.uniform(0, 1.6)])
        return KelvinVoigt(
            stiffness, 2 * ratio * math.sqrt(stiffness), ends=("gap", "force")[rng.integers(2)]
        )

    stops = []
    for side, sign in (("upper", 1), ("lower", -1)):
        at = rng.uniform(0.05, 0.6)
        for _ in range(rng.integers(0, 3) + (sign > 0)):
            stops.append(Stop(sign * at, soft(), side))
            at += rng.uniform(0.005, 0.2)
        if rng.random() < 0.6:
            law = Rigid(firm if rng.random() < 0.2 else rng.choice([0.0, 0.3, 0.7, 0.9, 1.0]))
            stops.append(Stop(sign * at, law, side))
    size, omega = 10 ** rng.uniform(-0.5, 1), rng.uniform(0.5, 3)
    forces = [Force(size, omega, rng.uniform(0, 7))]
    if rng.random() < 0.5:
        forces.append(Force(size * rng.uniform(0.1, 0.8), rng.uniform(0.5, 4), rng.uniform(0, 7)))
    base = None
    if rng.random() < 0.5:
        hangs = (bool(part) for part in rng.random(3) < 0.5)
        base = BaseMotion(rng.uniform(0.05, 0.5), rng.uniform(0.5, 3), rng.uniform(0, 7), *hangs)
    friction = None
    if rng.random() < 0.6:
        kinetic = size * rng.uniform(0.02, 0.4)
        friction = Friction(kinetic, kinetic * rng.choice([1.0, rng.uniform(1, 2)]))
    machine = Oscillator(
        mass=rng.uniform(0.5, 2),
        damping=rng.choice([0.0, rng.uniform(0, 1), rng.uniform(0, 6)]),
        stiffness=rng.choice([0.0, rng.uniform(0.3, 3)]),
        forces=tuple(forces),
        load=size * rng.choice([0.0, 0.4 * rng.normal()]),
        base=base,
        stops=tuple(stops),
        friction=friction,
    )
    phase, x = rng.uniform(0, 6.2), 0.0
    if base is not None and base.stops:
        x = base.amplitude * math.cos(base.angular_frequency / omega * phase + base.phase)
    return machine, (x, rng.normal()), phase


def without_chatter(events):
    """Events but for slow rebounds, which the engine sums and the twin cuts off."""
    fastest, slow, kept = max([e[3] for e in events], default=0.0), False, []
    for event in events:
        if event[0] == "IMPACT":
            slow = event[3] < 1e-3 * fastest
        if not (slow and event[0] in ("IMPACT", "REVERSE")):
            kept.append(event)
    return kept


def both(seed):
    """The events that the engine and the twin find, and both ends."""
    machine, initial, phase = random_machine(np.random.default_rng(seed))
    motion = impactsig.simulate(machine, duration=SPAN, initial=initial, phase=phase)
    assert motion.status == "complete"
    rows, omega = motion._segments[1:], motion._engine.omega
    time = (rows[:, 0] * 2 * math.pi + rows[:, 1] - phase) / omega
    found = [
        (KINDS[int(row[2])], int(row[3]), t, row[7] * omega)
        for row, t in zip(rows, time, strict=True)
    ]
    twin, end = Machine(machine, phase).follow(initial, SPAN)
    slow = [(e.kind, e.stop, e.time, e.approach) for e in twin]
    return without_chatter(found), without_chatter(slow), motion.final[:2], end[:2]


def compare(seeds):
    """Check them one by one; the kinds of events that were there."""
    kinds = []
    for seed in seeds:
        found, slow, here, there = both(seed)
        assert [e[:2] for e in found] == [e[:2] for e in slow], seed
        for mine, other in zip(found, slow, strict=True):
            # The sum of a chatter ends a little after what the twin cuts off.
            slack = 1e-4 if mine[0] == "STICK" else 1e-7
            assert mine[2] == pytest.approx(other[2], abs=slack), (seed, mine, other)
            assert mine[3] == pytest.approx(other[3], abs=1e-6), (seed, mine, other)
        np.testing.assert_allclose(here, there, atol=1e-6, err_msg=str(seed))
        kinds += [e[0] for e in found]
    return kinds


def test_every_event_of_random_machines_is_where_the_twin_has_it():
    kinds = compare(range(12))
    assert set(kinds) == set(KINDS.values())
    assert len(kinds) > 120


@pytest.mark.slow
def test_every_event_of_many_random_machines_is_where_the_twin_has_it():
    assert len(compare(range(12, 400))) > 4000


def test_the_twin_itself_bounces_a_ball():
    """Thrown up under g: hops of 2 v / g, each r times the one before."""
    ball = Oscillator(stiffness=0, load=-2.0, stops=(Stop(0, Rigid(0.5), "lower"),))
    events, _ = Machine(ball).follow((0, 1.0), 1.9)
    assert [e.time for e in events][:3] == pytest.approx([1.0, 1.5, 1.75], abs=1e-12)
    assert [e.approach for e in events][:3] == pytest.approx([1.0, 0.5, 0.25], abs=1e-12)
