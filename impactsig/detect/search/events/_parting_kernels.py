"""Kernel that parts an event whose samples show several impacts."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating
from ...pulses.pair_fit import PAIR
from ...pulses.touching_kernels import NOT_TWO, TWO, crests_between_dips, two_pulses
from ...signal.ladder import HALF_SINE_GAIN, MATCH
from .width_kernels import EVENT, LEAST, RESPONSE, best_width, put, room_for, sigma_at

SURE = 4.5  # standard deviations that the samples fall by between two crests, at least


@allocating
def parted(x, origin, total, event, noise, out):
    """The events that an event consists of.

    Two where two half-sines explain the samples and one pulse does not; or one for each crest where
    the samples dip between crests and no single pulse explains that.
    """
    put(event, out, 0)
    pair = np.empty(PAIR + 1)
    sigma = noise.sigma[0] / RESPONSE
    kind = two_pulses(x, origin, event[0], event[1], event[2], event[4], sigma, pair)
    if kind == NOT_TWO or len(out) < 2:
        return 1
    if kind == TWO:
        least = np.inf
        for m in range(2):
            length = math.exp(pair[3 * m + 2])
            width = max(1.0, round(MATCH * length))
            out[m, 0], out[m, 1], out[m, 2] = pair[3 * m + 1] + 0.5 * length, width, pair[3 * m]
            out[m, 3], out[m, 4] = pair[3 * m] / sigma_at(int(width), noise), pair[PAIR]
            least = min(least, out[m, 3])
            if not 0.0 <= out[m, 0] <= total - 1.0:
                least = 0.0  # the crest of one lies where there are no samples
        if least >= LEAST:
            return 2
        put(event, out, 0)
        return 1
    width, base = event[1], event[4]
    mean = max(1, int(0.2 * width))
    lo = max(int(event[0] - 1.1 * width), origin)
    hi = min(int(event[0] + 1.1 * width) + 1, origin + len(x))
    count = hi - lo - mean + 1
    if count < 3:
        return 1
    sure = SURE * sigma_at(mean, noise) / (HALF_SINE_GAIN if mean > 1 else 1.0)
    crests, dips = np.empty(8, np.int64), np.empty(8, np.int64)
    here = x[lo - origin : hi - origin]
    n = crests_between_dips(here, base, mean, 0.15 * event[2], sure, crests, dips)
    if n < 2 or len(out) < n:
        return 1
    found = 0
    part, sums = np.empty(EVENT), np.empty(room_for(float(2 * len(here))))
    for k in range(n):
        left = dips[k - 1] if k > 0 else crests[k] - (dips[k] - crests[k])
        right = dips[k] if k < n - 1 else crests[k] + (crests[k] - dips[k - 1])
        widest = max(1.0, 0.9 * (right - left))
        narrowest = max(1.0, 0.35 * (right - left))
        centre = lo + crests[k] + 0.5 * (mean - 1)
        if best_width(x, origin, total, centre, narrowest, widest, noise, sums, part, np.inf):
            put(part, out, found)
            found += 1
    if found == 0:
        put(event, out, 0)
        found = 1
    return found
