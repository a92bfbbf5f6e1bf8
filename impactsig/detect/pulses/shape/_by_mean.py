"""Pulses measured with their mean pulse, where no shape of the family is near them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ..edges import ERRORS, FIT, NO_PULSE, SHARED, SHARED_PEAK
from ..fit_errors import LEVEL, NOISE, ZERO
from ._ends import LEVELS, read_end
from ._laying import fit_to, lay, lay_clear, place_faint
from ._mean_pulse import (
    AMPLITUDE,
    FIRST,
    HIGH,
    LAST,
    LOW,
    MISFIT,
    ONE,
    PLACE,
    SIGMA,
    WIDTH,
    edge_of,
    height_at,
)

FARTHEST, NOISY = 0.7, 2.0
"""Of what the family leaves, root mean square, and standard errors of that: where more is left than
both allow, pulses do not share their mean."""
STEP = 0.3
"""Of the height, from one knot to the next: a jump."""
TURNS, SIGNIFICANT = 6, 4.0
"""Steps of faint pulses; standard errors of a knot that is no noise."""
FARTHER, TAIL, LONGER = 0.3, 0.9, 0.4
"""Of the way from where an edge is seen to where it is taken to begin, that it may be off, in full
where that way is TAIL + LONGER times that from there to the highest of LEVELS, and from TAIL on."""
SAMPLE = 0.29
"""Standard deviation of a place somewhere between two samples."""
BESIDE, BEHIND, HIGHEST, ROUND = 3.0, 8, 1.5, 0.5
"""Knots beside a jump that overshoot, those behind them that tell how high it is, logarithm of how
much higher it may be than these, and share of that by which it is uncertain.
"""
STEEP, SHORT = 1.5, 0.05
"""Samples, and share of the length, from the lowest of LEVELS to the highest: where both edges have
less, little but a flat top is there to be laid on each other, and its corners overshoot between
knots. Edges of the family or of single pulses say more.
"""
AS_HIGH, AS_LONG = 4.0, 4.0
"""Times as high, or as low, as the pulse that was found, one that is measured may be; and times as
long as those found their mean pulse may be: that of pulses and crests of noise together is longer.
"""


class Whole(NamedTuple):
    """What the mean pulse tells of all pulses; times are in widths, from the first crossing.

    Variances are over the squares of these, of the peak or of the area; those of a jump at the
    start or of a drop at the end, which lie between two samples, are in samples. `both` is that of
    the length: feet that end below the noise both begin farther out than is seen, or both nearer.
    """

    start: float
    end: float
    top: float
    start_variance: float
    end_variance: float
    both: float
    jump: float
    drop: float
    crest: float
    peak: float
    area: float
    tail: float


@allocating
def share_mean(rows, x, origin, timed, left):
    """Measure pulses by their mean pulse, in place; whether they have one.

    Parameters
    ----------
    rows, x, origin, timed
        As `share_shape` takes them.
    left : float
        Mean square of what the family leaves, over that of the heights.
    """
    possible, clear, mean, about, spread = lay_clear(rows, x, origin)
    if not possible or not _is_like(clear, mean, left):
        return False
    crest, top, sharp = _crest(mean, about, LOW, HIGH)
    if crest <= 0.0:
        return False
    start, start_variance, begun, steep = _end(clear, rows, x, origin, mean, 1.0, crest)
    end, end_variance, done, gentle = _end(clear, rows, x, origin, mean, -1.0, crest)
    end, done = -end, -done
    if not (LOW < start < end and start_variance + end_variance < np.inf):
        return False
    if (end - start) * math.exp(about) > AS_LONG * _usual_contact(clear, rows):
        return False
    if max(steep, gentle) < max(STEEP * math.exp(-about), SHORT * (end - start)):
        return False
    top = min(max(top, start), end)
    for b in range(len(mean.heights)):
        v = LOW + b * mean.apart
        if v < start or v > end:
            mean.heights[b] = 0.0
    early, late = _of_tail(begun - start, steep), _of_tail(end - done, gentle)
    start_variance += early**2
    end_variance += late**2
    # A jump lies between two samples; of all pulses alike, and of each.
    width = math.exp(about)
    jump = _jump(steep, mean.apart, width)
    drop = _jump(gentle, mean.apart, width)
    if jump > 0.0 or drop > 0.0:
        crest, top, sharp = _crest_beside(
            mean, about, begun + steep, done - gentle, jump > 0.0, drop > 0.0, top
        )
    area = 0.0
    for b in range(len(mean.heights)):
        area += mean.heights[b] * mean.apart
    if not area > 0.0:
        return False
    tail = math.hypot(
        _cut_off(begun - start, steep, start_variance, height_at(begun, mean), mean.apart),
        _cut_off(end - done, gentle, end_variance, height_at(done, mean), mean.apart),
    )
    tail = math.hypot(tail, crest * math.hypot(jump, drop) / width)
    peak = (sharp * SAMPLE) ** 2 + 0.5 * _noise_at(mean, top) ** 2
    if not peak < np.inf:
        return False
    faint = lay(rows, x, origin, False)
    place_faint(faint, rows, x, origin, mean, about, start, end)
    for _ in range(2):
        fit_to(clear, rows, x, origin, mean, about, spread, TURNS)
    fit_to(faint, rows, x, origin, mean, about, spread, TURNS)
    whole = Whole(
        start,
        end,
        top,
        start_variance,
        end_variance,
        start_variance + end_variance + 2.0 * early * late,
        jump**2,
        drop**2,
        crest,
        peak,
        area,
        (tail / area) ** 2,
    )
    measured = np.zeros(len(rows), np.bool_)
    for group in range(2):
        laid = faint if group else clear
        for i in range(len(laid.known)):
            k = int(laid.known[i, ONE])
            if _is_near(rows[k], laid.known[i], whole, origin + len(x)):
                _write(rows[k], laid.known[i], laid.covariance[i], whole, timed)
                measured[k] = True
    for k in range(len(rows)):
        if not measured[k]:
            _doubt(rows[k], (end - start) * math.exp(about), timed)
    return True


@kernel
def _usual_contact(laid, rows):
    """Geometric mean of the contacts of pulses as they were found."""
    total = 0.0
    for i in range(len(laid.known)):
        total += math.log(max(rows[int(laid.known[i, ONE]), 1], 1.0))
    return math.exp(total / max(len(laid.known), 1))


@kernel
def _is_near(row, one, whole, limit):
    """Whether a pulse is about where and as high as it was, and within the samples."""
    width = math.exp(one[WIDTH])
    at = row[FIT + ZERO] + one[PLACE] + whole.start * width
    end = row[FIT + ZERO] + one[PLACE] + whole.end * width
    ratio = one[AMPLITUDE] * whole.crest / row[2]
    near = 1.0 / AS_HIGH < ratio < AS_HIGH and at < row[0] + row[1] and end > row[0]
    return near and at >= 0.0 and end <= limit


@kernel
def _write(row, one, covariance, whole, timed):
    """Write what is measured of a pulse, with standard errors, into its row."""
    kept = row[FIT:]
    width, height, long = math.exp(one[WIDTH]), one[AMPLITUDE], whole.end - whole.start
    # Shapes that differ scatter by more than noise.
    more = max(one[MISFIT], 1.0) * (kept[NOISE] / one[SIGMA]) ** 2
    at = whole.start * width
    own = covariance[1, 1] + at * (2.0 * covariance[2, 1] + at * covariance[2, 2])
    shared = whole.start_variance * width**2 + whole.jump
    row[0] = kept[ZERO] + one[PLACE] + at
    row[ERRORS] = math.sqrt(max(own, 0.0) * more + shared + whole.jump)
    row[SHARED] = math.sqrt(shared)
    if timed:
        row[1], row[4] = long * width, (whole.top - whole.start) * width
        both = covariance[2, 2] * more * long**2 + whole.both
        row[ERRORS + 1] = math.sqrt(both * width**2 + whole.jump + whole.drop)
    of_height = more * covariance[0, 0] / height**2
    base = kept[LEVEL] / height
    row[2], row[3] = height * whole.crest, height * width * whole.area
    row[ERRORS + 2] = math.sqrt(of_height + base**2 + whole.peak) * row[2]
    row[SHARED_PEAK] = math.sqrt(whole.peak) * row[2]
    both = of_height + more * (covariance[2, 2] + 2.0 * covariance[2, 0] / height)
    both = max(both, 0.0) + whole.tail + (base * long / whole.area) ** 2
    row[ERRORS + 3] = math.sqrt(both) * row[3]


@kernel
def _doubt(row, usual, timed):
    """Increase the errors of a pulse that was measured as none of those it may be one of."""
    if row[5] == NO_PULSE:
        return
    off = abs(usual - row[1]) if timed else 0.0
    row[ERRORS] = math.hypot(row[ERRORS], 0.5 * off)
    if timed:
        row[ERRORS + 1] = math.hypot(row[ERRORS + 1], off)
    row[ERRORS + 3] = math.hypot(row[ERRORS + 3], row[3] * off / usual)


@kernel
def _of_tail(way, edge):
    """Error of the end of an edge that is seen `way` before it and climbs within `edge`."""
    tail = min(max((way / max(edge, 1e-9) - TAIL) / LONGER, 0.0), 1.0)
    return FARTHER * tail * way


@kernel
def _cut_off(way, edge, variance, height, apart):
    """Standard error of the area below the foot of an edge, or of a step between two knots."""
    step = SAMPLE * apart * min(2.0 * apart / max(edge, apart), 1.0)
    return height * math.hypot(step, 0.5 * variance / max(way, apart))


@kernel
def _is_like(laid, mean, left):
    """Whether the mean pulse leaves much less of pulses than the family does.

    What it leaves of a jump, which lies between two samples and two knots, does not count.
    """
    missed = total = square = samples = highest = steps = stepped = 0.0
    for b in range(len(mean.heights)):
        square += mean.heights[b] ** 2 * mean.apart
        highest = max(highest, mean.heights[b])
    for b in range(len(mean.heights) - 1):
        step = abs(mean.heights[b + 1] - mean.heights[b])
        if step > STEP * highest:
            steps += (SAMPLE * step) ** 2 / mean.apart
    for i in range(len(laid.known)):
        one = laid.known[i]
        count = one[LAST] - one[FIRST]
        weight, width = (one[AMPLITUDE] / one[SIGMA]) ** 2, math.exp(one[WIDTH])
        missed += (one[MISFIT] - 1.0) * count
        samples += count
        total += weight * width * square
        stepped += weight * width * steps * max(mean.apart, 1.0 / width) ** 2
    return missed - stepped < FARTHEST**2 * left * total + NOISY * math.sqrt(2.0 * samples)


@kernel
def _jump(edge, apart, width):
    """Standard error of where a jump lies [samples]; 0 of an edge of a sample and more."""
    return max(1.0 - edge * width, 0.0) * max(SAMPLE, SAMPLE * apart * width)


@kernel
def _crest_beside(mean, about, start, end, jumps, drops, top):
    """As `_crest`, of a mean pulse that jumps at `start` or drops at `end`; knots overshoot there.

    Where they do, the crest of all knots is at the jump, which lies between two samples and two
    knots. Where it is beyond, at `top`, the rise is round.
    The logarithm of the height of a jump is at most that of a line through the knots behind these.
    Whether it is round, these do not tell: it may be lower by ROUND of the way from the first of
    them to there.
    """
    beside = max(2.0 * math.exp(-about), BESIDE * mean.apart)
    near = math.exp(-about) + mean.apart
    jumps, drops = jumps and top < start + near, drops and top > end - near
    low = start + beside if jumps else start
    high = end - beside if drops else end
    best, at, sharp = _crest(mean, about, low, high)
    middle, square = 0.5 * (BEHIND - 1), BEHIND * (BEHIND**2 - 1.0) / 12.0
    back = middle + beside / mean.apart
    for side in range(2):
        if not (drops if side else jumps):
            continue
        first, step = (high, -mean.apart) if side else (low, mean.apart)
        height = slope = scatter = 0.0
        for k in range(BEHIND):
            one = _logarithm(height_at(first + k * step, mean), best)
            height += one / BEHIND
            slope += (k - middle) * one / square
        for k in range(BEHIND):
            one = _logarithm(height_at(first + k * step, mean), best)
            scatter += (one - height - slope * (k - middle)) ** 2 / (BEHIND - 2.0)
        rise = -slope * back
        error = math.sqrt(scatter * (1.0 / BEHIND + back * back / square))
        here = math.exp(height + min(rise, HIGHEST))
        if rise > 0.0 and here > best * (1.0 - 2.0 * error):
            way = 1.0 - math.exp(min(slope * (back - middle), 0.0))
            sharp = math.hypot(ROUND * way, error) / SAMPLE
            best, at = here * (1.0 - 0.5 * ROUND * way), end if side else start
    return best, at, sharp


@kernel
def _logarithm(height, usual):
    """Logarithm of the height of a knot, which noise may leave below zero."""
    return math.log(max(height, 0.01 * usual, 1e-300))


@kernel
def _crest(mean, about, low, high):
    """Height of the mean pulse, where it is, and how much it falls within a sample or two knots.

    From `low` to `high`.
    """
    count = len(mean.heights)
    best, at = 0.0, 0
    for b in range(1, count - 1):
        if not low <= LOW + b * mean.apart <= high:
            continue
        if mean.heights[b] > best and mean.heights[b] * math.sqrt(mean.weight[b]) > SIGNIFICANT:
            best, at = mean.heights[b], b
    if best <= 0.0:
        return 0.0, 0.0, 0.0
    total = number = middle = 0.0
    noise = 1.0 / math.sqrt(mean.weight[at])
    for b in range(count):
        if not mean.weight[b] > 0.0 or not low <= LOW + b * mean.apart <= high:
            continue
        if mean.heights[b] > best * 0.999 - 1.5 * noise and abs(b - at) * mean.apart < 1.0:
            total += mean.heights[b]
            middle += LOW + b * mean.apart
            number += 1.0
    crest, top = total / number, middle / number
    one = max(math.exp(-about), 2.0 * mean.apart)
    fall = min(crest - height_at(top - one, mean), crest - height_at(top + one, mean))
    return crest, top, max(fall / crest, 0.0)


@kernel
def _noise_at(mean, v):
    """Standard error of the mean pulse at a place, over its height; inf if no sample lies there."""
    b = min(max(int((v - LOW) / mean.apart), 0), len(mean.heights) - 1)
    return 1.0 / math.sqrt(mean.weight[b]) if mean.weight[b] > 0.0 else np.inf


@allocating
def _end(laid, rows, x, origin, mean, side, crest):
    """Where an end lies, its variance, where the edge is first seen; its length to 0.6 there."""
    u, y, w = edge_of(laid, rows, x, origin, mean, side, crest)
    count = len(mean.heights)
    first = np.empty(len(LEVELS), np.int64)
    place = np.empty(len(LEVELS))
    for m in range(len(LEVELS)):
        place[m] = np.inf
        for k in range(count - 1):
            b = k if side > 0 else count - 1 - k
            next_one = b + 1 if side > 0 else b - 1
            here, there = mean.heights[b] / crest, mean.heights[next_one] / crest
            seen = mean.weight[b] > 0.0 and here * crest * math.sqrt(mean.weight[b]) > SIGNIFICANT
            if here >= LEVELS[m] and there >= LEVELS[m] and seen:
                place[m] = side * (LOW + b * mean.apart)
                break
    if len(u) < 8 or place[len(LEVELS) - 1] == np.inf:
        return 0.0, np.inf, 0.0, 1.0
    for m in range(len(LEVELS)):
        first[m] = min(np.searchsorted(u, place[m]), len(u) - 1)
    at, variance = read_end(u, y, w, first)
    return min(at, place[0]), variance, place[0], place[len(LEVELS) - 1] - place[0]
