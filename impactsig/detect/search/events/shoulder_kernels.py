"""Kernels that recognise the tail of a pulse, which is not a second pulse.

Where a second pulse begins before the first has ended, the samples rise again, or they fall ever
more slowly and then faster. Those of one pulse that decays fall ever more slowly to the end,
however far its tail is from the shapes that pulses are fitted with.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import kernel
from ...pulses.edges import NO_PULSE
from ...signal.ladder import MATCH
from ...signal.order_kernels import value_at

STRIDE = 0.25
"""Of the shorter contact: the length of the means whose falls are looked at."""
BESIDE = 0.25
"""Of it: how far pulses lie apart, at most, that are looked at."""
TURN = 0.05
"""Of the lower pulse: by how much the fall must slow down and become faster again."""
SURE, CODES = 3.0, 1.35
"""Times the noise of a response as wide as the means, and steps of the converter: the same."""


class Noise(NamedTuple):
    """Noise of the samples beside impacts."""

    widths: np.ndarray  # of responses
    sigma: np.ndarray  # their noise
    step: float  # of the converter


@kernel
def tails(x, origin, noise, rows, events, out):
    """Mark measured pulses that are the tail of the one before.

    Parameters
    ----------
    x : array
        Samples without hum, from sample `origin` on.
    noise : Noise
    rows : array (n, ...)
        Start, contact, peak, ..., flags of each.
    events : array (n, EVENT)
        Of those that have a tail the centre, the width and the height are put right.
    """
    out[:] = False
    before = -1
    for k in range(len(rows)):
        if int(rows[k, 5]) == NO_PULSE or rows[k, 1] <= 0.0:
            continue
        if before >= 0:
            shorter = min(rows[k, 1], rows[before, 1])
            end = rows[before, 0] + rows[before, 1]
            if rows[k, 0] < end + BESIDE * shorter:
                first = max(int(rows[before, 0]) - origin, 0)
                last = min(int(rows[k, 0] + rows[k, 1]) + 2 - origin, len(x))
                crest_by = int(min(end, rows[k, 0])) + 1 - origin
                stride = max(1, int(STRIDE * shorter))
                least = max(
                    TURN * min(rows[k, 2], rows[before, 2]),
                    SURE * value_at(float(stride), noise.widths, noise.sigma),
                    CODES * noise.step,
                )
                out[k] = not _turns(x, first, crest_by, last, stride, least)
            if out[k]:
                contact = rows[k, 0] + rows[k, 1] - rows[before, 0]
                events[before, 0] = rows[before, 0] + 0.5 * contact
                events[before, 1] = max(MATCH * contact, 1.0)
                events[before, 2] = rows[before, 2]
        if not out[k]:
            before = k


@kernel
def _turns(x, first, crest_by, last, stride, least):
    """Whether the fall after a crest slows down and speeds up again, each by `least`."""
    if last - first < 2 * stride + 1:
        return True
    mean = 0.0
    for i in range(first, first + stride):
        mean += x[i]
    crest, highest = first, mean
    for i in range(first + 1, min(crest_by, last - 2 * stride)):
        mean += x[i + stride - 1] - x[i - 1]
        if mean > highest:
            crest, highest = i, mean
    early = late = 0.0
    for i in range(crest, crest + stride):
        early += x[i]
        late += x[i + stride]
    greatest = lowest = 0.0
    for i in range(crest, last - 2 * stride + 1):
        fall = (early - late) / stride
        if fall > greatest:
            if greatest - lowest > least:
                return True
            greatest = lowest = fall
        else:
            lowest = min(lowest, fall)
            if fall - lowest > least:
                return True
        if i + 2 * stride < last:
            early += x[i + stride] - x[i]
            late += x[i + 2 * stride] - x[i + stride]
    return False
