"""Recognition of noise that becomes louder for a while, by its crests."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...pulses.edges import NO_PULSE
from ...signal.ladder import HALF_SINE_GAIN
from ...signal.order_kernels import centre_of, select

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


@allocating
def is_crest_of_noise(x, origin, rows, k, longest):
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
        values[k] = mean_over(x, first + k * (length - width) // (MEANS - 1), width)
    for k in range(0, MEANS, TOGETHER):
        for j in range(TOGETHER):
            level[j] = values[k + j]
        middle = centre_of(level, TOGETHER)
        for j in range(k, k + TOGETHER):
            values[j] = middle - values[j]


@kernel
def mean_over(x, first, width):
    total = 0.0
    for i in range(first, first + width):
        total += x[i]
    return total / width
