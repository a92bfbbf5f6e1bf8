"""What a motion must obey, from its samples and the forces as the oscillator states them.

Between two events the kinetic energy changes by the work of all forces, and the place by the
integral of the velocity; at an event only what the contact law says may jump. The events are where
cells of the quadrature begin, no more: one that is wrong or missing leaves the balance open.

No tolerance is chosen. What may stay open is what rounding of the forces, of the parts of the
closed form and of the instants explains (`Scene`), and what the quadrature says of its own error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from impactsig.simulation.basis.events import IMPACT, RELEASE, START, STICK, TOUCH

from .forces import FEW, Scene, State
from .quadrature import integrate

# Edges of cells. From an event on they grow, since a fast part may decay there; then none is so
# long that an oscillation could hide between its nodes.
LONGEST = 48.0  # of what is looked at of a piece, in radians of the rate that lasts
EDGES = np.concatenate([[0.0], 16.0 ** np.arange(-11, 0) / 12, np.arange(1, 13) / 12])


@dataclass(frozen=True)
class Pieces:
    """The motion from event to event; each array of shape (pieces,)."""

    begin: np.ndarray
    end: np.ndarray
    kind: np.ndarray  # of the event it begins with
    stop: np.ndarray  # place in `Oscillator.stops`, or -1
    approach: np.ndarray  # velocity, where it begins with an impact or a touch
    summed: np.ndarray  # whether it is a chatter's, and no flight that could be sampled
    long: np.ndarray  # whether instants resolve it

    def __getitem__(self, which):
        return Pieces(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


def pieces(scene, motion):
    rows = motion._segments
    unit = scene.unit / motion._engine.omega
    time = (rows[:, 0] * 2 * math.pi + (rows[:, 1] - motion._phase)) * unit
    time = np.clip(np.append(time, motion.stop), motion.start, motion.stop)
    kind = rows[:, 2]
    settles = (kind[:-1] == IMPACT) & (kind[1:] == STICK) & (rows[:-1, 5] == rows[1:, 5])
    approach = np.zeros(len(rows))
    approach[np.isin(kind, (IMPACT, TOUCH))] = motion.impacts.approach_velocity
    return Pieces(
        time[:-1],
        time[1:],
        kind,
        rows[:, 3].astype(int),
        approach,
        np.append(settles, False),
        np.diff(time) > 1e4 * scene.digit,
    )


def check_work(scene, motion, spans):
    """Energy and place of pieces of free motion; how many there were."""
    machine, digit, late, unit = scene.machine, scene.digit, scene.late, scene.unit
    # An event that jumps is left out; any other is crossed, where instants resolve the sides.
    jumps = np.isin(spans.kind, (START, IMPACT, STICK, RELEASE))
    jumps[0] = True
    jumps[1:] |= ~spans.long[:-1] | (spans.kind[:-1] == STICK) | spans.summed[:-1]
    which = np.flatnonzero(spans.long & (spans.kind != STICK) & ~spans.summed)
    spans, jumps = spans[which], jumps[which]
    if not len(which):
        return 0
    state = State(scene, (spans.begin + spans.end) / 2)
    k, c = state.pressed()
    way = np.sign(state.v - state.moving)[:, None]  # friction acts one way throughout
    waves = [f.angular_frequency for f in machine.forces] + [
        machine.base.angular_frequency if machine.base else 0
    ]
    lasting = np.maximum(scene.lasting(k, c), max(waves))
    first = spans.begin + np.where(jumps, digit, -digit)
    last = np.minimum(spans.end - digit, spans.begin + LONGEST * unit / lasting)

    inner = spans.begin + digit
    edges = inner[:, None] + (last - inner)[:, None] * EDGES
    edges = np.concatenate([first[:, None], edges], axis=1)
    low, high = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    owner = np.repeat(np.arange(len(which)), len(EDGES))[low < high]
    low, high = low[low < high], high[low < high]

    x, v = np.abs(motion.sample(np.linspace(first, last, 9, axis=1))).max(axis=2)
    place, speed = scene.rounding(k, c, x, v)

    def rates(time, owner):
        """Power and velocity per second, and how far they are uncertain."""
        state = State(scene, time, place[owner, None])
        assert not np.any(state.penetrates())
        (force, rough), (k, c), v = state.force(), state.pressed(), state.v
        off = speed[owner, None]
        rough = rough + k * place[owner, None] + c * off + FEW * scene.kinetic
        if scene.kinetic:
            bend = np.abs(state.pace) + (np.abs(force) + scene.kinetic) / machine.mass
            assert np.all(way[owner] * (v - state.moving) >= -4 * (off + late * bend))
            force = force - scene.kinetic * way[owner]
        rough = rough * np.abs(v) + np.abs(force) * off
        return np.stack([force * v, v]) / unit, np.stack([rough, 0 * v + off]) / unit

    (work, path), (loose, far) = integrate(rates, low, high, owner, len(which), digit, 40_000)
    ends = np.stack([first, last], axis=1)
    x, v = motion.sample(ends)
    energy = machine.mass / 2 * v**2
    power, along = np.abs(rates(ends, np.arange(len(which)))[0]).sum(axis=2)
    v = np.abs(v).sum(axis=1)
    # At a reversal friction acts the other way for an instant; across any event the piece begins
    # as uncertain as the one before ends.
    before = np.where(jumps, 0.0, np.roll(np.stack([place, speed]), 1, axis=1))
    loose += digit * power + late * 4 * scene.kinetic * v
    loose += machine.mass * v * np.maximum(speed, before[1]) + FEW * energy.sum(axis=1)
    far += digit * along + place + np.maximum(place, before[0])
    open_energy = np.abs(np.diff(energy, axis=1)[:, 0] - work)
    open_way = np.abs(np.diff(x, axis=1)[:, 0] - path)
    worst = np.argmax(open_energy / loose)
    assert np.all(open_energy <= loose), (worst, first[worst], open_energy[worst], loose[worst])
    worst = np.argmax(open_way / far)
    assert np.all(open_way <= far), (worst, first[worst], open_way[worst], far[worst])
    return len(which)


def check_rests(scene, spans):
    """Held masses move with what holds them, which is strong enough; how many there were."""
    spans = spans[spans.long & (spans.kind == STICK)]
    state = State(scene, np.linspace(spans.begin, spans.end, 7, axis=1)[:, 1:-1])
    slack = FEW * np.abs(state.moving) + scene.late * np.abs(state.pace)
    assert np.all(np.abs(state.v - state.moving) <= slack)
    place = state.x - state.at
    room = FEW * (np.abs(state.x) + np.abs(state.at)) + state.blur
    assert np.all(np.abs(place - place[:, :1]) <= room + room[:, :1])
    force, rough = state.force()
    inertia = scene.machine.mass * state.pace
    rough = rough + FEW * np.abs(inertia) + FEW * scene.static
    low, high = -scene.static - rough, scene.static + rough
    for stop in scene.rigid:
        depth, blur = state.depth(stop)
        touched = np.abs(depth) <= blur
        if stop.side == "upper":
            high = np.where(touched, np.inf, high)
        else:
            low = np.where(touched, -np.inf, low)
    held = force - inertia
    assert np.all((held >= low) & (held <= high))
    return len(spans.begin)


def check_penetration(scene, motion):
    state = State(scene, np.linspace(motion.start, motion.stop, 300))
    assert np.all(np.isfinite(state.x))
    assert np.all(np.isfinite(state.v))
    assert not np.any(state.penetrates())


def coefficient(stop, approach):
    r = stop.law.restitution
    return np.array([r(u) for u in approach]) if callable(r) else np.full(len(approach), float(r))


def check_contacts(scene, spans):
    """Place and velocities before and after a stop is touched; how many were rigid."""
    apart = np.append(False, spans.long[1:] & spans.long[:-1] & ~spans.summed[:-1])
    apart &= ~np.append(True, spans.kind[:-1] == STICK)
    apart &= np.isin(spans.kind, (IMPACT, TOUCH))
    looked = 0
    for number, stop in enumerate(scene.machine.stops):
        sign = 1 if stop.side == "upper" else -1
        own = apart & (spans.stop == number)
        t, u = spans.begin[own], spans.approach[own]
        state, sides = State(scene, t), []
        # On which side of the touch an instant is, its damper does or does not pull.
        drag = 0.0 if stop in scene.rigid else stop.law.damping * u
        slack = scene.late * np.abs(state.pace)
        for instant in (t - scene.digit, t + scene.digit):
            sides.append(side := State(scene, instant))
            place, speed = scene.rounding(*side.pressed(), side.x, side.v)
            bend = (np.abs(side.force()[0]) + scene.kinetic + drag) / scene.machine.mass
            slack = slack + speed + 2 * scene.late * bend
        before, after = sides
        hit, back = sign * (before.v - state.moving), sign * (state.moving - after.v)
        if stop in scene.rigid:
            depth, blur = after.depth(stop)
            assert np.all(np.abs(depth) <= blur + 2 * place + 2 * scene.late * np.abs(back))
            assert np.all(np.abs(back - coefficient(stop, u) * u) <= slack)
            looked += len(t)
        else:  # one that only pushes may be touched again while it is behind the mass
            hit = np.maximum(hit, 0)
        assert np.all(np.abs(hit - u) <= slack), stop
    return looked


def check_losses(scene, motion, spans):
    """What impacts take is what the laws say, and all there is without contacts and friction."""
    assert motion.energy_lost >= 0 or scene.soft
    if scene.soft or scene.static:
        return
    spans, lost = spans[spans.kind == IMPACT], 0.0
    for number, stop in enumerate(scene.machine.stops):
        own = spans[spans.stop == number]
        r = coefficient(stop, own.approach) * ~own.summed  # the last of a chatter takes all
        lost += scene.machine.mass / 2 * ((1 - r) * (1 + r) * own.approach**2).sum()
    size = scene.machine.mass / 2 * (spans.approach**2).sum()
    assert abs(motion.energy_lost - lost) <= FEW * (len(spans.begin) + 1) * size


def check(machine, motion, phase, first=0, most=60):
    """All of it, balances for up to `most` pieces from one on; counts of what was looked at."""
    impacts, sticks = motion.impacts, motion.sticks
    assert np.all(np.isfinite(motion.final))
    assert len(impacts) == motion.impact_count
    assert np.all(np.diff(impacts.time) >= 0)
    assert np.all(impacts.approach_velocity >= 0)
    assert impacts.contact_time is None or np.all(impacts.contact_time >= 0)
    assert np.all(sticks[:, 1] >= sticks[:, 0])
    assert np.all(sticks[1:, 0] >= sticks[:-1, 1])
    scene = Scene(machine, phase, motion)
    spans = pieces(scene, motion)
    check_penetration(scene, motion)
    check_losses(scene, motion, spans)
    few = spans[first : first + most]
    return {
        "spans": check_work(scene, motion, few),
        "rests": check_rests(scene, few),
        "rebounds": check_contacts(scene, spans[first : first + 2000]),
    }
