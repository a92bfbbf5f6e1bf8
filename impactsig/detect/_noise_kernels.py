"""Kernels that read the noise of the responses.

It is read from the record with its impacts cut out: what is no background is replaced by straight
lines. So neither impacts nor steps, bumps and glitches raise it, however many widths a response
takes in.
"""

from __future__ import annotations

import numpy as np

from .._compiled import njit
from ._background_kernels import MEDIAN, next_marked
from ._order_kernels import median_of, middle, select
from ._response_kernels import running_sums

LOUDER = 2.0
"""Times the noise of the spans around it, from which that of a span counts for itself."""
DECILE = 1.75  # nine in ten are within 1.645 standard deviations; the rest is for chance
FEW = 24  # responses: fewer tell no noise
PLACES = 320  # responses that tell the noise of a width


@njit(nogil=True)
def _cut_out(x, mask, out):
    """X with straight lines in place of what is marked; levels where it reaches an end."""
    n = len(x)
    out[:] = x
    i = next_marked(mask, 0)
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
        i = next_marked(mask, j)


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
def _response_noise(sums, marked, rungs, floor, sigma, out):
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
    sigma : float
        That of the background, where it is too short to show any response.
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
            # From `first` on, so that no index has a sign to look at.
            c0, c1 = sums[first - before :], sums[first - before + width :]
            m0, m1 = marked[first - before :], marked[first - before + width :]
            l0, l1 = sums[first - far :], sums[first - near :]
            r0, r1 = sums[first + near + 1 :], sums[first + far + 1 :]
            i, rest = np.uint64(0), 0
            for _ in range(places):
                if m1[i] - m0[i] <= width // 4:
                    sides = l1[i] - l0[i] + r1[i] - r0[i]
                    values[count] = abs((c1[i] - c0[i]) / width - sides / (2 * (far - near)))
                    count += 1
                i, rest = i + np.uint64(apart), rest + over
                if rest >= places:
                    i, rest = i + np.uint64(1), rest - places
        if count < FEW:
            out[j] = max(out[j - 1] if j else sigma, least)
            continue
        middle_value = MEDIAN * median_of(values, count)
        upper = select(values, count // 2, count - 1, int(0.9 * count)) / DECILE
        out[j] = max(rungs.gain[j] * max(middle_value, upper), least)


@njit(nogil=True)
def read_noise(x, spikes, mask, rungs, floor, rest, sigma, sums, marked, out):
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
    sigma : float
        Standard deviation of the background's samples.
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
    _response_noise(sums, marked, rungs, floor, sigma, out)
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
