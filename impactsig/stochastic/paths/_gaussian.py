"""Exact Gaussian transition of a linear oscillator, with bridges where it may hit a stop.

Without stops, position and velocity after a step are normal, with mean and covariance in closed
form. Between the ends of a step the position is a bridge of an integrated process, which is smooth:
it strays from the cubic through both ends by no more than sigma h^(3/2) / sqrt(192) in standard
deviation. So most steps are certain to have met no stop. One that is not is halved: the state in
the middle is drawn from its distribution given both ends, and each half looked at in turn, from
the left, until it is certain or 2^-LEVELS of the step. As the motion is linear, an impact adds to
the free path the answer to a jump of the velocity, and leaves the random force, and so what was
drawn of the path, as they were.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ._random import Numbers, draw, draw_pair, numbers
from .equation import BLOCK, Q, V, ground_at, note, restitution

LEVELS = 14  # fewer than `Room.stack` has room for
CERTAIN = 6.0  # standard deviations
WORK = 4096  # bridges in a step, after which halves are halved no more


class Transition(NamedTuple):
    """Propagators and covariances of a step and its halvings; level 0 is the step."""

    length: np.ndarray  # shape (LEVELS + 1,)
    flow: np.ndarray  # shape (LEVELS + 1, 2, 2): answer to a state
    drift: np.ndarray  # shape (LEVELS + 1, 2): answer to the constant force
    root: np.ndarray  # shape (2, 2): lower Cholesky factor of the step's covariance
    pull: np.ndarray  # shape (LEVELS, 2, 2): of what the end is off by, to the middle
    spread: np.ndarray  # shape (LEVELS, 2, 2): lower Cholesky factor of the middle's covariance
    stray: np.ndarray  # shape (LEVELS + 1,): how far a path may stray from the cubic
    bend: np.ndarray  # shape (LEVELS + 1, 2): the same, by position and velocity
    waves: np.ndarray  # shape (n, 3): frequency, amplitude and angle of the forced motion


@kernel
def forced_at(waves, t):
    """Position and velocity of the forced motion."""
    q, v = 0.0, 0.0
    for j in range(len(waves)):
        angle = waves[j, 0] * t + waves[j, 2]
        q += waves[j, 1] * math.cos(angle)
        v -= waves[j, 1] * waves[j, 0] * math.sin(angle)
    return q, v


@inlined
def certain(p, w, level, q, v, q1, v1):
    """Whether a path between these ends certainly misses the rigid stops.

    The cubic through both ends lies between the least and the greatest of its Bernstein points.
    """
    third = w.length[level] / 3
    room = w.stray[level] + w.bend[level, 0] * abs(q) + w.bend[level, 1] * abs(v)
    left, right = q + third * v, q1 - third * v1
    return (
        min(min(q, q1), min(left, right)) - room > p.low
        and max(max(q, q1), max(left, right)) + room < p.high
    )


@kernel
def resolve(p, w, f, key, path, r, count, events, lane, step, uq, uv, uq1, uv1):
    """State after a step that would end at uq1, uv1 without stops; of the free motion."""
    stack, pair = r.stack, r.pair
    dq, dv = 0.0, 0.0  # what impacts have added to the free path
    t, number, held = step * p.step, 0, 1
    stack[0, 0], stack[0, 1], stack[0, 2] = uq1, uv1, 0.0
    while held > 0:
        held -= 1
        rq, rv, level = stack[held, 0], stack[held, 1], int(stack[held, 2])
        span, m = w.length[level], w.flow[level]
        eq, ev = m[0, 0] * dq + m[0, 1] * dv, m[1, 0] * dq + m[1, 1] * dv
        fq, fv = forced_at(w.waves, t)
        gq, gv = forced_at(w.waves, t + span)
        q, v, q1, v1 = uq + dq + fq, uv + dv + fv, rq + eq + gq, rv + ev + gv
        if not certain(p, w, level, q, v, q1, v1):
            if level < LEVELS and number < WORK:
                half, k, c = w.flow[level + 1], w.pull[level], w.spread[level]
                offq = rq - (m[0, 0] * uq + m[0, 1] * uv + w.drift[level, 0])
                offv = rv - (m[1, 0] * uq + m[1, 1] * uv + w.drift[level, 1])
                draw_pair(r, key, path, step, number, pair)
                number += 1
                stack[held, 2] = level + 1
                stack[held + 1, 0] = (
                    half[0, 0] * uq + half[0, 1] * uv + w.drift[level + 1, 0]
                    + k[0, 0] * offq + k[0, 1] * offv + c[0, 0] * pair[0]
                )  # fmt: skip
                stack[held + 1, 1] = (
                    half[1, 0] * uq + half[1, 1] * uv + w.drift[level + 1, 1]
                    + k[1, 0] * offq + k[1, 1] * offv + c[1, 0] * pair[0] + c[1, 1] * pair[1]
                )  # fmt: skip
                stack[held + 1, 2] = level + 1
                held += 2
                continue
            if q1 < p.low or q1 > p.high:
                upper = q1 > p.high
                wall = p.high if upper else p.low
                share = min(max((wall - q) / (q1 - q), 0.0), 1.0) if q1 != q else 0.0
                speed = v + share * (v1 - v)
                out = max(speed if upper else -speed, 0.0)
                back = restitution(p, f, upper, out)
                stop = p.high_stop if upper else p.low_stop
                note(events, count, lane, t + share * span, stop, out)
                jump = (1 + back) * (-out if upper else out)
                eq += jump * (1 - share) * span
                ev += jump
                # Pressed again within what is not resolved, the mass is left at the stop.
                q1, v1 = rq + eq + gq, rv + ev + gv
                if q1 < p.low or q1 > p.high:
                    eq += wall - q1
                    if v1 > 0 if upper else v1 < 0:
                        ev -= (1 + back) * v1
        t += span
        uq, uv, dq, dv = rq, rv, eq, ev
    return uq + dq, uv + dv


def scratch(lanes: int) -> Numbers:
    """Allocate work arrays for so many paths."""
    return numbers(lanes, 2 * BLOCK)


@kernel
def begin(p, f, key, path, given, state, count, events):
    """Does nothing: the state is that at t = 0."""


@kernel
def move(p, w, f, key, path, given, state, count, first, last, every, seen, events):
    """Move a group of paths from step `first` to step `last`; as `_splitting.move` does."""
    h, lanes = p.step, state.shape[1]
    r, z = given.room, given.normal
    m = w.flow[0]
    looks = 0
    step = first
    while step < last:
        block = step // BLOCK
        stop = min(last, (block + 1) * BLOCK)
        for lane in range(lanes):
            draw(r, key, path[lane], block, z[lane])
        for now in range(step, stop):
            k = now - block * BLOCK
            fq, fv = forced_at(w.waves, now * h)
            gq, gv = forced_at(w.waves, (now + 1) * h)
            for lane in range(lanes):
                uq, uv = state[Q, lane] - fq, state[V, lane] - fv
                one, two = z[lane, k], z[lane, BLOCK + k]
                q = m[0, 0] * uq + m[0, 1] * uv + w.drift[0, 0] + w.root[0, 0] * one
                v = m[1, 0] * uq + m[1, 1] * uv + w.drift[0, 1]
                v += w.root[1, 0] * one + w.root[1, 1] * two
                if not certain(p, w, 0, state[Q, lane], state[V, lane], q + gq, v + gv):
                    q, v = resolve(
                        p, w, f, key, path[lane], r, count, events, lane, now,
                        uq, uv, q, v,
                    )  # fmt: skip
                state[Q, lane], state[V, lane] = q + gq, v + gv
            if (now + 1) % every == 0 and looks < seen.shape[1]:
                at, moving = ground_at(p, (now + 1) * h)
                for lane in range(lanes):
                    seen[lane, looks, 0] = state[Q, lane] + at
                    seen[lane, looks, 1] = state[V, lane] + moving
                looks += 1
        step = stop
