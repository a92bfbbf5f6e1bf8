"""The flow of one mode in closed form: forced response, decaying free motion, and their bounds.

In the unit of time in which the forcing period is 2 pi,

    q'' + 2 delta q' + kappa q = sum_j (A_j cos theta_j + B_j sin theta_j) + f,

q counted from the origin of the mode. A leg is a stretch of motion in one mode. Where it is short
its Taylor series serves, which keeps the digits of tiny gaps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel, njit
from ..basis.events import PHASE, TURN, TURNS

ORDER = 12  # of the Taylor series that serves short legs
COMPLETE = ORDER + 1  # where a series tells whether it is
INVERSE = tuple([0.0] + [1 / n for n in range(1, 18)])


class Problem(NamedTuple):
    """An oscillator, its forcing period 2 pi, as modes with their gaps."""

    kappa: np.ndarray  # shape (modes,), as all down to drift
    delta: np.ndarray
    root: np.ndarray  # sqrt |kappa - delta^2|
    damping_kind: np.ndarray  # sign of kappa - delta^2: 1 underdamped, 0 critical, -1 overdamped
    constant: np.ndarray  # f, kinetic friction included
    rest: np.ndarray  # f / kappa; 0 where kappa < 1: far from there, it would cost the digits
    drift: np.ndarray  # f where kappa < 1, else 0
    cosine: np.ndarray  # forced response, shape (modes, components)
    sine: np.ndarray
    reach: np.ndarray  # bounds of the forced response and of its derivatives, shape (modes, 5)
    rate: np.ndarray  # the fastest rate there is, for the range of the Taylor series
    ratio: np.ndarray  # frequencies over that of the reference, shape (components,)
    force_cos: np.ndarray
    force_sin: np.ndarray
    force_bound: np.ndarray  # bounds of the forcing and its derivatives, shape (4,)
    pressed: np.ndarray  # how many soft stops each mode presses on
    gaps: np.ndarray  # how many each mode has
    depends_on_velocity: np.ndarray  # whether beta is not 0 for all of them
    gap: np.ndarray  # alpha, beta, gamma; shape (modes, gaps, 3)
    meanings: np.ndarray  # meaning, stop, mode beyond; shape (modes, gaps, 3)
    land: np.ndarray  # position in the mode beyond, where alpha q + gamma = 0
    origin: np.ndarray  # of each mode, in the coordinates of the stops
    side: np.ndarray  # of each stop: 1 upper, -1 lower
    restitution: np.ndarray  # of each stop; -1 for a soft one, -2 where a function tells
    speed: float  # what an approach velocity is to be multiplied by for that function
    kinetic: float  # friction per mass
    static: float
    has_friction: bool
    chatter: float  # share of the greatest approach velocity below which rebounds are summed
    skip: bool  # whether a motion that can close no gap is ended in one step


class Scratch(NamedTuple):
    """Work arrays for one leg: Taylor coefficients of each component, and gaps.

    A row is the ratio, cosine and sine of the response, and of the forcing: of the angle passed
    since the start of the leg, which has more digits than the phase.
    """

    waves: np.ndarray
    series: np.ndarray
    gaps: np.ndarray  # at the start, and how long one that is closed there is certain to open


class Leg(NamedTuple):
    """The motion in one mode: free motion at the start, and what `Scratch` holds.

    Numbers rather than `Problem`, because passing arrays to the innermost functions costs more
    than these compute.
    """

    kappa: float
    delta: float
    root: float
    damping_kind: float
    rest: float
    drift: float
    rate: float
    reach: float  # bounds of the second and the third derivative of the forced response
    jerk_reach: float
    z: float
    w: float
    waves: np.ndarray
    series: np.ndarray


@inlined
def phase_of(ratio, turns, phase):
    """Ratio * (2 pi turns + phase) modulo 2 pi, without losing digits to the number of turns."""
    if ratio == 1.0:
        return phase
    product = ratio * turns
    # Dekker's exact product: what rounding took from ratio * turns.
    t = 134217729.0 * ratio
    high = t - (t - ratio)
    low = ratio - high
    t = 134217729.0 * turns
    high2 = t - (t - turns)
    low2 = turns - high2
    error = ((high * high2 - product) + high * low2 + low * high2) + low * low2
    return TURN * ((product - math.floor(product)) + error) + ratio * phase


@inlined
def given_way(delta, kappa, root, damping_kind, tau, c, s):
    """Displacement from rest under a unit force within tau, without cancellation.

    The free motions that start from 1, 0 and 0, 1 are c + delta s and s after tau.
    """
    fast = delta + root
    if fast * tau < 0.5:
        drag, pull = 2 * delta * tau, kappa * tau * tau
        term, before = tau * tau / 2, 0.0
        total = term
        for n in range(3, 18):
            after = -((n - 1) * drag * term + pull * before) * INVERSE[n] * INVERSE[n - 1]
            term, before = after, term
            total += term
        return total
    if damping_kind < 0 and 2 * root > delta:
        slow = kappa / fast
        lasts = -math.expm1(-slow * tau) / slow if slow > 0 else tau
        return (lasts + math.expm1(-fast * tau) / fast) / (2 * root)
    return (1 - c - delta * s) / kappa


@inlined
def free(leg, tau):
    """Free motion and drift (z, z') after tau, in a form without cancellation."""
    delta, root = leg.delta, leg.root
    # Overdamped: each of the two exponentials keeps its own digits.
    if leg.damping_kind < 0 and 2 * root > delta and 2 * root * tau > 1:
        fast = delta + root
        slow = leg.kappa / fast
        late, early = math.exp(-slow * tau), math.exp(-fast * tau)
        c, s = (late + early) / 2, (late - early) / (2 * root)
        lasts = (leg.w + fast * leg.z) / (2 * root) * late
        fades = (leg.w + slow * leg.z) / (2 * root) * early
        z, w = lasts - fades, fast * fades - slow * lasts
    else:
        if leg.damping_kind > 0:
            decay = math.exp(-delta * tau) if delta > 0 else 1.0
            c = decay * math.cos(root * tau)
            s = decay * math.sin(root * tau) / root
        elif leg.damping_kind < 0:
            slow = math.exp(-leg.kappa / (delta + root) * tau)
            gone = -math.expm1(-2 * root * tau)
            c = slow * (1 - gone / 2)
            s = slow * gone / (2 * root)
        else:
            c = math.exp(-delta * tau)
            s = c * tau
        z = leg.z * c + (leg.w + delta * leg.z) * s
        w = leg.w * c - (leg.kappa * leg.z + delta * leg.w) * s
    if leg.drift != 0.0:
        z += leg.drift * given_way(delta, leg.kappa, root, leg.damping_kind, tau, c, s)
        w += leg.drift * s
    return z, w


@inlined
def bound(kappa, delta, root, damping_kind, y, y1):
    """Bound on a free motion from y, y1 on: by its energy, or mode by mode."""
    if kappa == 0.0:
        return abs(y)  # asked of z'' and higher only: one decaying exponential
    most = math.sqrt(y * y + y1 * y1 / kappa)
    if damping_kind < 0:
        fast = delta + root
        slow = kappa / fast
        most = min(most, (abs(fast * y + y1) + abs(slow * y + y1)) / (2 * root))
    return most


@inlined
def bounds(leg, b, b1):
    """Bounds of |q''| and |q'''| from now on, where the free motion has z'' = b and z''' = b1."""
    b2 = -2 * leg.delta * b1 - leg.kappa * b
    most = bound(leg.kappa, leg.delta, leg.root, leg.damping_kind, b, b1) + leg.reach
    third = bound(leg.kappa, leg.delta, leg.root, leg.damping_kind, b1, b2) + leg.jerk_reach
    return most, third


@inlined
def forced(waves, tau):
    """Forced response and its first three derivatives, tau after the start of the leg."""
    x = v = a = jerk = 0.0
    for j in range(len(waves)):
        ratio = waves[j, 0]
        c, s = math.cos(ratio * tau), math.sin(ratio * tau)
        value = waves[j, 1] * c + waves[j, 2] * s
        speed = ratio * (waves[j, 2] * c - waves[j, 1] * s)
        x += value
        v += speed
        a -= ratio * ratio * value
        jerk -= ratio * ratio * speed
    return x, v, a, jerk


@kernel
def steady(p, i, turns, phase):
    """Forced response and its derivative at a phase."""
    x = v = 0.0
    for j in range(len(p.ratio)):
        angle = phase_of(p.ratio[j], turns, phase)
        c, s = math.cos(angle), math.sin(angle)
        x += p.cosine[i, j] * c + p.sine[i, j] * s
        v += p.ratio[j] * (p.sine[i, j] * c - p.cosine[i, j] * s)
    return x, v


@inlined
def push(p, clock, tau):
    """Forcing and its first two derivatives, tau after the clock."""
    f = f1 = f2 = 0.0
    for j in range(len(p.ratio)):
        ratio = p.ratio[j]
        angle = phase_of(ratio, clock[TURNS], clock[PHASE]) + ratio * tau
        c, s = math.cos(angle), math.sin(angle)
        value = p.force_cos[j] * c + p.force_sin[j] * s
        f += value
        f1 += ratio * (p.force_sin[j] * c - p.force_cos[j] * s)
        f2 -= ratio * ratio * value
    return f, f1, f2


@inlined
def begin(p, scratch, i, turns, phase, low, q, v):
    """The leg in region i that starts from q, v at that phase (and what the phase lacks).

    Its acceleration and jerk come from the equation of motion; further orders when asked for.
    """
    waves, series = scratch.waves, scratch.series
    delta, kappa = p.delta[i], p.kappa[i]
    z, w = q - p.rest[i], v
    f, f1 = p.constant[i], 0.0
    for j in range(len(waves)):
        ratio = p.ratio[j]
        angle = phase_of(ratio, turns, phase)
        c, s = math.cos(angle), math.sin(angle)
        c, s = c - s * ratio * low, s + c * ratio * low
        waves[j, 0] = ratio
        waves[j, 1] = p.cosine[i, j] * c + p.sine[i, j] * s
        waves[j, 2] = p.sine[i, j] * c - p.cosine[i, j] * s
        waves[j, 3] = p.force_cos[j] * c + p.force_sin[j] * s
        waves[j, 4] = p.force_sin[j] * c - p.force_cos[j] * s
        z -= waves[j, 1]
        w -= ratio * waves[j, 2]
        f += waves[j, 3]
        f1 += ratio * waves[j, 4]
    series[0], series[1] = q, v
    series[2] = (f - 2 * delta * v - kappa * q) / 2
    series[3] = (f1 - 4 * delta * series[2] - kappa * v) / 6
    series[COMPLETE] = 0.0
    return Leg(
        kappa,
        delta,
        p.root[i],
        p.damping_kind[i],
        p.rest[i],
        p.drift[i],
        p.rate[i],
        p.reach[i, 2],
        p.reach[i, 3],
        z,
        w,
        waves,
        series,
    )


@kernel
def complete(waves, series, delta, kappa):
    """The Taylor coefficients of q from order 4, by the equation of motion, order by order."""
    for n in range(4, ORDER + 1):
        series[n] = 0.0
    for j in range(len(waves)):
        ratio = waves[j, 0]
        scale = -ratio * ratio / 2
        term, other = scale * waves[j, 3], scale * waves[j, 4]  # f^(n) / n! and the like
        for n in range(2, ORDER - 1):
            series[n + 2] += term
            term, other = other * ratio * INVERSE[n + 1], -term * ratio * INVERSE[n + 1]
    for n in range(2, ORDER - 1):
        series[n + 2] -= 2 * delta * (n + 1) * series[n + 1] + kappa * series[n]
        series[n + 2] *= INVERSE[n + 1] * INVERSE[n + 2]
    series[COMPLETE] = 1.0


@inlined
def locate(leg, tau):
    """Position less that at the start of the leg, its three derivatives; and b, b1 for `bounds`.

    Short legs go by their Taylor series, which keeps the digits of tiny gaps; their b is nan.
    """
    if tau * leg.rate < 0.25:
        series = leg.series
        if series[COMPLETE] == 0.0:
            complete(leg.waves, series, leg.delta, leg.kappa)
        x = v = a = jerk = 0.0
        for n in range(ORDER, 2, -1):
            x = (x + series[n]) * tau
            v = v * tau + n * series[n]
            a = a * tau + n * (n - 1) * series[n]
            jerk = jerk * tau + n * (n - 1) * (n - 2) * series[n]
        x = (x + series[2]) * tau
        v = v * tau + 2 * series[2]
        a = a * tau + 2 * series[2]
        return (x + series[1]) * tau, v * tau + series[1], a, jerk, math.nan, math.nan
    x, v, a, jerk = forced(leg.waves, tau)
    z, w = free(leg, tau)
    b = leg.drift - 2 * leg.delta * w - leg.kappa * z
    b1 = -2 * leg.delta * b - leg.kappa * w
    return x + z + leg.rest - leg.series[0], v + w, a + b, jerk + b1, b, b1


@njit(nogil=True)
def phases_of(ratio, turns, phase):
    """`phase_of` for arrays."""
    out = np.empty(len(turns))
    for k in range(len(turns)):
        out[k] = phase_of(ratio, turns[k], phase[k])
    return out
