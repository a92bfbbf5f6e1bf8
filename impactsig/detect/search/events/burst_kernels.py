"""Recognition of bursts of interference.

A pulse follows no trough, but for the ringing of a stronger one; in a burst of noise most crests
follow one that is as deep as they are high.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...pulses.edges import NO_PULSE
from ...signal.order_kernels import median_of
from ._louder_noise_kernels import is_crest_of_noise, mean_over
from .ringing_kernels import CLOSE, DEEP, SEEN

LOUDER = 4.0
"""Times what lies beside: what the means of a burst change by, in squares."""
FAR, MANY = 25.0, 6
"""Contacts that crests of a burst are apart at most where it hides most of them (else as ringing,
CLOSE); and how many make one."""
SWUNG, RISING = 0.35, 0.25
"""Share of them that a trough comes before, and of these that are higher than the one before."""
BELOW, CLIMBING, NOISE = 0.4, 0.35, 3.0
"""Or what lies below the level over what lies above it, in squares of means beyond so many standard
deviations; and share of all that are higher than the one before."""
LASTING = 0.25
"""Least squares of heights in its second half, of those in the first: a structure that rings after
a blow dies away."""
HIGHER = 3.0
"""Times the mean of a burst: a pulse in it."""


def follow_closely(rows):
    """Whether any measured pulse follows another closely enough to be its ringing or its tail.

    Or both to be crests of a burst. Where none does, there is nothing to look for.
    """
    pulses = rows[rows[:, 5] != NO_PULSE]
    if len(pulses) < 2:
        return False
    gaps = pulses[1:, 0] - pulses[:-1, 0] - pulses[:-1, 1]
    return not (gaps > FAR * pulses[:, 1].max()).all()


@allocating
def bursts(x, origin, sigma, longest, rows, swung, out):
    """Mark measured pulses that are crests of a burst of noise; whether there are any.

    Of many that follow one another closely, those of a sensor that rings are each lower than the
    one before; those of noise are as often higher. What a whole structure does after a blow may
    rise too, but dies away.

    Parameters
    ----------
    x : array
        Samples without hum, from sample `origin` on; `sigma` is their noise.
    longest : float
        The longest contact [samples].
    rows : array (n, ...)
        Start, contact, peak, ... of each, in the order of time.
    swung : array (n,)
        Those that a trough comes before.
    """
    values = np.empty(SEEN)
    out[:] = False
    found = _bursts(x, origin, sigma, rows, swung, CLOSE, values, out) or _bursts(
        x, origin, sigma, rows, swung, FAR, values, out
    )
    if found:
        return True
    count = 0
    for k in range(len(rows)):
        out[k] = int(rows[k, 5]) != NO_PULSE and is_crest_of_noise(x, origin, rows, k, longest)
        count += out[k]
    if count < MANY:
        out[:] = False
    return count >= MANY


@kernel
def _bursts(x, origin, sigma, rows, swung, close, values, out):
    """The same for crests closer than a multiple of their mean contact."""
    found = False
    first = count = 0
    contacts = 0.0
    last = -1
    for k in range(len(rows) + 1):
        end = k == len(rows)
        if not end:
            if int(rows[k, 5]) == NO_PULSE:
                continue
            end = (
                count > 0 and rows[k, 0] - rows[last, 0] - rows[last, 1] > close * contacts / count
            )
        if end and count >= MANY:
            part = slice(first, last + 1)
            found |= _is_burst(x, origin, sigma, rows[part], swung[part], count, values, out[part])
        if end:
            first, count, contacts = k, 0, 0.0
        if k < len(rows):
            contacts += rows[k, 1]
            count, last = count + 1, k
    return found


@kernel
def _is_burst(x, origin, sigma, rows, swung, count, values, out):
    """Whether `count` successive pulses form a burst; if so, marks what it explains."""
    seen = below = rising = climbing = 0
    before = total = early = late = lengths = 0.0
    for k in range(len(rows)):
        if int(rows[k, 5]) == NO_PULSE:
            continue
        height = rows[k, 2]
        below += swung[k]
        rising += swung[k] and height > before
        climbing += height > before
        before = height
        total += height
        lengths += math.log(max(rows[k, 1], 1.0))
        seen += 1
        if 2 * seen <= count:
            early += height**2
        else:
            late += height**2
    if late < LASTING * early:
        return False
    if below < SWUNG * count or rising < RISING * below:
        start = int(rows[0, 0]) - origin
        stop = int(rows[-1, 0] + rows[-1, 1]) + 1 - origin
        width = max(1, int(0.5 * math.exp(lengths / count)))
        deep = DEEP * total / count
        if climbing < CLIMBING * count or not _lies_either_way(
            x, start, stop, width, sigma, deep, values
        ):
            return False
    for k in range(len(rows)):
        out[k] = rows[k, 2] * count < HIGHER * total
    return True


@kernel
def _lies_either_way(x, first, last, width, sigma, deep, values):
    """Whether samples [first, last) move far more than those beside, equally up and down.

    Somewhere they lie `deep` below the level, as what drifts does not. Means of `width` samples
    tell, so that noise does not where pulses are lower than it.
    """
    length = last - first
    first, last = max(first, 0), min(last, len(x))
    before, after = max(first - length, 0), min(last + length, len(x))
    count = 0
    for i in range(len(values)):
        k = before + i * (after - before) // len(values)
        if k < first or k >= last:
            values[count] = x[k]
            count += 1
    if count < len(values) // 4:
        return False
    inside = _moves(x, first, last, width)
    if inside < LOUDER * max(_moves(x, before, first, width), _moves(x, last, after, width)):
        return False
    level = median_of(values, count)
    above = below = deepest = 0.0
    least = NOISE * sigma / math.sqrt(width)
    for i in range(first, last - width + 1, width):
        off = mean_over(x, i, width) - level
        if off > least:
            above += off**2
        elif off < -least:
            below += off**2
            deepest = max(deepest, -off)
    return below > BELOW * above and deepest > deep


@kernel
def _moves(x, first, last, width):
    """Mean square difference of successive means of `width` samples."""
    total, count = 0.0, 0
    for i in range(first + width, last - width + 1, width):
        total += (mean_over(x, i, width) - mean_over(x, i - width, width)) ** 2
        count += 1
    return total / max(count, 1)
