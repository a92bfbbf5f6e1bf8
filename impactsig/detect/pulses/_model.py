"""Parametric family of pulse shapes, and its least-squares fit.

With u the time since the start, r, p and d the lengths of rise, flat top and fall,

    v = min(u/r, 1, (r + p + d - u)/d),    w = c v / (1 + (c - 1) v),    f = A sin^q(pi/2 w)

where v >= 0. The parameters are A, the start, ln r/d, ln p/m, the logarithm of q and ln m with
m = sqrt(r d); on each of the last four a weak prior keeps the noise of faint pulses from being read
as shape. Rise and fall may have powers q e^h and q e^-h; then, with

    g = (h - ln r/d) / (2 (1 + p/m)),    c = e^g / cosh^5 g on the rise, e^-g / cosh^5 g on the fall

the crest is smooth, since both sides have one curvature, and pulses of contacts that lose energy,
which rise steeply and fall softly, are nearly members, too. So are half-sines, skewed and
flat-topped pulses and Hertzian contacts.
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
VALUE, BY_START, BY_POWER, BY_WARP, REST, _SINE, _LOG, _STEEP = range(8)
CURVE = 8
"""Rows of what is known at each point: f over A, its derivatives by the start, by ln q and by g,
what the fit leaves, and what these are made of."""
BEND, WARPED = 5.0, 1.2
"""Power of the hyperbolic cosine, and the greatest g: beyond it a fall is nearly all foot."""


class Parts(NamedTuple):
    """Durations of rise, flat top and fall of a pulse."""

    rise: float
    flat: float
    fall: float


class Warp(NamedTuple):
    """The c of rise and fall, derivatives of their logarithms by g, and those of g.

    By ln r/d, by ln p/m and by h.
    """

    early: float
    late: float
    early_slope: float
    late_slope: float
    by_skew: float
    by_flat: float
    by_powers: float


class Inside(NamedTuple):
    """Range of the points within a pulse: from `first`, with the fall from `fall` on, to `last`."""

    first: int
    fall: int
    last: int


class _Sums(NamedTuple):
    """Sums over an edge of f/A, its slope, that times u, by ln q (p) and by g (w), and the rest."""

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
    fw: float
    sw: float
    tw: float
    pw: float
    ww: float
    we: float


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
def warp_of(p, apart):
    """How the edges of a pulse are warped; `apart` is h."""
    brief = 1.0 / (1.0 + math.exp(p[FLAT]))
    g = 0.5 * brief * (apart - p[SKEW])
    free = 0.5 * brief if abs(g) < WARPED else 0.0
    g = min(max(g, -WARPED), WARPED)
    both, lean = math.cosh(g) ** -BEND, BEND * math.tanh(g)
    by_flat = (brief - 1.0) * g if free > 0.0 else 0.0
    return Warp(
        both * math.exp(g), both * math.exp(-g), 1.0 - lean, -1.0 - lean, -free, by_flat, free
    )


@kernel
def pulse_cost(p, points, x, log_edge, curve, normal):
    """Misfit and cost with priors at `p`; writes the normal equations into `normal`."""
    misfit = linearize(p, 0.0, points, x, curve, normal)
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
def linearize(p, apart, points, x, curve, normal):
    """Misfit of the model at `p`; its `curve`, and into `normal` (7 x 8) J^T J and J^T e.

    Of J^T J, the lower triangle. Points lie at equal distances; x and the amplitude are in units of
    the noise. `apart` is what POWERS is, which `p` of a fit lacks.
    """
    parts = parts_of(p)
    per, count = points[1] - points[0], len(points)
    first, fall, last = inside(p, parts, points)
    warp = warp_of(p, apart)
    draw(p, apart, warp, parts, points[0] + first * per - p[START], per, last - first, curve)
    misfit = 0.0
    for k in range(first):
        misfit += x[k] * x[k]
    for k in range(last, count):
        misfit += x[k] * x[k]
    for k in range(last - first):
        e = x[first + k] - p[AMPLITUDE] * curve[VALUE, k]
        curve[REST, k] = e
        misfit += e * e
    put_products(p, warp, parts, points, first, fall, last, curve, normal)
    return misfit


@kernel
def put_products(p, warp, parts, points, first, fall, last, curve, normal):
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
    # Skew, flat top and powers turn the warp, too.
    w0, w1, w4, w5 = r.fw + d.fw, r.sw + d.sw, r.pw + d.pw, r.tw + d.tw
    w2, w3 = 0.5 * r.tw + a * d.sw - 0.5 * d.tw, flat * d.sw
    w6, ww, we = r.pw - d.pw, r.ww + d.ww, r.we + d.we
    s, f, h = warp.by_skew, warp.by_flat, warp.by_powers
    n[2, 0] += s * w0
    n[2, 1] += s * w1
    n[2, 2] += s * (2.0 * w2 + s * ww)
    n[3, 0] += f * w0
    n[3, 1] += f * w1
    n[3, 2] += f * w2 + s * w3 + s * f * ww
    n[3, 3] += f * (2.0 * w3 + f * ww)
    n[4, 2] += s * w4
    n[4, 3] += f * w4
    n[5, 2] += s * w5
    n[5, 3] += f * w5
    n[6, 0] += h * w0
    n[6, 1] += h * w1
    n[6, 2] += h * w2 + s * w6 + s * h * ww
    n[6, 3] += h * w3 + f * w6 + f * h * ww
    n[6, 4] += h * w4
    n[6, 5] += h * w5
    n[6, 6] += h * (2.0 * w6 + h * ww)
    n[2, 7] += s * we
    n[3, 7] += f * we
    n[6, 7] += h * we


@kernel
def _reached(at, per, count):
    """Index of the first point at or beyond a place."""
    return int(min(max(math.ceil(at / per), 0.0), float(count)))


@kernel
def draw(p, apart, warp, parts, u, per, count, curve):
    """Fill the curve at `count` points from u on, by loops without calls, which run in lanes.

    Sine and power by their series, to 1e-11 and, for q < 2, to 1e-8 of the height. `apart` is what
    POWERS is.
    """
    up, down = 1.0 / parts.rise, 1.0 / parts.fall
    end = parts.rise + parts.flat + parts.fall
    middle = parts.rise + 0.5 * parts.flat
    early, late = math.exp(p[POWER] + apart), math.exp(p[POWER] - apart)
    by_early, by_late = p[AMPLITUDE] * early, p[AMPLITUDE] * late
    n = LANES * ((count + LANES - 1) // LANES)
    for k in range(n):
        at = u + k * per
        v = min(max(min(up * at, down * (end - at)), 0.0), 1.0)
        c = warp.early if at < middle else warp.late
        v *= c / (1.0 + (c - 1.0) * v)
        curve[BY_WARP, k] = v
        angle = 0.5 * math.pi * v
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
        q = early if u + k * per < middle else late
        z = max((q - 1.0) * curve[_LOG, k], -16.0) * 0.125
        y = 1.0 + z * (1 / 5) * (1.0 + z * (1 / 6) * (1.0 + z * (1 / 7) * (1.0 + z * (1 / 8))))
        y = 1.0 + z * (1.0 + z * (1 / 2) * (1.0 + z * (1 / 3) * (1.0 + z * (1 / 4) * y)))
        y *= y
        y *= y
        curve[_STEEP, k] = y * y
    for k in range(n):
        curve[VALUE, k] = curve[_SINE, k] * curve[_STEEP, k]
    for k in range(n):
        height = by_early if u + k * per < middle else by_late
        curve[BY_POWER, k] = height * curve[VALUE, k] * curve[_LOG, k]
    pace, back = up * by_early / warp.early, -down * by_late / warp.late
    turn, turn_back = by_early * warp.early_slope, by_late * warp.late_slope
    for k in range(n):
        rises = u + k * per < middle
        v, c = curve[BY_WARP, k], warp.early if rises else warp.late
        # A root is quicker than another series; the angle is at most a right one.
        slope = math.sqrt(max(1.0 - curve[_SINE, k] * curve[_SINE, k], 0.0))
        slope *= 0.5 * math.pi * curve[_STEEP, k]
        stretched = c + (1.0 - c) * v
        curve[BY_START, k] = (-pace if rises else -back) * stretched * stretched * slope
        curve[BY_WARP, k] = (turn if rises else turn_back) * v * (1.0 - v) * slope


@kernel
def _sums(points, start, first, last, origin, curve):
    """Sums over the points of an edge; the curve begins at point `origin`."""
    ff = fs = ft = fp = ss = st = sp = tt = tp = pp = fe = se = te = pe = 0.0
    fw = sw = tw = pw = ww = we = 0.0
    for k in range(first, last):
        f, s = curve[VALUE, k - origin], curve[BY_START, k - origin]
        p, e = curve[BY_POWER, k - origin], curve[REST, k - origin]
        t, w = s * (points[k] - start), curve[BY_WARP, k - origin]
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
        fw += f * w
        sw += s * w
        tw += t * w
        pw += p * w
        ww += w * w
        we += w * e
    return _Sums(ff, fs, ft, fp, ss, st, sp, tt, tp, pp, fe, se, te, pe, fw, sw, tw, pw, ww, we)
