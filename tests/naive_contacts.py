"""A rubbing machine between stops of every kind, by matrix exponentials and small steps.

The state is (x, v, 1, cos, sin, ...) against the ground, with a cosine and a sine for every
frequency there is, so that every mode of the machine is y' = A y. Gaps are linear forms of y. They
are looked at after steps that double from 1e-9 to 2e-3; the first one that has closed is found by
bisection. Nothing here is fast, and nothing depends on how the engine does it.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from impactsig import KelvinVoigt, Rigid

SHORT, LONG = 1e-9, 2e-3


def exponential(matrix):
    """exp of a small matrix by its series and by squaring."""
    squarings = max(0, math.ceil(math.log2(2 * np.abs(matrix).sum(axis=1).max() + 1e-300)))
    small = matrix / 2**squarings
    total = term = np.eye(len(matrix))
    for n in range(1, 19):
        term = term @ small / n
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return total


@dataclass(frozen=True)
class Event:
    kind: str
    stop: int  # place in `Oscillator.stops`, or -1
    time: float
    approach: float = 0.0


@dataclass(frozen=True)
class Mode:
    """Soft stops that the mass is beyond and those of them that push; the way it slides."""

    beyond: frozenset
    pushing: frozenset
    way: int = 0  # of friction; 0 without
    stuck: bool = False


class Machine:
    """An `Oscillator` in ground coordinates; time in its own unit, phases as at t = 0."""

    def __init__(self, oscillator, phase=0.0):
        self.machine = o = oscillator
        sources = [*o.forces, *([o.base] if o.base else [])]
        reference = sources[0].angular_frequency if sources else 1.0
        self.size = 3 + 2 * len(sources)
        self.start = [1.0]
        self.matrix = np.zeros((self.size, self.size))
        force, self.base = np.zeros(self.size), np.zeros((2, self.size))
        force[0], force[1], force[2] = -o.stiffness, -o.damping, o.load
        for n, source in enumerate(sources):
            at, w = 3 + 2 * n, source.angular_frequency
            angle = w / reference * phase + source.phase
            self.start += [math.cos(angle), math.sin(angle)]
            self.matrix[at, at + 1], self.matrix[at + 1, at] = -w, w
            if source is not o.base:
                force[at] += source.amplitude
                continue
            force[at] += o.base.spring * o.stiffness * source.amplitude
            force[at + 1] -= o.base.damper * o.damping * w * source.amplitude
            if o.base.stops:  # displacement and velocity of what the stops hang on
                self.base[0, at] = source.amplitude
                self.base[1, at + 1] = -w * source.amplitude
        self.matrix[0, 1] = 1
        self.force = force
        x, v = np.eye(self.size)[:2]
        self.sign = [1 if stop.side == "upper" else -1 for stop in o.stops]
        self.speed = v - self.base[1]
        self.depth = [
            s * (x - self.base[0] - stop.position * np.eye(self.size)[2])
            for s, stop in zip(self.sign, o.stops, strict=True)
        ]
        self.kinetic = o.friction.kinetic if o.friction else 0.0
        self.static = o.friction.static if o.friction else 0.0

    def soft(self, n):
        return isinstance(self.machine.stops[n].law, KelvinVoigt)

    def contact(self, n):
        """Force of a soft stop against the mass, as a form."""
        law = self.machine.stops[n].law
        return law.stiffness * self.depth[n] + law.damping * self.sign[n] * self.speed

    def ends_at_force(self, n):
        """Without a damper zero force is zero depth."""
        law = self.machine.stops[n].law
        return self.soft(n) and law.ends == "force" and law.damping > 0

    def net(self, pushing):
        """Force on the mass, but for friction and rigid stops."""
        return self.force - sum(self.sign[n] * self.contact(n) for n in pushing)

    @functools.lru_cache(maxsize=64)  # noqa: B019
    def flow(self, mode):
        """A of that mode, and exp(A h) for h = SHORT, 2 SHORT, ... LONG."""
        matrix = self.matrix.copy()
        if mode.stuck:
            matrix[0], matrix[1] = self.base[1], self.base[1] @ self.matrix
        else:
            matrix[1] = self.net(mode.pushing)
            matrix[1, 2] -= mode.way * self.kinetic
            matrix[1] /= self.machine.mass
        steps = 2.0 ** np.arange(math.ceil(math.log2(LONG / SHORT))) * SHORT
        return matrix, steps, [exponential(matrix * h) for h in steps]

    def gaps(self, mode, y):
        """Forms that are positive while the mode lasts, with what their closing is."""
        found = []
        rows = {sign: [] for sign in (1, -1)}
        for n in np.argsort([abs(stop.position) for stop in self.machine.stops]):
            rows[self.sign[n]].append(int(n))
        if mode.stuck:
            low, high = self.grip(y)
            pull = self.net(mode.pushing) - self.machine.mass * (self.base[1] @ self.matrix)
            one = np.eye(self.size)[2]
            if high < math.inf:
                found.append((high * one - pull, "RELEASE", 1))
            if low > -math.inf:
                found.append((pull - low * one, "RELEASE", -1))
            return found
        for n in range(len(self.machine.stops)):
            if n in mode.beyond:
                found.append((self.depth[n], "LEAVE", n))
                if self.ends_at_force(n):
                    form = self.contact(n)
                    found.append((form, "LIFT", n) if n in mode.pushing else (-form, "PRESS", n))
            else:
                found.append((-self.depth[n], "ENTER" if self.soft(n) else "HIT", n))
        if mode.way:
            found.append((mode.way * self.speed, "HALT", -1))
        return found

    def grip(self, y):
        low, high = -self.static, self.static
        for n, stop in enumerate(self.machine.stops):
            if isinstance(stop.law, Rigid) and abs(self.depth[n] @ y) < 1e-11:
                low, high = (low, math.inf) if self.sign[n] > 0 else (-math.inf, high)
        return low, high

    def follow(self, initial, end, chatter=1e-6, most=400):
        """Events until `end`, and the state there."""
        y = np.array([*initial, *self.start])
        beyond = frozenset(
            n for n in range(len(self.depth)) if self.soft(n) and self.depth[n] @ y > 0
        )
        pushing = frozenset(
            n for n in beyond if not self.ends_at_force(n) or self.contact(n) @ y > 0
        )
        mode = Mode(beyond, pushing)
        if self.static:
            speed = self.speed @ y
            mode = Mode(beyond, pushing, 1 if speed > 0 else -1)
        time, events, fastest = 0.0, [], 0.0
        while len(events) < most:
            tau, y, what, n = self.first(mode, y, end - time)
            time += tau
            if what is None:
                break
            beyond, pushing, way = mode.beyond, mode.pushing, mode.way
            speed = self.speed @ y
            if what == "HIT":
                approach = self.sign[n] * speed
                fastest = max(fastest, approach)
                r = self.machine.stops[n].law.restitution
                out = -(r(approach) if callable(r) else r) * speed
                events.append(Event("IMPACT", n, time, approach))
                pull = self.net(pushing) - self.machine.mass * (self.base[1] @ self.matrix)
                presses = self.sign[n] * (pull @ y) - self.kinetic > 0
                if out == 0 or (abs(out) < chatter * fastest and presses):
                    out = 0.0
                y[1] = self.base[1] @ y + out
                # A damper pulls at once where the velocity has turned.
                pushing = frozenset(
                    m for m in beyond if not self.ends_at_force(m) or self.contact(m) @ y > 0
                )
                for m in sorted(mode.pushing - pushing):
                    events.append(Event("PART", m, time))
                mode = Mode(beyond, pushing, (-self.sign[n] if out else self.sign[n]) if way else 0)
                if out == 0:
                    mode = self.rest(mode, y, time, events)
            elif what in ("ENTER", "PRESS"):
                approach = max(self.sign[n] * speed, 0.0)
                fastest = max(fastest, approach)
                events.append(Event("TOUCH", n, time, approach))
                mode = Mode(beyond | {n}, pushing | {n}, way)
            elif what == "LIFT":
                events.append(Event("PART", n, time))
                mode = Mode(beyond, pushing - {n}, way)
            elif what == "LEAVE":
                events.append(Event("PART" if n in pushing else "MARK", n, time))
                mode = Mode(beyond - {n}, pushing - {n}, way)
            elif what == "RELEASE":
                events.append(Event("RELEASE", -1, time))
                mode = Mode(beyond, pushing, n if self.static else 0)
            elif what == "HALT":
                y[1] = self.base[1] @ y
                mode = self.rest(mode, y, time, events)
        return events, y

    def rest(self, mode, y, time, events):
        """The mode of a mass at rest: held, or off with the force."""
        pull = (self.net(mode.pushing) - self.machine.mass * (self.base[1] @ self.matrix)) @ y
        low, high = self.grip(y)
        if low <= pull <= high:
            events.append(Event("STICK", -1, time))
            return Mode(mode.beyond, mode.pushing, mode.way, True)
        way = (1 if pull > high else -1) if self.static else 0
        if way != mode.way:
            events.append(Event("REVERSE", -1, time))
        return Mode(mode.beyond, mode.pushing, way)

    def first(self, mode, y, left):
        """Time to the first gap that closes, the state there and what closed; none before left."""
        matrix, steps, powers = self.flow(mode)
        gaps = self.gaps(mode, y)
        forms = np.array([form for form, _, _ in gaps]).reshape(-1, self.size)
        # A gap that starts closed is looked at once it has had the time to open.
        scale = np.abs(forms) @ np.abs(y) + 1e-300
        size, trend = forms @ y, forms @ (matrix @ y)
        after = np.where(np.abs(size) < 1e-12 * scale, np.where(trend > 1e-7, 1e-9, 3e-5), 0)
        for s in np.flatnonzero((after > 0) & (trend < -1e-7)):
            return 0.0, y, gaps[s][1], gaps[s][2]
        tau, n, stay = 0.0, 0, y
        while tau < left:
            h = min(steps[n], left - tau)
            power = powers[n] if h == steps[n] else exponential(matrix * h)
            new = power @ stay
            closed = np.flatnonzero((forms @ new < 0) & (tau + h > after))
            if len(closed):
                when = []
                for s in closed:

                    def value(t, form=forms[s], stay=stay):
                        return form @ exponential(matrix * t) @ stay

                    low = max(after[s] - tau, 0.0)
                    when.append(brentq(value, low, h, xtol=1e-16) if value(low) > 0 else low)
                s = closed[np.argmin(when)]
                return (
                    tau + min(when),
                    exponential(matrix * min(when)) @ stay,
                    gaps[s][1],
                    gaps[s][2],
                )
            tau, stay, n = tau + h, new, min(n + 1, len(steps) - 1)
        return left, stay, None, -1
