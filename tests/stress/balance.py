"""Energy balances of a motion from its samples alone: what engine and bookkeeping must agree with.

Between two events the kinetic energy and that of the spring change by the work of every other
force, which Gauss' quadrature finds from exact samples and the forces as the oscillator states
them.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from impactsig import KelvinVoigt, Rigid

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


class Scene:
    """An oscillator that started at a phase of its reference forcing, as forces."""

    def __init__(self, machine, phase):
        self.machine = machine
        self.unit = machine.time_unit
        reference = machine.forcing_frequency
        self.ahead = phase / reference if reference else 0.0
        self.rigid = [stop for stop in machine.stops if isinstance(stop.law, Rigid)]
        self.soft = [stop for stop in machine.stops if isinstance(stop.law, KelvinVoigt)]

    def base(self, time):
        """Displacement and velocity of the base."""
        base, t = self.machine.base, time / self.unit + self.ahead
        if base is None:
            return 0 * t, 0 * t
        angle = base.frequency * t + base.phase
        return base.amplitude * np.cos(angle), -base.amplitude * base.frequency * np.sin(angle)

    def carrier(self, time):
        """Displacement and velocity of what the stops stand on, and the mass rubs against."""
        at, moving = self.base(time)
        carried = self.machine.base is not None and self.machine.base.stops
        return (at, moving) if carried else (0 * at, 0 * moving)

    def digit(self, motion):
        """How well an instant of the motion is known [s]: to its digits, and the phase's."""
        longest = max(abs(motion.start), abs(motion.stop))
        reference = self.machine.forcing_frequency or self.machine.natural_frequency or 1.0
        return 4 * max(np.spacing(longest), np.spacing(2 * math.pi) * self.unit / reference)

    def blur(self, x, v, moving, digit):
        """How far the force of soft stops is uncertain, as an instant and a place are."""
        depth = 4 * np.spacing(np.abs(x)) + digit / self.unit * (np.abs(v) + np.abs(moving))
        return depth * sum(stop.law.stiffness for stop in self.soft)

    def force(self, time, x, v):
        """Every force on the mass but its spring's and the reactions of rigid stops: sum, size.

        The size is what the sum would be if none balanced another: rounding is a share of that.
        """
        machine, t = self.machine, time / self.unit + self.ahead
        at, moving = self.base(time)
        base = machine.base
        parts = [machine.load + 0 * t]
        parts += [f.amplitude * np.cos(f.frequency * t + f.phase) for f in machine.forces]
        parts.append(-machine.damping * (v - (moving if base and base.damper else 0)))
        parts.append(machine.stiffness * (at if base and base.spring else 0 * t))
        at, moving = self.carrier(time)
        for stop in self.soft:
            sign = 1 if stop.side == "upper" else -1
            depth, closing = sign * (x - at - stop.position), sign * (v - moving)
            push = stop.law.stiffness * depth + stop.law.damping * closing
            if stop.law.ends == "force":
                push = np.maximum(push, 0)
            parts.append(-sign * np.where(depth > 0, push, 0))
        if machine.friction is not None:
            parts.append(-machine.friction.kinetic * np.sign(v - moving))
        return sum(parts), sum(np.abs(part) for part in parts) + machine.stiffness * np.abs(x)

    def pressed(self, motion, time):
        """Whether a soft stop is."""
        place = motion.sample(time)[0] - self.carrier(time)[0]
        return any(
            place > stop.position if stop.side == "upper" else place < stop.position
            for stop in self.soft
        )

    def rates(self, touched):
        """The fastest rate of a region, the slowest its fast part may hide, and the forcing's."""
        machine = self.machine
        soft = self.soft if touched else []
        stiffness = machine.stiffness + sum(stop.law.stiffness for stop in soft)
        damping = machine.damping + sum(stop.law.damping for stop in soft)
        forcing = [force.frequency for force in machine.forces]
        forcing += [machine.base.frequency] if machine.base else []
        drive = max(forcing, default=0.0)
        natural, loss = math.sqrt(stiffness / machine.mass), damping / machine.mass
        if loss > 2 * natural:
            return max(loss, drive), max(drive, 2 * stiffness / damping if damping else 0.0)
        return (max(natural, loss, drive),) * 2


def cells(length, fast, slow, most):
    """Edges of cells: short where a fast part decays, then as the slow part allows."""
    edges, width = [0.0], 0.5 / fast
    if fast <= slow:
        return np.linspace(0, min(length, most * width), min(most, math.ceil(length / width)) + 1)
    while edges[-1] < length and len(edges) <= most:
        edges.append(min(edges[-1] + min(max(width, 0.2 * edges[-1]), 0.5 / slow), length))
    return np.array(edges)


NODES_01 = (NODES + 1) / 2


def kinks(scene, motion, edges):
    """The instants between the first edge and the last at which a force has a kink or a jump.

    Where the velocity against the carrier turns, if there is friction; where a soft stop is touched
    or left, if the motion began in contact or a contact only pushes.
    """
    fine = np.unique(np.concatenate([edges, *(edges[:-1] + s * np.diff(edges) for s in NODES_01)]))

    def signals(time):
        x, v = motion.sample(time)
        at, moving = scene.carrier(time)
        if scene.machine.friction is not None:
            yield v - moving
        for stop in scene.soft:
            yield x - at - stop.position
            if stop.law.ends == "force":
                push = stop.law.stiffness * (x - at - stop.position)
                yield push + stop.law.damping * (v - moving)

    found = [edges[[0, -1]]]
    for n, way in enumerate(signals(fine)):
        where = np.flatnonzero(way[:-1] * way[1:] < 0)
        low, high = fine[where], fine[where + 1]
        for _ in range(55 if len(where) else 0):
            middle = (low + high) / 2
            same = list(signals(middle))[n] * way[where] > 0
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        found.append(low)
    return np.unique(np.concatenate(found))


def spans(motion, first, count):
    """Spans between events from a given one on: begin, end, in contact, stuck or about to be."""
    impacts, sticks = motion.impacts, motion.sticks
    lasts = impacts.contact_time
    parts = impacts.time if lasts is None else np.append(impacts.time, impacts.time + lasts)
    edges = np.unique(np.concatenate([[motion.start, motion.stop], parts, sticks.ravel()]))
    edges = edges[first : first + count + 1]
    middle = (edges[:-1] + edges[1:]) / 2
    stuck = np.zeros(len(middle), bool)
    if len(sticks):
        k = np.searchsorted(sticks[:, 0], middle, side="right") - 1
        stuck = (k >= 0) & (middle < sticks[np.maximum(k, 0), 1])
    # What a chatter sums is no flight that could be sampled.
    summed = np.isin(edges[1:], sticks[:, 0]) & np.isin(edges[:-1], impacts.time)
    touched = np.zeros(len(middle), bool)
    if lasts is not None and len(lasts):
        end = np.maximum.accumulate(impacts.time + lasts)
        k = np.searchsorted(impacts.time, middle, side="right") - 1
        touched = (k >= 0) & (middle < end[np.maximum(k, 0)])
    return edges, touched, stuck, summed


def check_energy(scene, motion, first, most=1000):
    """Every span from event `first` on, up to `most` cells; how many spans were looked at."""
    machine = scene.machine
    edges, touched, stuck, summed = spans(motion, first, 60)
    digit = scene.digit(motion)
    used, looked = 0, 0
    for k, (begin, end) in enumerate(pairwise(edges)):
        if stuck[k]:
            time = np.linspace(begin, end, 7)[1:-1]
            x, v = motion.sample(time)
            moving = scene.carrier(time)[1]
            size = scene.force(time, x, v)[1] / machine.mass * digit / scene.unit
            assert np.all(np.abs(v - moving) <= 1e-12 * (np.abs(moving).max() + size))
            looked += 1
            continue
        if summed[k] or end - begin < 1e4 * digit or used >= most:
            continue
        if scene.pressed(motion, begin + digit):
            touched[k] = True
        fast, slow = (rate / scene.unit for rate in scene.rates(touched[k]))
        grid = begin + digit + cells(end - begin - 2 * digit, fast, slow, most - used)
        if machine.friction is not None or scene.soft:
            # At a kink the fast part begins anew.
            ends = kinks(scene, motion, grid)
            parts = [
                low + cells(high - low, fast, slow, most - used) for low, high in pairwise(ends)
            ]
            grid = np.unique(np.concatenate([ends[-1:], *parts]))
        used += len(grid) - 1
        width = np.diff(grid)
        time = grid[:-1, None] + width[:, None] * NODES_01
        x, v = motion.sample(time)
        for stop in scene.rigid:
            sign = 1 if stop.side == "upper" else -1
            beyond = sign * (x - scene.carrier(time)[0] - stop.position)
            assert beyond.max() <= 1e-12 * (np.abs(x).max() + abs(stop.position))
        power, size = (force * v for force in scene.force(time, x, v))
        work = (power @ WEIGHTS / 2) @ width / scene.unit
        x, v = motion.sample(grid[[0, -1]])
        energy = machine.mass * v**2 / 2 + machine.stiffness * x**2 / 2
        turnover = (np.abs(size) @ WEIGHTS / 2) @ width / scene.unit
        lost_digits = digit / scene.unit * np.abs(size).max(axis=1).sum()
        slack = 1e-11 * (turnover + energy.max()) + lost_digits
        if touched[k]:
            x, v = motion.sample(time)
            blur = scene.blur(x, v, scene.carrier(time)[1], digit) * np.abs(v)
            slack += (blur @ WEIGHTS / 2) @ width / scene.unit
        assert abs(energy[1] - energy[0] - work) <= slack, (begin, end, energy, work, slack)
        looked += 1
    return looked


def check_restitution(scene, motion, first, most=2000):
    """Velocities just before and after impacts on rigid stops; how many were looked at."""
    impacts = motion.impacts[first : first + most]
    digit = scene.digit(motion)
    room = np.minimum(
        np.diff(impacts.time, prepend=motion.start), np.diff(impacts.time, append=motion.stop)
    )
    time = impacts.time[room > 100 * digit]
    if not len(time) or not scene.rigid:
        return 0
    approach = impacts.approach_velocity[room > 100 * digit]
    at, moving = scene.carrier(time)
    x, after = motion.sample(time + digit)
    _, before = motion.sample(time - digit)
    bend = sum(scene.force(time, x, v)[1] for v in (before, after)) / scene.machine.mass
    slack = 1e-11 * (np.abs(before) + np.abs(moving)) + 4 * digit / scene.unit * bend
    looked = 0
    for stop in scene.rigid:
        own = np.abs(x - at - stop.position) <= 1e-9 * (np.abs(x) + abs(stop.position)) + (
            4 * digit / scene.unit * (np.abs(before) + np.abs(after))
        )
        sign = 1 if stop.side == "upper" else -1
        own &= sign * (before - moving) > slack
        hit = sign * (before - moving)[own]
        back = -sign * (after - moving)[own]
        r = stop.law.restitution
        r = np.array([r(u) for u in hit]) if callable(r) else r
        assert np.all(np.abs(hit - approach[own]) <= slack[own])
        assert np.all(np.abs(back - r * hit) <= 2 * slack[own])
        looked += own.sum()
    return int(looked)
