"""Random machines with stops one behind the other, contacts that only push, friction: invariants.

The energy balance is drawn up anew from samples: over the whole run the kinetic energy changes by
the work of all forces and by what the impacts take.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import impactsig
from impactsig import BaseMotion, Force, Friction, KelvinVoigt, Oscillator, Rigid, Stop
from impactsig.simulate import _run
from impactsig.simulate._events import IMPACT

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


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


def carrier(machine, time):
    """Displacement, velocity and acceleration of what the stops hang on."""
    base = machine.base
    if base is None or not base.stops:
        return np.zeros((3, *time.shape))
    wave = base.amplitude * np.exp(1j * (base.frequency * time + base.phase))
    return np.stack([(wave * (1j * base.frequency) ** n).real for n in range(3)])


def pull(machine, time, x, v):
    """Force on the mass, but for friction and rigid stops; and how large its parts are."""
    at, moving, _ = carrier(machine, time)
    parts = [np.full_like(time, machine.load)]
    parts += [f.amplitude * np.cos(f.frequency * time + f.phase) for f in machine.forces]
    base, spring, damper = machine.base, x, v
    if base is not None:
        wave = base.amplitude * np.exp(1j * (base.frequency * time + base.phase))
        spring = x - base.spring * wave.real
        damper = v - base.damper * (wave * 1j * base.frequency).real
    parts += [-machine.stiffness * spring, -machine.damping * damper]
    for stop in machine.stops:
        if isinstance(stop.law, Rigid):
            continue
        sign = 1 if stop.side == "upper" else -1
        depth = sign * (x - at - stop.position)
        push = stop.law.stiffness * depth + stop.law.damping * sign * (v - moving)
        if stop.law.ends == "force":
            push = np.maximum(push, 0)
        parts.append(np.where(depth > 0, -sign * push, 0.0))
    return sum(parts), sum(np.abs(part) for part in parts)


def check(machine, initial, motion):
    """What no motion may break."""
    impacts, sticks = motion.impacts, motion.sticks
    assert np.all(np.isfinite(motion.final))
    assert np.all(np.diff(impacts.time) >= 0)
    assert np.all(impacts.approach_velocity >= 0)
    assert np.all(impacts.contact_time >= 0) if impacts.contact_time is not None else True
    assert np.all(sticks[:, 1] >= sticks[:, 0])
    assert np.all(sticks[1:, 0] >= sticks[:-1, 1])
    friction = machine.friction
    if motion.status == "work limit":
        # Honest work: no turning on the spot between two modes at a tie.
        turns, phase = np.diff(motion._segments[:, 0]), np.diff(motion._segments[:, 1])
        passed = 2 * np.pi * turns + phase
        assert np.mean(passed > 0) > 0.4

    time = np.linspace(motion.start, motion.stop, 300)
    x, v = motion.sample(time)
    assert np.all(np.isfinite(x))
    assert np.all(np.isfinite(v))
    at, moving, pace = carrier(machine, time)
    span = np.abs(x).max() + np.abs(at).max()
    fast = np.abs(v).max() + np.abs(moving).max()
    held = np.zeros(len(time), bool)
    touched = np.zeros(len(time), bool)
    if len(sticks):
        which = np.maximum(np.searchsorted(sticks[:, 0], time, side="right") - 1, 0)
        inside = 1e-9 * motion.duration
        held = (time > sticks[which, 0] + inside) & (time < sticks[which, 1] - inside)
    for stop in machine.stops:
        if isinstance(stop.law, Rigid):
            sign = 1 if stop.side == "upper" else -1
            depth = sign * (x - at - stop.position)
            assert np.all(depth <= 1e-12 * (span + fast * motion.duration * 1e-3))
            touched |= depth > -1e-9 * span
    assert np.all(np.abs(v - moving)[held] <= 1e-11 * fast)
    net, scale = pull(machine, time, x, v)
    static = friction.static if friction else 0.0
    excess = np.abs(net - machine.mass * pace) - static
    assert np.all((excess <= 1e-9 * (scale + np.abs(pace)))[held & ~touched])
    return balance(machine, initial, motion)


def balance(machine, initial, motion):
    """Energy in the frame of the stops at the end = at the start + work - what impacts take."""
    rows = motion._segments
    edges = (rows[:, 0] * 2 * np.pi + rows[:, 1] - motion._phase) / motion._engine.omega
    edges = np.minimum(np.append(edges, motion.stop), motion.stop)
    start, length = edges[:-1], np.diff(edges)
    middle = start + length / 2
    at = carrier(machine, middle)[0]
    frequencies = [f.frequency for f in machine.forces]
    frequencies += [machine.base.frequency] if machine.base else []
    stiffness = np.full(len(length), machine.stiffness)
    damping = np.full(len(length), machine.damping)
    x = motion.sample(middle)[0]
    for stop in machine.stops:
        if isinstance(stop.law, KelvinVoigt):
            inside = (x - at - stop.position) * (1 if stop.side == "upper" else -1) > 0
            stiffness = stiffness + inside * stop.law.stiffness
            damping = damping + inside * stop.law.damping
    rate = np.sqrt(stiffness / machine.mass) + damping / machine.mass + max(frequencies)
    pieces = np.ceil(length * rate / 1.5).astype(int)
    if pieces.sum() > 8_000:
        return False  # long rests on a stiff stop would take too many nodes
    which = np.repeat(np.arange(len(length)), pieces)
    number = np.arange(len(which)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    width = (length / np.maximum(pieces, 1))[which]
    time = (start[which] + number * width)[:, None] + (NODES + 1) / 2 * width[:, None]
    time = np.clip(time, motion.start, motion.stop)
    x, v = motion.sample(time)
    at, moving, pace = carrier(machine, time)
    u = v - moving
    net, scale = pull(machine, time, x, v)
    net, scale = net - machine.mass * pace, scale + machine.mass * np.abs(pace)

    def integral(power):
        return float(((power @ WEIGHTS) * width / 2).sum())

    kinetic = machine.friction.kinetic if machine.friction else 0.0
    way = integral(np.abs(u))
    work, size = integral(net * u) - kinetic * way, integral(scale * np.abs(u)) + kinetic * way
    taken = 0.0
    for row in rows[rows[:, 2] == IMPACT]:
        law, approach = machine.stops[int(row[3])].law, row[7] * motion._engine.omega
        r = law.restitution(approach) if callable(law.restitution) else law.restitution
        taken += machine.mass / 2 * (1 - r * r) * approach**2
        size += machine.mass / 2 * approach**2
    now = np.array([0.0, motion.stop])
    before, after = np.array([initial[1], motion.final[1]]) - carrier(machine, now)[1]
    gain = machine.mass / 2 * (after**2 - before**2)
    size += machine.mass / 2 * (after**2 + before**2)
    place = np.abs(x).max(initial=0) + np.abs(u).max(initial=0) * motion.stop
    blur = 1e-15 * stiffness.max() * place * way
    # At rest on the base the two velocities differ by the rounding of the time.
    fast = max(np.abs(v).max(initial=0), np.abs(moving).max(initial=0))
    blur += 1e-16 * (10 + max(frequencies) * motion.stop) * fast * integral(scale)
    assert abs(gain - (work - taken)) <= 1e-9 * size + blur
    return True


def run(seed):
    rng = np.random.default_rng(seed)
    try:
        machine, initial = random_machine(rng)
    except impactsig.InvalidInput:  # undamped resonance
        return None
    motion = impactsig.simulate(machine, periods=12, initial=initial)
    closed = check(machine, initial, motion)
    return motion, closed


@pytest.fixture(autouse=True)
def little_work(monkeypatch):
    """Ends sooner what creeps on a stiff stop, or bounces a thousand times in a period."""
    monkeypatch.setattr(_run, "LEGS_AT_LEAST", 10_000)
    monkeypatch.setattr(_run, "LEGS_PER_PERIOD", 1000)


def battery(seeds):
    """Counts of what the machines did: statuses, impacts, sticks, balances drawn up."""
    status, impacts, sticks, closed = Counter(), 0, 0, 0
    for seed in seeds:
        found = run(seed)
        if found is not None:
            motion, balanced = found
            status[motion.status] += 1
            impacts, sticks = impacts + motion.impact_count, sticks + motion.stick_count
            closed += balanced
    return status, impacts, sticks, closed


def test_no_random_machine_breaks_an_invariant():
    status, impacts, sticks, closed = battery(range(300))
    assert set(status) == {"complete", "work limit"}
    assert status["work limit"] < 15
    assert closed > 180
    assert impacts > 5000
    assert sticks > 500


@pytest.mark.slow
def test_no_random_machine_of_many_breaks_an_invariant():
    status, impacts, sticks, closed = battery(range(10_000, 20_000))
    assert set(status) == {"complete", "work limit"}
    assert status["work limit"] < 800
    assert closed > 6000
    assert impacts > 5_000_000
    assert sticks > 500_000
