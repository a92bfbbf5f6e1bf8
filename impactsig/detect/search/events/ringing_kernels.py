"""Recognition of a sensor's ringing.

A stop pushes, and never pulls. Where a sensor rings after an impact, each crest follows a trough
that is deeper than it is high. A pulse follows none, but for the ringing of a stronger one.
"""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating
from ...pulses.edges import NO_PULSE
from ...signal.order_kernels import median_of

REACH = 3.0
"""Contacts before a pulse in which it may have swung below."""
DEEP = 0.7
"""Of the pulse's height: the depth of a trough that it follows."""
CLOSE = 6.0
"""Contacts between the end of a pulse and the start of its ringing, at most."""
AROUND, SEEN = 8.0, 64
"""Contacts to either side whose median is the level that troughs lie below, and values it is
taken of: flanks of a response no wider than a crest lie in the troughs beside it."""


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
