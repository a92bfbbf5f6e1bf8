"""Kernels for the background: a rough baseline, and a mask of the samples that belong to it."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import allocating, kernel, njit
from ..._numerics.spread import DEVIATION_BY_MEDIAN
from ..signal.order_kernels import median_of, select

OUTLYING = 4.0
"""Deviations from the baseline, in its own noise, beyond which a sample is no background."""
SEVERAL = 4
"""Samples in a row that are no glitch."""
ALONE = 5.0
"""Times the differences around it that a sample which stands alone is off."""
SIXTH = 4.75  # the same over the magnitude that a sixth of them stay below
SEEN = 256  # values that a median is taken of


@njit(nogil=True, error_model="numpy", fastmath={"nnan", "nsz"})
def take(values, reference, factor, out):
    """Copy `factor` times the values above the reference into `out`; returns their range."""
    lowest, highest = np.inf, -np.inf
    for i in range(len(values)):
        x = (np.float64(values[i]) - reference) * factor
        out[i] = x
        lowest, highest = min(lowest, x), max(highest, x)
    return highest - lowest


@allocating
def chunk_medians(x, chunk, out):
    """Medians of the chunks of x, from SEEN samples each; the last chunk may be longer.

    One chunk alone may be a capture that is mostly pulse: its baseline is a low sample of it.
    """
    values = np.empty(SEEN)
    for k in range(len(out)):
        a = k * chunk
        b = len(x) if k == len(out) - 1 else a + chunk
        count = min(SEEN, b - a)
        for i in range(count):
            values[i] = x[a + i * (b - a) // count]
        out[k] = median_of(values, count)
    if len(out) == 1:
        out[0] = select(values, 0, count - 1, count // 6)


@njit(nogil=True, error_model="numpy", fastmath={"reassoc", "nnan", "nsz"})
def outlying(x, medians, chunk, widest, least, dropouts, mask, block, sums, counts, spikes):
    """Mark the samples of x that are not background; block sums of the background.

    Parameters
    ----------
    x : array (n,)
    medians : array (c + 2,)
        Medians of the c chunks of x, and of the one before and after.
    widest : int
        Samples of the widest contact.
    least : float
        Least standard deviation.
    dropouts : array (d, 2)
        First samples of what was filled in, and those after the last; no background.
    mask : array (n,) of uint8, filled
    block : int
        Samples a block of the sums.
    sums, counts : arrays, filled
        Of what the background is above the baseline, and of how many samples.
    spikes : array of int, filled
        Samples that stand alone.

    Returns
    -------
    (standard deviation of the background, spikes, runs of marked samples that are none)
    """
    n = len(x)
    live = n
    for d in range(len(dropouts)):
        live -= dropouts[d, 1] - dropouts[d, 0]
    if live == 0:
        _mark(mask, 0, n)
        for k in range(len(sums)):
            sums[k] = counts[k] = 0.0
        return least, 0, 0
    stride = max(1, live // 2048)
    values = np.empty(n // stride + 1)
    count = following = 0
    for i in range(0, n, stride):
        while following < len(dropouts) and dropouts[following, 1] <= i:
            following += 1
        if following == len(dropouts) or i < dropouts[following, 0]:
            values[count] = abs(x[i] - _baseline(medians, chunk, i))
            count += 1
    if count == 0:
        sigma = least
    elif len(medians) == 3:  # one chunk alone
        sigma = max(SIXTH * select(values, 0, count - 1, count // 6), least)
    else:
        sigma = max(DEVIATION_BY_MEDIAN * median_of(values, count), least)
    limit = OUTLYING * sigma
    for k in range(len(medians) - 1):  # from the middle of one chunk to that of the next
        a = max(0, k * chunk - chunk // 2)
        b = n if k == len(medians) - 2 else min(n, (k + 1) * chunk - chunk // 2)
        slope = (medians[k + 1] - medians[k]) / chunk
        base = _baseline(medians, chunk, a)
        part, marks = x[a:b], mask[a:b]
        for i in range(len(part)):
            marks[i] = abs(part[i] - (base + slope * i)) > limit
    alone = runs = 0
    i = next_marked(mask, 0)
    while i < n:  # as much again of what is marked, for its feet
        j = i
        longest = same = 0  # samples in a row on one side: lobes of a filter alternate
        above = False
        while j < n and mask[j]:
            if _stands_alone(x, j, sigma):
                if alone < len(spikes):
                    spikes[alone] = j
                alone += 1
            side = x[j] > _baseline(medians, chunk, j)
            same = same + 1 if side == above else 1
            above = side
            longest = max(longest, same)
            j += 1
        runs += longest >= SEVERAL
        grow = 1 + min(3 * (j - i) // 5, widest)
        lo, hi = max(0, i - grow), min(n, j + grow)
        _mark(mask, lo, i)
        m = j
        while m < hi and not mask[m]:
            mask[m] = 1
            m += 1
        i = next_marked(mask, m)
    for d in range(len(dropouts)):
        _mark(mask, dropouts[d, 0], min(dropouts[d, 1], n))
    for k in range(len(sums)):
        part, marks = x[k * block : (k + 1) * block], mask[k * block : (k + 1) * block]
        total, kept = 0.0, 0
        for i in range(block):
            total += 0.0 if marks[i] else part[i]
            kept += 1 - marks[i]
        # Over a block the baseline hardly bends.
        sums[k] = total - kept * _baseline(medians, chunk, k * block + block // 2)
        counts[k] = kept
    _outlying_blocks(mask, block, sums, counts)
    return sigma, alone, runs


@kernel
def _mark(mask, a, b):
    """Mark samples [a, b)."""
    for i in range(a, b):
        mask[i] = 1


@kernel
def _all_marked(mask, a, b):
    """Whether samples [a, b) are marked."""
    while a < b and mask[a]:
        a += 1
    return a == b


@kernel
def next_marked(mask, i):
    """Index of the first marked sample from i on; the length if there is none."""
    n = len(mask)
    while i < n and i % 8:
        if mask[i]:
            return i
        i += 1
    words = mask[: n // 8 * 8].view(np.uint64)
    word = i // 8
    while word < len(words) and words[word] == 0:
        word += 1
    i = max(i, 8 * word)
    while i < n and not mask[i]:
        i += 1
    return i


@allocating
def _outlying_blocks(mask, block, sums, counts):
    """Mark blocks with outlying means, and their neighbours: the feet of pulses."""
    values = np.empty(len(sums))
    count = 0
    for k in range(len(sums)):
        if counts[k] > 0:
            values[count] = abs(sums[k] / counts[k])
            count += 1
    if count < 16:
        return
    limit = OUTLYING * DEVIATION_BY_MEDIAN * median_of(values, count)
    until = 0
    for k in range(len(sums)):
        if abs(sums[k]) <= limit * counts[k] or counts[k] == 0:  # whatever few samples add
            continue
        if abs(sums[k]) > limit * counts[k] * math.sqrt(block / counts[k]):
            for m in range(max(k - 1, until), min(k + 2, len(sums))):
                _mark(mask, m * block, min((m + 1) * block, len(mask)))
            until = k + 2
    for k in range(len(sums)):
        if (
            mask[k * block]
            and mask[(k + 1) * block - 1]
            and _all_marked(mask, k * block, min((k + 1) * block, len(mask)))
        ):
            sums[k], counts[k] = 0.0, 0


@kernel
def _stands_alone(x, i, sigma):
    """Whether sample i deviates from its neighbours far more than they do from theirs."""
    if i < 2 or i > len(x) - 3:
        return False
    off = abs(x[i] - 0.5 * (x[i - 1] + x[i + 1]))
    around = max(abs(x[i - 1] - x[i - 2]), abs(x[i + 1] - x[i + 2]), abs(x[i + 1] - x[i - 1]))
    return off > 8.0 * sigma and off > ALONE * around


@kernel
def _baseline(medians, chunk, i):
    """Baseline at sample i: interpolated between the medians of the chunks beside it."""
    place = (i + 0.5) / chunk + 0.5
    k = min(int(place), len(medians) - 2)
    return medians[k] + (place - k) * (medians[k + 1] - medians[k])
