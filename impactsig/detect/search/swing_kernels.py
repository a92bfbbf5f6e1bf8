"""What swings below the baseline first: ringing of a sensor, and bursts of interference.

A stop pushes, and never pulls. Where a sensor rings after an impact, each crest follows a trough
that is deeper than it is high; in a burst of noise most crests follow one as deep. A pulse follows
none, but for the ringing of a stronger one.
"""

from __future__ import annotations

import numpy as np

from ..._compiled import allocating, inner, kernel
from ..pulses.edges import NO_PULSE
from ..signal.order_kernels import median_of

REACH = 3.0
"""Contacts before a pulse in which it may have swung below."""
DEEP = 0.7
"""Of the pulse's height: the depth of a trough that it follows."""
AROUND, SEEN = 8.0, 64
"""Contacts to either side whose median is the level that troughs lie below, and values it is
taken of: flanks of a response no wider than a crest lie in the troughs beside it."""

CLOSE, MANY = 6.0, 6
"""Contacts that crests of a burst are apart at most, and how many make one."""
SWUNG, RISING = 0.35, 0.25
"""Share of them that a trough comes before, and of these that are higher than the one before."""
LASTING = 0.25
"""Least squares of heights in its second half, of those in the first: a structure that rings after
a blow dies away."""
HIGHER = 3.0
"""Times the mean of a burst: a pulse in it."""


@allocating
def swings_back(x, origin, dropouts, rows, out):
    """Mark in `out` the measured pulses that another comes before, and a trough.

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


@kernel
def bursts(rows, swung, out):
    """Mark in `out` the measured pulses that are crests of a burst of noise; whether any is.

    Of many that follow one another closely, those of a sensor that rings are each lower than the
    one before; those of noise are as often higher. What a whole structure does after a blow may
    rise too, but dies away.

    Parameters
    ----------
    rows : array (n, ...)
        Start, contact, peak, ... of each, in the order of time.
    swung : array (n,)
        Those that a trough comes before.
    """
    out[:] = False
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
                count > 0 and rows[k, 0] - rows[last, 0] - rows[last, 1] > CLOSE * contacts / count
            )
        if end and count >= MANY:
            part = slice(first, last + 1)
            found |= _is_burst(rows[part], swung[part], count, out[part])
        if end:
            first, count, contacts = k, 0, 0.0
        if k < len(rows):
            contacts += rows[k, 1]
            count, last = count + 1, k
    return found


@inner
def _is_burst(rows, swung, count, out):
    """Whether `count` pulses that follow one another are a burst; if so, mark what it explains."""
    seen = below = rising = 0
    before = total = early = late = 0.0
    for k in range(len(rows)):
        if int(rows[k, 5]) == NO_PULSE:
            continue
        height = rows[k, 2]
        below += swung[k]
        rising += swung[k] and height > before
        before = height
        total += height
        seen += 1
        if 2 * seen <= count:
            early += height**2
        else:
            late += height**2
    if below < SWUNG * count or rising < RISING * below or late < LASTING * early:
        return False
    for k in range(len(rows)):
        out[k] = rows[k, 2] * count < HIGHER * total
    return True
