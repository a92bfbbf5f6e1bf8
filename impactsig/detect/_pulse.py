"""One pulse measured: first and last touch, peak, impulse, without assuming its shape.

The pulse is fitted, by maximum a posteriori least squares, with a quarter-sine rise, a flat top
and a quarter-sine fall, both edges raised to a common power q:

    f(t) = A sin^q(pi/2 (t - t0)/r)            t0 <= t < t0 + r
           A                                   r <= t - t0 < r + p
           A cos^q(pi/2 (t - t0 - r - p)/d)    r + p <= t - t0 < r + p + d

Half-sines, skewed and flat-topped pulses and Hertzian contacts are (nearly) members; weak priors
on length, symmetry, flatness and q keep the noise of faint pulses from being read as shape. A
pulse that clearly is no member (residual variance more than twice the noise) is measured on its
own edges: the last samples above a level, extrapolated to the baseline along the edge.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from ..impacts import OPEN_END, OPEN_START, UNRESOLVED

MAX_POINTS = 256  # a longer pulse is averaged down to at most this many points for the fit
NO_PULSE = -1  # flags of a stretch that turned out not to stand out
PARAMETERS = 6  # A, t0, ln r, ln p, ln d, ln q
SKEW_SD, FLAT_SD, FLAT_MEAN, POWER_SD = 0.3, 1.0, -2.0, 0.15
LENGTH_SD = 0.7  # of the logarithm of the edges, about the pulses the detector is matched to


class Pulse(NamedTuple):
    """What is measured of one pulse; times in samples, `start` since the start of the segment."""

    start: float
    contact: float
    peak: float
    impulse: float
    rise: float
    flags: int


@njit(cache=True, nogil=True)
def _model(p, points, x, log_edge, normal):
    """Misfit, and with the priors the cost, at `p`; J^T J and J^T e go into `normal` (6 x 7).

    Samples and amplitude are in units of the noise. Only the lower triangle of J^T J is filled.
    """
    amplitude, t0 = p[0], p[1]
    r, flat, d, q = math.exp(p[2]), math.exp(p[3]), math.exp(p[4]), math.exp(p[5])
    top, end = r + flat, r + flat + d
    rise, fall = 0.5 * math.pi / r, 0.5 * math.pi / d
    for i in range(PARAMETERS):
        for j in range(PARAMETERS + 1):
            normal[i, j] = 0.0
    misfit = 0.0
    for k in range(len(points)):
        u = points[k] - t0
        if u <= 0.0 or u >= end:
            misfit += x[k] * x[k]
        elif u < r:
            angle = rise * u
            s = max(math.sin(angle), 1e-3)
            log_s = math.log(s)
            j0 = math.exp(q * log_s)
            value = amplitude * j0
            slope = value * q * math.cos(angle) / s
            j1, j2, j5 = -slope * rise, -slope * angle, value * q * log_s
            e = x[k] - value
            misfit += e * e
            normal[0, 0] += j0 * j0
            normal[1, 0] += j1 * j0
            normal[1, 1] += j1 * j1
            normal[2, 0] += j2 * j0
            normal[2, 1] += j2 * j1
            normal[2, 2] += j2 * j2
            normal[5, 0] += j5 * j0
            normal[5, 1] += j5 * j1
            normal[5, 2] += j5 * j2
            normal[5, 5] += j5 * j5
            normal[0, 6] += j0 * e
            normal[1, 6] += j1 * e
            normal[2, 6] += j2 * e
            normal[5, 6] += j5 * e
        elif u < top:
            e = x[k] - amplitude
            misfit += e * e
            normal[0, 0] += 1.0
            normal[0, 6] += e
        else:
            angle = fall * (u - top)
            c = max(math.cos(angle), 1e-3)
            log_c = math.log(c)
            j0 = math.exp(q * log_c)
            value = amplitude * j0
            j1 = value * q * math.sin(angle) / c * fall
            j2, j3, j4, j5 = j1 * r, j1 * flat, j1 * (u - top), value * q * log_c
            e = x[k] - value
            misfit += e * e
            normal[0, 0] += j0 * j0
            normal[1, 0] += j1 * j0
            normal[1, 1] += j1 * j1
            normal[4, 0] += j4 * j0
            normal[4, 1] += j4 * j1
            normal[4, 4] += j4 * j4
            # Rows 2 and 3 are r and flat times row 1.
            normal[2, 0] += j2 * j0
            normal[2, 1] += j2 * j1
            normal[2, 2] += j2 * j2
            normal[3, 0] += j3 * j0
            normal[3, 1] += j3 * j1
            normal[3, 2] += j3 * j2
            normal[3, 3] += j3 * j3
            normal[4, 2] += j4 * j2
            normal[4, 3] += j4 * j3
            normal[5, 0] += j5 * j0
            normal[5, 1] += j5 * j1
            normal[5, 2] += j5 * j2
            normal[5, 3] += j5 * j3
            normal[5, 4] += j5 * j4
            normal[5, 5] += j5 * j5
            normal[0, 6] += j0 * e
            normal[1, 6] += j1 * e
            normal[2, 6] += j2 * e
            normal[3, 6] += j3 * e
            normal[4, 6] += j4 * e
            normal[5, 6] += j5 * e
    skew = (p[2] - p[4]) / SKEW_SD
    flatness = (p[3] - 0.5 * (p[2] + p[4]) - FLAT_MEAN) / FLAT_SD
    power = p[5] / POWER_SD
    length = (0.5 * (p[2] + p[4]) - log_edge) / LENGTH_SD
    a, b = 1.0 / SKEW_SD**2, 1.0 / FLAT_SD**2
    c = 0.25 / LENGTH_SD**2
    normal[2, 2] += a + 0.25 * b + c
    normal[4, 4] += a + 0.25 * b + c
    normal[4, 2] += -a + 0.25 * b + c
    normal[3, 3] += b
    normal[3, 2] -= 0.5 * b
    normal[4, 3] -= 0.5 * b
    normal[5, 5] += 1.0 / POWER_SD**2
    normal[2, 6] -= skew / SKEW_SD - 0.5 * flatness / FLAT_SD + 0.5 * length / LENGTH_SD
    normal[4, 6] -= -skew / SKEW_SD - 0.5 * flatness / FLAT_SD + 0.5 * length / LENGTH_SD
    normal[3, 6] -= flatness / FLAT_SD
    normal[5, 6] -= power / POWER_SD
    priors = skew * skew + flatness * flatness + power * power + length * length
    return misfit, misfit + priors


@njit(cache=True, nogil=True)
def _solve(normal, damping, step):
    """Cholesky solution of (N + damping diag N) step = g; False if it is not definite."""
    low = np.empty((PARAMETERS, PARAMETERS))
    for i in range(PARAMETERS):
        for j in range(i + 1):
            total = normal[i, j]
            if i == j:
                total = total * (1.0 + damping) + 1e-12
            for k in range(j):
                total -= low[i, k] * low[j, k]
            if i == j:
                if total <= 0.0:
                    return False
                low[i, i] = math.sqrt(total)
            else:
                low[i, j] = total / low[j, j]
    for i in range(PARAMETERS):
        total = normal[i, PARAMETERS]
        for k in range(i):
            total -= low[i, k] * step[k]
        step[i] = total / low[i, i]
    for i in range(PARAMETERS - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, PARAMETERS):
            total -= low[k, i] * step[k]
        step[i] = total / low[i, i]
    return True


@njit(cache=True, nogil=True)
def fit_pulse(points, x, log_edge, p):
    """Levenberg-Marquardt from `p`, in place; returns the residual variance over the noise's.

    x and p[0] are in units of the noise; log_edge is the logarithm of a typical edge's length.
    """
    here = np.empty((PARAMETERS, PARAMETERS + 1))
    there = np.empty((PARAMETERS, PARAMETERS + 1))
    step = np.empty(PARAMETERS)
    trial = np.empty(PARAMETERS)
    misfit, cost = _model(p, points, x, log_edge, here)
    damping = 1e-2
    for _ in range(25):
        if not _solve(here, damping, step):
            damping = 10.0 * damping + 1e-6
            continue
        for i in range(PARAMETERS):
            # Logarithms move by at most a factor of e a step, so no exponential overflows.
            trial[i] = p[i] + (step[i] if i < 2 else min(max(step[i], -1.0), 1.0))
        new_misfit, new_cost = _model(trial, points, x, log_edge, there)
        if new_cost < cost:
            gain = cost - new_cost
            for i in range(PARAMETERS):
                p[i] = trial[i]
            here, there = there, here
            misfit, cost = new_misfit, new_cost
            damping *= 0.1
            if gain < 1e-2:
                break
        else:
            damping = 10.0 * damping + 1e-6
            if damping > 1e6:
                break
    return misfit / len(points)


@njit(cache=True, nogil=True)
def _walk(x, index, step, limit, level):
    """From `index` outward to the first of two successive samples below `level`, or to `limit`."""
    while index != limit:
        if x[index] < level and (index + step == limit or x[index + step] < level):
            return index
        index += step
    return index


@njit(cache=True, nogil=True)
def _crossing(x, index, step, limit, level):
    """Where the signal first falls below `level`, going outward; linear between samples."""
    if x[index] < level:
        return float(index)
    while index != limit:
        following = index + step
        if x[following] < level:
            return index + step * (x[index] - level) / (x[index] - x[following])
        index = following
    return float(limit)


@njit(cache=True, nogil=True)
def _touch(x, top, step, limit, level):
    """Where the edge, followed outward to the last sample above `level`, comes down to zero.

    The parabola through that sample and the two before it, or their line where it does not
    reach zero; within a factor of two of the line, and not beyond the first sample that lies
    below half of `level`.
    """
    last = top
    while last != limit and x[last + step] >= level:
        last += step
    low = last
    while low != limit and x[low] >= 0.5 * level:
        low += step
    if last == limit or (top - last) * -step < 2:
        return _crossing(x, top, step, limit, level)
    x0, x1, x2 = x[last], x[last - step], x[last - 2 * step]
    drop = x0 - x[last + step]
    if drop > 2.0 * (x1 - x0):
        # A steep side, not the curve of a crest: the edge lies between two samples.
        return last + step * min(x0 / drop, 1.0)
    slope, bend = x1 - x0, x2 - 2.0 * x1 + x0
    if slope <= 0.0:
        return _crossing(x, top, step, limit, level)
    out = x0 / slope
    # x(u) = x0 - (slope - bend/2) u + bend/2 u^2, u samples outward from the last.
    linear = slope - 0.5 * bend
    square = linear * linear - 2.0 * bend * x0
    if square >= 0.0 and linear > 0.0:
        out = min(max(2.0 * x0 / (linear + math.sqrt(square)), 0.5 * out), 2.0 * out)
    touch = last + step * out
    return max(touch, float(low)) if step < 0 else min(touch, float(low))


@njit(cache=True, nogil=True)
def _least(x, a, b):
    least = x[a]
    for i in range(a, b):
        least = min(least, x[i])
    return least


@njit(cache=True, nogil=True)
def _crest(x, top, sigma):
    """Height of the crest at sample `top`, by a parabola, and where it lies between samples.

    The sample itself where it does not stand out: at a plateau's edge a parabola would overshoot.
    """
    if not 0 < top < len(x) - 1 or x[top] - max(x[top - 1], x[top + 1]) <= 4.0 * sigma:
        return x[top], 0.0
    difference = x[top - 1] - x[top + 1]
    shift = 0.5 * difference / (x[top - 1] - 2.0 * x[top] + x[top + 1])
    return x[top] - 0.25 * difference * shift, shift


@njit(cache=True, nogil=True)
def _valley(x, a, b):
    """Index of the least three-sample mean strictly between a < b."""
    best = a + 1
    least = np.inf
    for i in range(a + 1, b):
        mean = x[i - 1] + x[i] + x[i + 1]
        if mean < least:
            least, best = mean, i
    return best


@njit(cache=True, nogil=True)
def _remove_baseline(x, a, b, c, d, sigma, height, at_top):
    """Subtract from x, in place, the line through x[a:b] and x[c:d] (a level where one is empty).

    Returns its value at index `at_top`.

    Where the sides scatter far more than noise does (ringing, a neighbour), their median is used.
    """
    left, right = max(b - a, 0), max(d - c, 0)
    count = left + right
    if count < 4:
        return 0.0
    side = np.empty(count)
    at = np.empty(count)
    for i in range(left):
        side[i], at[i] = x[a + i], a + i
    for i in range(right):
        side[left + i], at[left + i] = x[c + i], c + i
    mean = centre = cross = square = scatter = slope = 0.0
    for i in range(count):
        mean += side[i] / count
        centre += at[i] / count
    if left >= 4 and right >= 4:
        for i in range(count):
            cross += (at[i] - centre) * (side[i] - mean)
            square += (at[i] - centre) ** 2
        slope = cross / square
    for i in range(count):
        scatter += (side[i] - mean - slope * (at[i] - centre)) ** 2
    scatter = math.sqrt(scatter / count)
    if scatter > max(2.0 * sigma, 0.05 * height):
        mean, slope = np.median(side), 0.0
    for i in range(len(x)):
        x[i] -= mean + slope * (i - centre)
    return mean + slope * (at_top - centre)


@njit(cache=True, nogil=True)
def measure_reach(width):
    """How many samples to either side of its peak the measurement of a pulse looks at."""
    return 12 * width + 16


@njit(cache=True, nogil=True)
def measure_pulse(signal, origin, total, sign, peak, base, before, after, width, sigma, level):
    """Measure the pulse around `peak`.

    Parameters
    ----------
    signal : 1-D array
        The samples from `origin` on of a segment of `total` samples, or as many as may matter.
    origin, total : int
        Place of signal[0] in the segment, and the length of the segment.
    sign : float
        1 or -1: direction of the pulses.
    peak, before, after : int
        Place in the segment of this pulse's peak, and of its neighbours' (-1 and `total` if
        there is none).
    base : float
        First guess of the baseline, times sign.
    width : int
        Typical width of a pulse in samples.
    sigma : float
        Standard deviation of the noise.
    level : float
        Level above the baseline that the contact time refers to; 0 for the touch itself.
    """
    reach = measure_reach(width)
    lo, hi = max(0, peak - reach), min(total, peak + reach + 1)
    x = np.empty(hi - lo)
    for i in range(hi - lo):
        x[i] = sign * signal[lo - origin + i]
    end = len(x) - 1
    top = peak - lo
    # Not past half-way to a neighbour: one crest is never measured twice.
    first_top = max(0, top - width, (before + peak) // 2 + 1 - lo)
    last_top = min(end, top + width, (peak + after) // 2 - lo)
    for i in range(first_top, last_top + 1):
        if x[i] > x[top]:
            top = i
    crest = x[top]
    if crest - base < 12.0 * sigma:
        # The greatest sample of a faint pulse is noise's choice; the response knows the middle.
        top = peak - lo
        count = 0
        crest = 0.0
        for i in range(max(0, top - width // 4), min(end, top + width // 4) + 1):
            crest += x[i]
            count += 1
        crest /= count
    height = crest - base
    # A stretch beside a pulse of the other sign has a low flank, but does not stand out.
    foot = -np.inf
    if top >= width:
        foot = _least(x, 0, top)
    if end - top >= width:
        foot = max(foot, _least(x, top + 1, end + 1))
    if crest - foot < 0.4 * height:
        return Pulse(0.0, 0.0, 0.0, 0.0, 0.0, NO_PULSE)
    stop = base + max(0.1 * height, min(2.0 * sigma, 0.5 * height))
    left_limit = _valley(x, before - lo, top) if before >= lo and before - lo + 1 < top else 0
    right_limit = _valley(x, top, after - lo) if after < hi and top + 1 < after - lo else end
    left = _walk(x, top, -1, left_limit, stop)
    right = _walk(x, top, 1, right_limit, stop)
    flags = 0
    for index, limit in ((left, left_limit), (right, right_limit)):
        if index != limit:
            continue
        if lo + index == 0:
            flags |= OPEN_START if x[index] >= stop else 0
        elif lo + index == total - 1:
            flags |= OPEN_END if x[index] >= stop else 0
        elif x[index] > base + 0.25 * height:
            flags |= UNRESOLVED
    left = max(min(left, top - (width + 1) // 2), left_limit)
    right = min(max(right, top + (width + 1) // 2), right_limit)
    margin = 2 + (right - left) // 4
    extent = 4 * (right - left)
    clear_left = max(0, left - margin - extent, before - lo + 2 * width if before >= lo else 0)
    clear_right = min(
        end + 1, right + margin + 1 + extent, after - lo - 2 * width if after < hi else end + 1
    )
    for i in range(len(x)):
        x[i] -= base
    shift = _remove_baseline(
        x, clear_left, left - margin, right + margin + 1, clear_right, sigma, height, top
    )
    height -= shift
    if height <= 0.0:
        return Pulse(0.0, 0.0, 0.0, 0.0, 0.0, NO_PULSE)

    pad = max(3, (right - left) // 2)
    a, b = max(left_limit, left - pad), min(right_limit, right + pad) + 1
    fits, unit = False, 0.0
    p = np.empty(PARAMETERS)
    if flags == 0:
        per = (b - a + MAX_POINTS - 1) // MAX_POINTS
        count = (b - a) // per
        points, means = np.empty(count), np.empty(count)
        # Noise of the averaged samples; a thousandth of the peak stands for a silent record's. A
        # few samples fit many shapes exactly: a hundredth leaves the choice to the priors.
        unit = max(sigma / math.sqrt(per), (1e-2 if width < 8 else 1e-3) * height)
        for k in range(count):
            points[k] = a + k * per + 0.5 * (per - 1)
            total_k = 0.0
            for i in range(a + k * per, a + (k + 1) * per):
                total_k += x[i]
            means[k] = total_k / (per * unit)
        # A quarter-sine is at 0.2 and 0.8 of its height after 0.128 and 0.590 of its length.
        # A faint pulse has no crossings to trust; it starts from the matched width.
        start, rise, fall, flat = top - 0.675 * width, 0.6 * width, 0.6 * width, 0.14 * width
        if height > 12.0 * sigma:
            early = _crossing(x, top, -1, a, 0.2 * height)
            late = _crossing(x, top, 1, b - 1, 0.2 * height)
            rise = max((_crossing(x, top, -1, a, 0.8 * height) - early) / 0.462, 0.5)
            fall = max((late - _crossing(x, top, 1, b - 1, 0.8 * height)) / 0.462, 0.5)
            start = early - 0.128 * rise
            flat = max(late + 0.128 * fall - start - rise - fall, 0.1 * (rise + fall))
        p[0] = height / unit
        p[1] = start
        p[2], p[3], p[4] = math.log(rise), math.log(flat), math.log(fall)
        p[5] = 0.0
        misfit = fit_pulse(points, means, math.log(0.6 * width), p)
        length = math.exp(p[2]) + math.exp(p[3]) + math.exp(p[4])
        # An edge beyond the valley to a neighbour would be read from the neighbour's samples.
        left_most = left_limit - 1.0 if a == left_limit else a - pad
        right_most = right_limit + 1.0 if b == right_limit + 1 else b + pad
        inside = p[1] > left_most and p[1] + length < right_most
        # What does not fit a faint pulse is not its shape, and its edges tell even less.
        faint = height < 8.0 * sigma
        fits = (misfit < 2.0 or faint) and p[0] > 0.0 and inside
    crest, shift = _crest(x, top, sigma)
    if fits:
        start, contact = p[1], length
        rise = math.exp(p[2]) + 0.5 * math.exp(p[3])
        if unit <= sigma:
            crest = p[0] * unit  # less noisy than the greatest sample
    else:
        edge = max(0.02 * height, min(3.0 * sigma, 0.25 * height))
        start = _touch(x, top, -1, left_limit, edge)
        contact = _touch(x, top, 1, right_limit, edge) - start
        rise = top + shift - start
    start, contact = max(start, 0.0), contact + min(start, 0.0)
    contact = min(contact, end - start)
    impulse = _integral(x, start, start + contact)
    if contact <= 0.0 or crest <= 0.0 or impulse <= 0.0:
        return Pulse(0.0, 0.0, 0.0, 0.0, 0.0, NO_PULSE)
    rise = min(max(rise, 0.0), contact)
    if level > 0.0:
        contact = 0.0
        if height > level:
            contact = _crossing(x, top, 1, right_limit, level)
            contact -= _crossing(x, top, -1, left_limit, level)
    return Pulse(lo + start, contact, crest, impulse, rise, flags)


@njit(cache=True, nogil=True)
def _integral(x, a, b):
    """Integral of x from a to b, in samples.

    Cubic between samples where the four around a cell lie inside [a, b], linear at the ends.
    """
    total = 0.0
    for i in range(int(a), min(int(b) + 1, len(x) - 1)):
        u, v = max(a - i, 0.0), min(b - i, 1.0)
        if a <= i - 1 and i + 2 <= b:
            total += (13.0 * (x[i] + x[i + 1]) - x[i - 1] - x[i + 2]) / 24.0
        elif v > u:
            total += (v - u) * (x[i] + 0.5 * (u + v) * (x[i + 1] - x[i]))
    return total


@njit(cache=True, nogil=True)
def measure_all(signal, origin, total, candidates, span, sign, width, level, limit, out):
    """Measure the candidates first ... last - 1 of `span` into rows of `out`.

    A candidate is its peak's index, its flanks' mean, its response, the noise there. A row holds
    the fields of Pulse, then 1 if the pulse is clipped.

    `limit` is the greatest value of the record (times sign): three samples in a row at it are
    called clipped.
    """
    reach = measure_reach(width)
    first, last = span
    for k in range(first, last):
        peak = int(candidates[k, 0])
        before = int(candidates[k - 1, 0]) if k > 0 else -1
        after = int(candidates[k + 1, 0]) if k + 1 < len(candidates) else total
        pulse = measure_pulse(
            signal,
            origin,
            total,
            sign,
            peak,
            candidates[k, 1],
            before,
            after,
            width,
            candidates[k, 3],
            level,
        )
        row = k - first
        out[row, 0], out[row, 1], out[row, 2] = pulse.start, pulse.contact, pulse.peak
        out[row, 3], out[row, 4], out[row, 5] = pulse.impulse, pulse.rise, pulse.flags
        run = longest = 0
        for i in range(max(0, peak - reach), min(total, peak + reach + 1)):
            run = run + 1 if sign * signal[i - origin] >= limit else 0
            longest = max(longest, run)
        out[row, 6] = 1.0 if longest >= 3 else 0.0
