"""Kernels that measure the noise of the responses.

It is read from the record with its impacts cut out: what is no background is replaced by straight
lines. So neither impacts nor steps, bumps and glitches raise it, however many widths a response
takes in.
"""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ..._numerics.spread import DEVIATION_BY_MEDIAN
from ..signal.order_kernels import median_of, middle, select
from ._background_kernels import next_marked
from ._response_kernels import running_sums

LOUDER = 2.0
"""Times the noise of the spans around it, from which that of a span counts for itself."""
DECILE = 1.75  # nine in ten are within 1.645 standard deviations; the rest is for chance
FEW = 24  # responses: fewer tell no noise
PLACES = 320  # responses that tell the noise of a width


@allocating
def _cut_out(x, mask, runs, kept):
    """Replace the marked stretches of x by straight lines.

    The marked stretches go into `runs`, first samples and those after the last, and what was there
    into `kept`. Returns how many there are.
    """
    n, count, room = len(x), 0, 0
    i = next_marked(mask, 0)
    while i < n:
        j = i
        while j < n and mask[j]:
            kept[room] = x[j]
            room += 1
            j += 1
        runs[count, 0], runs[count, 1] = i, j
        count += 1
        i = next_marked(mask, j)
    for k in range(count):
        i, j = runs[k]
        side = min(64, max(4, (j - i) // 2))  # samples of a mean beside it
        before = _beside(x, mask, i - 1, -1, side)
        after = _beside(x, mask, j, 1, side)
        if np.isnan(before):
            before = 0.0 if np.isnan(after) else after
        if np.isnan(after):
            after = before
        for m in range(i, j):
            x[m] = before + (m - i + 1) * (after - before) / (j - i + 1)
    return count


@kernel
def _put_back(x, runs, kept):
    """Undo `_cut_out`."""
    room = 0
    for i, j in runs:
        for m in range(i, j):
            x[m] = kept[room]
            room += 1


@kernel
def _beside(x, mask, first, step, wanted):
    """Mean of up to `wanted` background samples from `first` on."""
    total, count, i = 0.0, 0, first
    while 0 <= i < len(x) and not mask[i] and count < wanted:
        total += x[i]
        count += 1
        i += step
    return total / count if count else np.nan


@allocating
def _response_noise(sums, runs, rungs, floor, sigma, out):
    """Standard deviation of the responses of each width, from PLACES of them.

    Where too little background is left of a stretch, the noise of a width is that of the widest
    rung that it is not too short for: noise of any colour is averaged down by a greater width, or
    at worst it is not.

    Parameters
    ----------
    sums : array (n + 1,)
        Of the first samples, with straight lines in place of what is marked.
    runs : array (m, 2)
        Where samples are marked, in order.
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
            l0, l1 = sums[first - far :], sums[first - near :]
            r0, r1 = sums[first + near + 1 :], sums[first + far + 1 :]
            i, rest, following = 0, 0, 0
            for _ in range(places):
                a = first - before + i
                while following < len(runs) and runs[following, 1] <= a:
                    following += 1
                marked, run = 0, following
                while run < len(runs) and runs[run, 0] < a + width and marked <= width // 4:
                    marked += min(runs[run, 1], a + width) - max(runs[run, 0], a)
                    run += 1
                if marked <= width // 4:
                    m = np.uint64(i)
                    sides = l1[m] - l0[m] + r1[m] - r0[m]
                    values[count] = abs((c1[m] - c0[m]) / width - sides / (2 * (far - near)))
                    count += 1
                i, rest = i + apart, rest + over
                if rest >= places:
                    i, rest = i + 1, rest - places
        if count < FEW:
            out[j] = max(out[j - 1] if j else sigma, least)
            continue
        middle_value = DEVIATION_BY_MEDIAN * median_of(values, count)
        upper = select(values, count // 2, count - 1, int(0.9 * count)) / DECILE
        out[j] = max(rungs.gain[j] * max(middle_value, upper), least)


@allocating
def read_noise(x, spikes, mask, rungs, floor, rest, sigma, sums, out):
    """Remove isolated samples from x, in place, and measure the noise of its responses.

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
    sums : array (n + 1,)
        Room to work in.
    out : array (rungs,), filled
    """
    for i in spikes:
        x[i] = 0.5 * (x[i - 1] + x[i + 1])
    kept, runs = np.empty(len(x)), np.empty((len(x) // 2 + 1, 2), np.int64)
    runs = runs[: _cut_out(x, mask, runs, kept)]
    running_sums(x, 0, len(x), sums)
    _put_back(x, runs, kept)
    _response_noise(sums, runs, rungs, floor, sigma, out)
    for j in range(len(out)):
        out[j] = max(out[j], rest)


@allocating
def noise_around(noise, at, least, out):
    """Noise of the span of row `at`, from those of neighbouring spans.

    The median; but a louder span counts for itself and the next ones, as responses at the border
    see the noise beyond it.
    """
    usual = np.empty(noise.shape[1])
    middle(noise, usual)
    for j in range(len(out)):
        out[j] = usual[j]
        for k in range(max(at - 1, 0), min(at + 2, len(noise))):
            if noise[k, j] > LOUDER * usual[j]:
                out[j] = max(out[j], noise[k, j])
        out[j] = max(out[j], least)
