"""Kernels that recognise sensor ringing and bursts of interference.

A stop pushes, and never pulls. Where a sensor rings after an impact, each crest follows a trough
that is deeper than it is high; in a burst of noise most crests follow one as deep. A pulse follows
none, but for the ringing of a stronger one.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...pulses.edges import NO_PULSE
from ...signal.ladder import HALF_SINE_GAIN
from ...signal.order_kernels import centre_of, median_of, select

REACH = 3.0
"""Contacts before a pulse in which it may have swung below."""
DEEP = 0.7
"""Of the pulse's height: the depth of a trough that it follows."""
AROUND, SEEN = 8.0, 64
"""Contacts to either side whose median is the level that troughs lie below, and values it is
taken of: flanks of a response no wider than a crest lie in the troughs beside it."""

LOUDER = 4.0
"""Times what lies beside: what the means of a burst change by, in squares."""
CLOSE, FAR, MANY = 6.0, 25.0, 6
"""Contacts that crests of a burst are apart at most, or else where it hides most of its crests; and
how many make one."""
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
BESIDE, MEANS, TOGETHER, NARROW = 0.3, 64, 16, 4
"""Of the longest contact: what is looked at before and after a pulse; means of its width in that,
how many of these have a common level, and by how much narrower are those that show dense pulses."""
LOUD, EVEN, ALIKE, CREST = 2.0, 0.4, 2.0, 5.0
"""Times the noise of a second: louder noise; of that in one half, the least in the other; times
what lies below the level, the most above it; and times the noise, its highest crest."""
QUIET = 0.5
"""Times the least noise: less in narrow responses shows at once that a stretch is not as loud."""
FILLED = 0.2
"""Of the time: what pulses fill where they are no crests of noise."""
FLANKS = HALF_SINE_GAIN * math.sqrt(1.125)
"""Noise of a response over that of the mean in its middle."""


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
def swings_back(x, origin, dropouts, rows, out):
    """Mark measured pulses that follow another pulse and a trough: ringing.

    Heights and depths are of means over half a contact, so that noise makes no trough where it
    makes no pulse.

    Parameters
    ----------
    x : array
        Samples without hum, from sample `origin` on.
    dropouts : array (d, 2)
        First samples of what was filled in, and those after the last: no troughs.
    rows : array (n, ...)
        Start, contact, ..., flags of each.
    """
    values, free, longest = np.empty(SEEN), -np.inf, 0.0
    for k in range(len(rows)):
        out[k] = False
        contact = rows[k, 1]
        if int(rows[k, 5]) == NO_PULSE or contact <= 0.0:
            continue
        beside = rows[k, 0] - free < CLOSE * max(contact, longest)
        free, longest = rows[k, 0] + contact, contact
        if not beside:
            continue
        start = int(rows[k, 0]) - origin
        width = max(1, int(0.5 * contact))
        last = min(int(rows[k, 0] + contact) + 1 - origin, len(x))
        first = max(0, start - int(REACH * contact) - 1)
        for i in range(len(dropouts)):
            if dropouts[i, 0] - origin <= start:
                first = max(first, min(dropouts[i, 1] - origin, start))
        if start <= first or last - start <= width:
            continue
        before = max(0, start - int(AROUND * contact))
        reach = min(last + int(AROUND * contact), len(x)) - before
        count = min(SEEN, reach)
        for i in range(count):
            values[i] = x[before + i * reach // count]
        base = median_of(values, count)
        height, total = -np.inf, 0.0
        for i in range(start, last):
            total += x[i]
            if i >= start + width:
                total -= x[i - width]
            if i >= start + width - 1:
                height = max(height, total / width - base)
        # The lowest mean that what is before it stands above: a step up is no trough.
        total, highest = 0.0, -np.inf
        for i in range(first, start + 1):
            total += x[i]
            if i >= first + width:
                total -= x[i - width]
            if i >= first + width - 1:
                mean = total / width - base
                highest = max(highest, mean)
                if mean < -DEEP * height and highest - mean > DEEP * height:
                    out[k] = True
                    break


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
        out[k] = int(rows[k, 5]) != NO_PULSE and _is_crest_of_noise(x, origin, rows, k, longest)
        count += out[k]
    if count < MANY:
        out[:] = False
    return count >= MANY


@allocating
def _is_crest_of_noise(x, origin, rows, k, longest):
    """Whether a pulse is no higher than crests of noise that is louder than that of the second.

    It has to be louder before the pulse, and as loud long before as shortly before: what an impact
    excites comes after it and dies away.
    """
    row = rows[k]
    at, width, height = int(row[0]) - origin, max(int(row[7]), 1), row[9]
    length = max(int(BESIDE * longest), MEANS * width)
    if _contacts_around(rows, k, length) > FILLED * 2.0 * length:
        return False
    least = max(LOUD * height / row[8], EVEN * height / CREST)
    before = _steady_noise(x, at - 4 * width - length, length, width, least)
    if before <= least:
        return False
    after = _steady_noise(x, at + 4 * width, length, width, 0.0)
    if after > EVEN * before:
        before = math.sqrt(0.5 * (before**2 + min(after, before / EVEN) ** 2))
    return height < CREST * before


@kernel
def _contacts_around(rows, k, length):
    """Sum of the contacts of pulses that begin within a length of pulse k [samples].

    All are looked at: where pulses touch, their starts are not in the order of their crests.
    """
    total = 0.0
    for j in range(len(rows)):
        if j != k and abs(rows[j, 0] - rows[k, 0]) < length and int(rows[j, 5]) != NO_PULSE:
            total += rows[j, 1]
    return total


@allocating
def _steady_noise(x, first, length, width, least):
    """Noise of responses of a width in a stretch; 0 unless all of it is there, and equally loud.

    It is what lies below the level: impacts only go up. Where they are dense, more lies above. It
    is 0, too, where narrower responses, which have more noise, have much less than `least`.
    """
    if first < 0 or first + length > len(x):
        return 0.0
    values, level = np.empty(MEANS), np.empty(TOGETHER)
    _below_level(x, first, length, max(width // NARROW, 1), values, level)
    below = select(values, 0, MEANS - 1, 3 * MEANS // 4)
    if FLANKS * below < QUIET * 0.6745 * least:
        return 0.0
    above = -select(values, 0, MEANS - 1, MEANS // 4)
    if above > ALIKE * below:
        return 0.0
    _below_level(x, first, length, width, values, level)
    half = MEANS // 2
    early = select(values, 0, half - 1, 3 * half // 4)
    late = select(values, half, MEANS - 1, half + 3 * half // 4)
    if min(early, late) < EVEN * max(early, late):
        return 0.0
    return FLANKS * math.sqrt(0.5 * (early**2 + late**2)) / 0.6745


@kernel
def _below_level(x, first, length, width, values, level):
    """How far means in a stretch lie below the median of those around them."""
    for k in range(MEANS):
        values[k] = _mean(x, first + k * (length - width) // (MEANS - 1), width)
    for k in range(0, MEANS, TOGETHER):
        for j in range(TOGETHER):
            level[j] = values[k + j]
        middle = centre_of(level, TOGETHER)
        for j in range(k, k + TOGETHER):
            values[j] = middle - values[j]


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
        off = _mean(x, i, width) - level
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
        total += (_mean(x, i, width) - _mean(x, i - width, width)) ** 2
        count += 1
    return total / max(count, 1)


@kernel
def _mean(x, first, width):
    total = 0.0
    for i in range(first, first + width):
        total += x[i]
    return total / width


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
