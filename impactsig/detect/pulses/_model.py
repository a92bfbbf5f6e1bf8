"""Parametric family of pulse shapes, and its least-squares fit.

With u the time since the start, r, p and d the lengths of rise, flat top and fall, and the angle

    phi = min(pi/2 u/r, pi/2, pi/2 (r + p + d - u)/d),        f = A sin^q(phi)    0 <= phi.

Half-sines, skewed and flat-topped pulses and Hertzian contacts are (nearly) members. The
parameters are A, the start, ln r/d, ln p/m, ln q and ln m with m = sqrt(r d); on each of the last
four a weak prior keeps the noise of faint pulses from being read as shape.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel

AMPLITUDE, START, SKEW, FLAT, POWER, LENGTH, POWERS = range(7)
PARAMETERS = 6
WIDER = 7  # with POWERS, half the difference of the logarithms of the edges' powers, 0 in the fit
SKEW_SD, FLAT_SD, FLAT_MEAN, POWER_SD = 0.3, 1.0, -2.0, 0.15
LENGTH_SD = 0.7  # of the logarithm of the edges, about the pulses the detector is matched to
STEEPEST = 1e-3  # of the height: at the foot of an edge of q < 1 the slope has no bound
MAX_POINTS = 256  # a longer pulse is averaged down to at most this many points for the fit
LANES = 8  # points at a time: a loop over the rest would take as long as one over all
VALUE, BY_START, BY_POWER, REST, _SINE, _LOG, _STEEP = range(7)
CURVE = 7
"""Rows of what is known at each point: f over A, its derivatives by the start and by ln q, what
the fit leaves, and what these are made of."""


class Parts(NamedTuple):
    """Durations of rise, flat top and fall of a pulse."""

    rise: float
    flat: float
    fall: float


class Inside(NamedTuple):
    """Range of the points within a pulse: from `first`, with the fall from `fall` on, to `last`."""

    first: int
    fall: int
    last: int


class _Sums(NamedTuple):
    """Sums over the points of an edge: of f/A, its slope, that times u, by ln q, and the rest."""

    ff: float
    fs: float
    ft: float
    fp: float
    ss: float
    st: float
    sp: float
    tt: float
    tp: float
    pp: float
    fe: float
    se: float
    te: float
    pe: float


@allocating
def room_for(points):
    """Allocate the curve for so many points."""
    return np.zeros((CURVE, points + LANES))


@kernel
def put_parameters(height, start, rise, flat, fall, p):
    """Write the parameters of a pulse with edges of q = 1 into `p`."""
    middle = 0.5 * (math.log(rise) + math.log(fall))
    p[AMPLITUDE], p[START], p[SKEW] = height, start, math.log(rise / fall)
    p[FLAT], p[POWER], p[LENGTH] = math.log(flat) - middle, 0.0, middle


@kernel
def parts_of(p):
    """Durations of the parts of a pulse."""
    middle, skew = math.exp(p[LENGTH]), math.exp(0.5 * p[SKEW])
    return Parts(middle * skew, middle * math.exp(p[FLAT]), middle / skew)


@kernel
def pulse_cost(p, points, x, log_edge, curve, normal):
    """Misfit and cost with priors at `p`; writes the normal equations into `normal`."""
    misfit = linearize(p, points, x, curve, normal)
    return misfit, misfit + add_priors(p, log_edge, 1.0, normal)


@kernel
def add_priors(p, log_edge, times, normal):
    """Add the priors to the normal equations at `p`; returns their cost."""
    skew, flatness = p[SKEW] / SKEW_SD, (p[FLAT] - FLAT_MEAN) / FLAT_SD
    power, length = p[POWER] / POWER_SD, (p[LENGTH] - log_edge) / LENGTH_SD
    normal[SKEW, SKEW] += times / SKEW_SD**2
    normal[FLAT, FLAT] += times / FLAT_SD**2
    normal[POWER, POWER] += times / POWER_SD**2
    normal[LENGTH, LENGTH] += times / LENGTH_SD**2
    normal[SKEW, WIDER] -= times * skew / SKEW_SD
    normal[FLAT, WIDER] -= times * flatness / FLAT_SD
    normal[POWER, WIDER] -= times * power / POWER_SD
    normal[LENGTH, WIDER] -= times * length / LENGTH_SD
    return skew * skew + flatness * flatness + power * power + length * length


@kernel
def inside(p, parts, points):
    """The points that lie in the pulse of parameters `p`."""
    per, before = points[1] - points[0], p[START] - points[0]
    top = parts.rise + parts.flat
    return Inside(
        _reached(before, per, len(points)),
        _reached(before + top, per, len(points)),
        _reached(before + top + parts.fall, per, len(points)),
    )


@kernel
def linearize(p, points, x, curve, normal):
    """Misfit of the model at `p`; its `curve`, and into `normal` (7 x 8) J^T J and J^T e.

    Of J^T J, the lower triangle. Points lie at equal distances; x and the amplitude are in units of
    the noise.
    """
    parts = parts_of(p)
    per, count = points[1] - points[0], len(points)
    first, fall, last = inside(p, parts, points)
    draw(p, parts, points[0] + first * per - p[START], per, last - first, curve)
    misfit = 0.0
    for k in range(first):
        misfit += x[k] * x[k]
    for k in range(last, count):
        misfit += x[k] * x[k]
    for k in range(last - first):
        e = x[first + k] - p[AMPLITUDE] * curve[VALUE, k]
        curve[REST, k] = e
        misfit += e * e
    put_products(p, parts, points, first, fall, last, curve, normal)
    return misfit


@kernel
def put_products(p, parts, points, first, fall, last, curve, normal):
    """Put J^T J and J^T e of a curve that begins at point `first` into `normal`."""
    top = parts.rise + parts.flat
    r = _sums(points, p[START], first, fall, first, curve)
    d = _sums(points, p[START], fall, last, first, curve)
    # By the skew, the fall moves with part of the rise's end, and shrinks. By the flat top, which
    # counts as part of the rise, it moves.
    a, flat = 0.5 * (parts.rise + top), parts.flat
    n = normal
    n[0, 0] = r.ff + d.ff
    n[1, 0], n[1, 1] = r.fs + d.fs, r.ss + d.ss
    n[2, 0], n[2, 1] = 0.5 * r.ft + a * d.fs - 0.5 * d.ft, 0.5 * r.st + a * d.ss - 0.5 * d.st
    n[2, 2] = 0.25 * r.tt + a * (a * d.ss - d.st) + 0.25 * d.tt
    n[3, 0], n[3, 1] = flat * d.fs, flat * d.ss
    n[3, 2], n[3, 3] = flat * (a * d.ss - 0.5 * d.st), flat * flat * d.ss
    n[4, 0], n[4, 1] = r.fp + d.fp, r.sp + d.sp
    n[4, 2], n[4, 3] = 0.5 * r.tp + a * d.sp - 0.5 * d.tp, flat * d.sp
    n[4, 4] = r.pp + d.pp
    n[5, 0], n[5, 1] = r.ft + d.ft, r.st + d.st
    n[5, 2], n[5, 3] = 0.5 * r.tt + a * d.st - 0.5 * d.tt, flat * d.st
    n[5, 4], n[5, 5] = r.tp + d.tp, r.tt + d.tt
    n[6, 0], n[6, 1] = r.fp - d.fp, r.sp - d.sp
    n[6, 2], n[6, 3] = 0.5 * r.tp - a * d.sp + 0.5 * d.tp, -flat * d.sp
    n[6, 4], n[6, 5], n[6, 6] = r.pp - d.pp, r.tp - d.tp, r.pp + d.pp
    n[0, 7], n[1, 7] = r.fe + d.fe, r.se + d.se
    n[2, 7], n[3, 7] = 0.5 * r.te + a * d.se - 0.5 * d.te, flat * d.se
    n[4, 7], n[5, 7], n[6, 7] = r.pe + d.pe, r.te + d.te, r.pe - d.pe


@kernel
def _reached(at, per, count):
    """Index of the first point at or beyond a place."""
    return int(min(max(math.ceil(at / per), 0.0), float(count)))


@kernel
def draw(p, parts, u, per, count, curve):
    """Fill the curve at `count` points from u on, by loops without calls, which run in lanes.

    Sine and power by their series, to 1e-11 and, for q < 2, to 1e-8 of the height.
    """
    up, down = 0.5 * math.pi / parts.rise, 0.5 * math.pi / parts.fall
    end = parts.rise + parts.flat + parts.fall
    q = math.exp(p[POWER])
    height = p[AMPLITUDE] * q
    n = LANES * ((count + LANES - 1) // LANES)
    for k in range(n):
        at = u + k * per
        angle = min(max(min(up * at, down * (end - at)), 0.0), 0.5 * math.pi)
        z = -angle * angle
        y = 1.0 + z * (1 / 110) * (1.0 + z * (1 / 156) * (1.0 + z * (1 / 210)))
        y = 1.0 + z * (1 / 6) * (
            1.0 + z * (1 / 20) * (1.0 + z * (1 / 42) * (1.0 + z * (1 / 72) * y))
        )
        curve[_SINE, k] = max(angle * y, STEEPEST)
    for k in range(n):
        # Of a sine above STEEPEST: the series of the logarithm of its sixteenth root, to 5e-9.
        root = math.sqrt(math.sqrt(math.sqrt(math.sqrt(curve[_SINE, k]))))
        w = (root - 1.0) / (root + 1.0)
        z = w * w
        y = 1.0 + z * (3 / 5) * (1.0 + z * (5 / 7) * (1.0 + z * (7 / 9) * (1.0 + z * (9 / 11))))
        curve[_LOG, k] = 32.0 * w * (1.0 + z * (1 / 3) * y)
    for k in range(n):
        # sin^(q - 1), as the eighth power of a series.
        z = max((q - 1.0) * curve[_LOG, k], -16.0) * 0.125
        y = 1.0 + z * (1 / 5) * (1.0 + z * (1 / 6) * (1.0 + z * (1 / 7) * (1.0 + z * (1 / 8))))
        y = 1.0 + z * (1.0 + z * (1 / 2) * (1.0 + z * (1 / 3) * (1.0 + z * (1 / 4) * y)))
        y *= y
        y *= y
        curve[_STEEP, k] = y * y
    for k in range(n):
        curve[VALUE, k] = curve[_SINE, k] * curve[_STEEP, k]
    for k in range(n):
        curve[BY_POWER, k] = height * curve[VALUE, k] * curve[_LOG, k]
    for k in range(n):
        at = u + k * per
        pace = up if up * at < down * (end - at) else -down
        # A root is quicker than another series; the angle is at most a right one.
        curve[BY_START, k] = (
            -pace
            * height
            * curve[_STEEP, k]
            * math.sqrt(max(1.0 - curve[_SINE, k] * curve[_SINE, k], 0.0))
        )


@kernel
def _sums(points, start, first, last, origin, curve):
    """Sums over the points of an edge; the curve begins at point `origin`."""
    ff = fs = ft = fp = ss = st = sp = tt = tp = pp = fe = se = te = pe = 0.0
    for k in range(first, last):
        f, s = curve[VALUE, k - origin], curve[BY_START, k - origin]
        p, e = curve[BY_POWER, k - origin], curve[REST, k - origin]
        t = s * (points[k] - start)
        ff += f * f
        fs += f * s
        ft += f * t
        fp += f * p
        ss += s * s
        st += s * t
        sp += s * p
        tt += t * t
        tp += t * p
        pp += p * p
        fe += f * e
        se += s * e
        te += t * e
        pe += p * e
    return _Sums(ff, fs, ft, fp, ss, st, sp, tt, tp, pp, fe, se, te, pe)
