"""Slow readable twin of delayed feedback: the method of steps by Taylor series, in many digits.

x'' + 2 zeta x' + x = A cos(omega t) + F,  F = clip(K (w(t) - y(t)), +-F0),  x <= 1,
w(t) = (1 - R) y(t - tau) + R w(t - tau), with an impact x' -> -r x' at x = 1. Every piece is a
Taylor series about its beginning; pieces end at impacts, at the limits, and one delay after the
ends of earlier pieces, so that what is delayed is one shifted series on each.
"""

from __future__ import annotations

from dataclasses import dataclass

import mpmath as mp
import numpy as np

ORDER = 30
LONGEST = mp.mpf("0.4")  # of a piece


@dataclass
class Piece:
    start: mp.mpf
    length: mp.mpf
    x: list
    v: list
    fed: list  # what is fed back one delay later
    force: list


def value(c, t):
    total = mp.mpf(0)
    for own in reversed(c):
        total = total * t + own
    return total


def shifted(c, t):
    """Coefficients of the series about a point t later."""
    c = list(c)
    for i in range(len(c)):
        for j in range(len(c) - 2, i - 1, -1):
            c[j] += t * c[j + 1]
    return c


def root(c, length):
    """First root in (0, length) of a series that is positive at first, by a fine look; or None."""
    looks = 24
    before = mp.mpf(0)
    for i in range(1, looks + 1):
        t = length * i / looks
        if value(c, t) < 0:
            low, high = before, t
            for _ in range(20):
                middle = (low + high) / 2
                low, high = (middle, high) if value(c, middle) > 0 else (low, middle)
            slope = [k * c[k] for k in range(1, len(c))]
            t = (low + high) / 2
            for _ in range(8):
                t -= value(c, t) / value(slope, t)
            return t
        before = t
    return None


def series(t, x, v, zeta, omega, amplitude, gain, late, fixed, velocity):
    """Taylor coefficients of a piece: feedback of the series `late`, or a force `fixed`."""
    xs, vs = [x], [v]
    for k in range(ORDER):
        push = amplitude * omega**k * mp.cos(omega * t + k * mp.pi / 2) / mp.factorial(k)
        if fixed is not None:
            push += fixed if k == 0 else 0
        elif gain:
            push += gain * (late[k] - (vs[k] if velocity else xs[k]))
        vs.append((push - 2 * zeta * vs[k] - xs[k]) / (k + 1))
        xs.append(vs[k] / (k + 1))
    return xs, vs


def controlled(
    zeta, omega, amplitude, r, gain, tau, start, end,
    limit=None, velocity=True, memory=0, initial=(0, 0),
):  # fmt: skip
    """Pieces from 0 to `end`, with the feedback from `start` on, and the instants of impact."""
    t, x, v = mp.mpf(0), mp.mpf(initial[0]), mp.mpf(initial[1])
    pieces: list[Piece] = []
    hits = []
    tiny = mp.mpf(10) ** (-mp.mp.dps + 8)
    edge = 0  # the limit that the piece begins at, and the side it goes to
    side = 0
    while t < end - tiny:
        on = t >= start - tiny
        length = min(LONGEST, end - t if on else min(end, start) - t)
        late = [mp.mpf(0)] * (ORDER + 1)
        if on:
            past = next(p for p in reversed(pieces) if p.start <= t - tau + tiny)
            length = min(length, past.start + past.length - (t - tau))
            fed = past.fed if past.start >= start - tiny else (past.v if velocity else past.x)
            late = shifted(fed, t - tau - past.start)
            now = gain * (late[0] - (v if velocity else x))
            if limit is not None and not edge:
                side = (now > limit) - (now < -limit)
        edge, begun = 0, edge
        fixed = side * limit if on and side else None
        xs, vs = series(t, x, v, zeta, omega, amplitude, gain if on else 0, late, fixed, velocity)
        own = vs if velocity else xs
        gap = [gain * (a - b) for a, b in zip(late, own, strict=True)]
        hit = root([1 - xs[0]] + [-c for c in xs[1:]], length)
        due = "hit" if hit is not None else None
        length = hit if hit is not None else length
        if on and limit is not None:
            for way in (side,) if side else (1, -1):
                sign = way if side else -way
                c = [sign * g for g in gap]
                c[0] += -limit if side else limit
                if begun == way:  # the root it begins at, divided out
                    c = c[1:]
                    if c[0] <= 0:
                        continue
                at = root(c, length)
                if at is not None:
                    length, due, edge = at, "limit", way
        force = [mp.mpf(0)] * (ORDER + 1)
        if on:
            force = gap if fixed is None else [fixed, *force[1:]]
        fed = [(1 - memory) * a + memory * b for a, b in zip(own, late, strict=True)]
        pieces.append(Piece(t, length, xs, vs, fed, force))
        t, x, v = t + length, value(xs, length), value(vs, length)
        if due == "hit":
            hits.append(t)
            x, v = mp.mpf(1), -r * v
            side = 0
        elif due == "limit":
            side = 0 if side else edge
    return pieces, hits


def state(pieces, t):
    """Displacement, velocity and control force at an instant."""
    own = next(p for p in reversed(pieces) if p.start <= t)
    return tuple(value(c, t - own.start) for c in (own.x, own.v, own.force))


def flow_multipliers(rates, jacobian, state, period, coordinate, gain, steps):
    """Multipliers of an orbit of a flow under feedback of a coordinate one period later.

    The orbit by the classical Runge-Kutta method; ``z' = A z + K e (s(t - T) - s(t))``, s the
    coordinate of z, by the trapezoidal rule, so with an error of the square of the step. The map
    of a period takes z and the history of s, here as columns of a matrix.
    """
    h = period / steps
    orbit = [np.array(state, float)]
    for _ in range(steps):
        y = orbit[-1]
        k1 = rates(y)
        k2 = rates(y + h / 2 * k1)
        k3 = rates(y + h / 2 * k2)
        k4 = rates(y + h * k3)
        orbit.append(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    d = len(state)
    columns = np.eye(d + steps + 1)
    z, late = columns[:d], columns[d:]
    fed = np.zeros((d, 1))
    fed[coordinate] = gain
    history = [z[coordinate]]
    for n in range(steps):
        before, after = (jacobian(y) - fed * np.eye(d)[coordinate] for y in orbit[n : n + 2])
        push = fed * (late[n] + late[n + 1])
        right = z + h / 2 * (before @ z + push)
        z = np.linalg.solve(np.eye(d) - h / 2 * after, right)
        history.append(z[coordinate])
    values = np.linalg.eigvals(np.concatenate([z, np.array(history)]))
    return values[np.argsort(-np.abs(values))]
