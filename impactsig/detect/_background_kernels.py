"""Kernels of the background: a rough baseline, the samples that belong to it, and their noise.

The noise of a response is read from the record with its impacts cut out: samples further than
OUTLYING from a running median are replaced by straight lines. So neither impacts nor steps, bumps
and glitches raise it, however many widths a response takes in.
"""

from __future__ import annotations

import math

import numpy as np

from .._compiled import njit
from ._order_kernels import median_of, middle, select
from ._response_kernels import running_sums

OUTLYING = 4.0
"""Deviations from the baseline, in its own noise, beyond which a sample is no background."""
LOUDER = 2.0
"""Times the noise of the spans around it, from which that of a span counts for itself."""
SEVERAL = 4
"""Samples in a row that are no glitch."""
ALONE = 5.0
"""Times the differences around it that a sample which stands alone is off."""
MEDIAN = 1.4826  # standard deviation of Gaussian values over the median of their magnitudes
SIXTH = 4.75  # the same over the magnitude that a sixth of them stay below
DECILE = 1.75  # nine in ten are within 1.645 standard deviations; the rest is for chance
FEW = 24  # responses: fewer tell no noise
SEEN = 256  # values that a median is taken of
PLACES = 320  # responses that tell the noise of a width


@njit(nogil=True)
def take(values, reference, factor, out):
    """Fill `out` with `factor` times what the values are above the reference."""
    for i in range(len(values)):
        out[i] = (np.float64(values[i]) - reference) * factor


@njit(nogil=True)
def chunk_medians(x, chunk, out):
    """Medians of the chunks of x, of SEEN samples each; the last chunk may be longer.

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


@njit(nogil=True, fastmath={"reassoc", "nnan", "nsz"})
def outlying(x, medians, chunk, widest, least, mask, block, sums, counts, spikes):
    """Mark the samples of x that are no background; block sums of those that are.

    Parameters
    ----------
    x : array (n,)
    medians : array (c + 2,)
        Medians of the c chunks of x, and of the one before and after.
    widest : int
        Samples of the widest contact.
    least : float
        Least standard deviation.
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
    stride = max(1, n // 2048)
    values = np.empty(n // stride + 1)
    count = 0
    for i in range(0, n, stride):
        values[count] = abs(x[i] - _baseline(medians, chunk, i))
        count += 1
    if len(medians) == 3:  # one chunk alone
        sigma = max(SIXTH * select(values, 0, count - 1, count // 6), least)
    else:
        sigma = max(MEDIAN * median_of(values, count), least)
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
    i = _next_marked(mask, 0)
    while i < n:  # as much again of what is marked, for its feet
        j = i
        while j < n and mask[j]:
            if _stands_alone(x, j, sigma):
                if alone < len(spikes):
                    spikes[alone] = j
                alone += 1
            j += 1
        runs += j - i >= SEVERAL
        grow = 1 + min(3 * (j - i) // 5, widest)
        lo, hi = max(0, i - grow), min(n, j + grow)
        for m in range(lo, i):
            mask[m] = 1
        m = j
        while m < hi and not mask[m]:
            mask[m] = 1
            m += 1
        i = _next_marked(mask, m)
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


@njit(nogil=True)
def _next_marked(mask, i):
    """Number of the first sample from i on that is marked; of the end if none is."""
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


@njit(nogil=True)
def _outlying_blocks(mask, block, sums, counts):
    """Mark the blocks whose means are outlying too, and those beside them: feet of pulses."""
    values = np.empty(len(sums))
    count = 0
    for k in range(len(sums)):
        if counts[k] > 0:
            values[count] = abs(sums[k] / counts[k])
            count += 1
    if count < 16:
        return
    limit = OUTLYING * MEDIAN * median_of(values, count)
    until = 0
    for k in range(len(sums)):
        if abs(sums[k]) <= limit * counts[k] or counts[k] == 0:  # whatever few samples add
            continue
        if abs(sums[k]) > limit * counts[k] * math.sqrt(block / counts[k]):
            for m in range(max(k - 1, until), min(k + 2, len(sums))):
                mask[m * block : (m + 1) * block] = 1
            until = k + 2
    for k in range(len(sums)):
        if (
            mask[k * block]
            and mask[(k + 1) * block - 1]
            and mask[k * block : (k + 1) * block].all()
        ):
            sums[k], counts[k] = 0.0, 0


@njit(nogil=True)
def _stands_alone(x, i, sigma):
    """Whether sample i is off its neighbours by far more than they are off theirs."""
    if i < 2 or i > len(x) - 3:
        return False
    off = abs(x[i] - 0.5 * (x[i - 1] + x[i + 1]))
    around = max(abs(x[i - 1] - x[i - 2]), abs(x[i + 1] - x[i + 2]), abs(x[i + 1] - x[i - 1]))
    return off > 8.0 * sigma and off > ALONE * around


@njit(nogil=True)
def _baseline(medians, chunk, i):
    """The line between the medians of the chunks whose middles are before and after sample i."""
    place = (i + 0.5) / chunk + 0.5
    k = min(int(place), len(medians) - 2)
    return medians[k] + (place - k) * (medians[k + 1] - medians[k])


@njit(nogil=True)
def _cut_out(x, mask, out):
    """X with straight lines in place of what is marked; levels where it reaches an end."""
    n = len(x)
    out[:] = x
    i = _next_marked(mask, 0)
    while i < n:
        j = i
        while j < n and mask[j]:
            j += 1
        side = min(64, max(4, (j - i) // 2))  # samples of a mean beside it
        before = _beside(x, mask, i - 1, -1, side)
        after = _beside(x, mask, j, 1, side)
        if np.isnan(before):
            before = 0.0 if np.isnan(after) else after
        if np.isnan(after):
            after = before
        for m in range(i, j):
            out[m] = before + (m - i + 1) * (after - before) / (j - i + 1)
        i = _next_marked(mask, j)


@njit(nogil=True)
def _beside(x, mask, first, step, wanted):
    """Mean of up to `wanted` samples from `first` on, as far as they are background."""
    total, count, i = 0.0, 0, first
    while 0 <= i < len(x) and not mask[i] and count < wanted:
        total += x[i]
        count += 1
        i += step
    return total / count if count else np.nan


@njit(nogil=True)
def _response_noise(sums, marked, rungs, floor, out):
    """Standard deviation of the responses on each rung, from PLACES of them.

    Where too little background is left of a stretch, the noise of a width is that of the widest
    rung that it is not too short for: noise of any colour is averaged down by a greater width, or
    at worst it is not.

    Parameters
    ----------
    sums : array (n + 1,)
        Of the first samples, with straight lines in place of what is marked.
    marked : array (n + 1,)
        How many samples before each are marked.
    rungs : Ladder
    floor : float
        Least standard deviation of a sample.
    out : array (rungs,), filled
    """
    n = len(sums) - 1
    values = np.empty(PLACES)
    for j in range(len(out)):
        width, block = rungs.width[j], rungs.width[j] // rungs.unit[j]
        near, far = rungs.near[j] * block, rungs.far[j] * block
        before = (width - 1) // 2
        first, last = far + 1, n - far - 1
        least = floor * rungs.gain[j] / np.sqrt(width)
        count = 0
        if last - first >= 4 * width + 8:
            places = min(PLACES, last - first)
            apart, over = (last - first) // places, (last - first) % places
            i, rest = first, 0
            for _ in range(places):
                a = i - before
                if marked[a + width] - marked[a] <= width // 4:
                    centre = (sums[a + width] - sums[a]) / width
                    sides = sums[i - near] - sums[i - far] + sums[i + far + 1] - sums[i + near + 1]
                    values[count] = abs(centre - sides / (2 * (far - near)))
                    count += 1
                i, rest = i + apart, rest + over
                if rest >= places:
                    i, rest = i + 1, rest - places
        if count < FEW:
            out[j] = max(out[j - 1] if j else 0.0, least)
            continue
        middle_value = MEDIAN * median_of(values, count)
        upper = select(values, count // 2, count - 1, int(0.9 * count)) / DECILE
        out[j] = max(rungs.gain[j] * max(middle_value, upper), least)


@njit(nogil=True)
def read_noise(x, spikes, mask, rungs, floor, rest, sums, marked, out):
    """Take samples that stand alone out of x, in place; the noise of its responses.

    Parameters
    ----------
    x : array (n,)
    spikes : array of int
        Places of these samples.
    mask : array (n,) of uint8
        What is no background.
    floor : float
        Least standard deviation of a sample.
    rest : float
        Least standard deviation of a response.
    sums, marked : arrays (n + 1,) of float and int32
        Room to work in.
    out : array (rungs,), filled
    """
    for i in spikes:
        x[i] = 0.5 * (x[i - 1] + x[i + 1])
    _cut_out(x, mask, sums[1:])
    running_sums(sums, 1, len(x), sums)
    marked[0] = count = 0
    for i in range(len(x)):
        count += mask[i]
        marked[i + 1] = count
    _response_noise(sums, marked, rungs, floor, out)
    for j in range(len(out)):
        out[j] = max(out[j], rest)


@njit(nogil=True)
def noise_around(noise, at, least):
    """Noise of the responses in the span of row `at`, from that of some spans, a row each.

    The median; but a louder span counts for itself and the next ones, as responses at the border
    see the noise beyond it.
    """
    usual = np.empty(noise.shape[1])
    middle(noise, usual)
    out = usual.copy()
    for j in range(len(out)):
        for k in range(max(at - 1, 0), min(at + 2, len(noise))):
            if noise[k, j] > LOUDER * usual[j]:
                out[j] = max(out[j], noise[k, j])
        out[j] = max(out[j], least)
    return out
