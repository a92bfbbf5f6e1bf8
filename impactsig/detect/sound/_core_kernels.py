"""Kernels for the cores of a record: extremes, the step of a converter, the least noise."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit
from ..signal.order_kernels import centre_of
from .powers.band_kernels import ALMOST, TIMES_BACKGROUND

BLOCKS, LEAST, GREATEST, RESOLUTION, CONVERTER_STEP = range(5)  # columns of what is known of cores
TOGGLING = 0.25  # greatest variance, in squared steps, of a sample that is one of two codes
ROUNDING = 2.0**-20  # of the greatest sample: less is leakage, and rounding of the transform
CHANGES = 50  # of a sample to the next, that show the step of a converter
SIDE_BY_SIDE = 64  # samples that are checked in vector lanes


@njit(nogil=True)
def extremes(x):
    """Least and greatest sample, and the least nonzero difference of two in a row.

    That is infinite if hardly any differ.
    """
    changes, done = 0, 1
    steps = np.full(SIDE_BY_SIDE, np.inf)
    low, high = np.full(SIDE_BY_SIDE, np.float64(x[0])), np.full(SIDE_BY_SIDE, np.float64(x[0]))
    for i in range(1, len(x) - SIDE_BY_SIDE + 1, SIDE_BY_SIDE):
        now, before = x[i : i + SIDE_BY_SIDE], x[i - 1 : i - 1 + SIDE_BY_SIDE]
        for k in range(SIDE_BY_SIDE):
            value = np.float64(now[k])
            step = abs(value - before[k])
            changes += step > 0.0
            steps[k] = step if 0.0 < step < steps[k] else steps[k]
            low[k] = value if value < low[k] else low[k]
            high[k] = value if value > high[k] else high[k]
        done = i + SIDE_BY_SIDE
    step, least, greatest = steps.min(), low.min(), high.max()
    for i in range(done, len(x)):
        value = np.float64(x[i])
        least, greatest = min(least, value), max(greatest, value)
        away = abs(value - x[i - 1])
        if away > 0.0:
            changes += 1
            step = min(step, away)
    return least, greatest, step if changes >= CHANGES else np.inf


@njit(nogil=True)
def put_cores(x, per, blocks, resolution, out):
    """Put what is known of each core, of `per` samples in so many blocks, in its row of `out`."""
    for k in range(len(out)):
        core = x[k * per : (k + 1) * per]
        out[k, BLOCKS], out[k, RESOLUTION] = -(-len(core) * blocks // per), resolution
        out[k, LEAST], out[k, GREATEST], out[k, CONVERTER_STEP] = extremes(core)


@njit(nogil=True)
def limits_of(cores):
    """Least and greatest sample of some cores, and the step of the converter."""
    least, greatest, step = np.inf, -np.inf, np.inf
    for k in range(len(cores)):
        least, greatest = min(least, cores[k, LEAST]), max(greatest, cores[k, GREATEST])
        step = min(step, cores[k, CONVERTER_STEP])
    return least, greatest, step


@njit(nogil=True)
def count_equal(x, every, value, other):
    """How many samples, of which one in so many is looked at, equal a value, and another."""
    count = others = 0
    for i in range(np.uint64(0), np.uint64(len(x)), np.uint64(every)):
        count += x[i] == value
        others += x[i] == other
    return count, others


@njit(nogil=True)
def reaching(blocks, which, within):
    """First and end of the stretches, of so many blocks each, that lie `within` some of one."""
    begin, end, before, after = which, which + 1, 0, 0
    while begin > 0 and before < within:
        begin -= 1
        before += blocks[begin]
    while end < len(blocks) and after < within:
        after += blocks[end]
        end += 1
    return begin, end


@njit(nogil=True)
def put_near(cores, first, within, near, spans):
    """What lies `within` some blocks of each core, from the first on.

    near[k] are the first and the end of the cores, spans[:, k] those of the blocks. Returns the
    block at which the first core begins.
    """
    blocks, total = np.empty(len(cores), np.int64), 0
    for i in range(len(cores)):
        blocks[i] = cores[i, BLOCKS]
        total += blocks[i]
    at = blocks[:first].sum()
    start = at
    for k in range(len(near)):
        end = start + blocks[first + k]
        near[k] = reaching(blocks, first + k, within)
        spans[0, k], spans[1, k] = max(start - within, 0), min(end + within, total)
        start = end
    return at


@njit(nogil=True)
def bound_noise(noise, cores, near, gains, leakage, out, unresolved):
    """out[:, k]: noise of core k, at least that of rounding and of the steps of a converter.

    Rows are the octaves, of which white noise of power 1 has `gains`, the low octaves, and narrow
    bands, of which it has `leakage`. The extremes, resolution and step are those of the `cores`
    from near[k, 0] to before near[k, 1]. unresolved[k]: whether steps hide the noise of octaves.
    Returns whether they do in any.
    """
    octaves, bands = len(gains), len(noise) - len(leakage)
    room = np.empty(octaves)
    room[:] = gains
    middle_gain = centre_of(room, octaves)
    for k in range(noise.shape[1]):
        size, resolution, step = -np.inf, 0.0, np.inf
        for i in range(near[k, 0], near[k, 1]):
            size = max(size, max(-cores[i, LEAST], cores[i, GREATEST]))
            resolution = max(resolution, cores[i, RESOLUTION])
            step = min(step, cores[i, CONVERTER_STEP])
        toggling = TOGGLING * step**2 if step < np.inf else 0.0
        rounding, rounded = (resolution * size) ** 2, (ROUNDING * size) ** 2
        for b in range(octaves):
            room[b] = noise[b, k]
            out[b, k] = max(noise[b, k], max(toggling * gains[b], rounding))
        unresolved[k] = centre_of(room, octaves) < toggling * middle_gain / 3.0
        # White noise of rounding or of a step is about as strong in the next octaves.
        for b in range(octaves, bands):
            out[b, k] = max(noise[b, k], max(rounding, toggling * gains[octaves - 1]))
        for b in range(bands, len(noise)):
            least = max(rounded, toggling) * leakage[b - bands]
            out[b, k] = max(noise[b, k], least)
    return unresolved.any()


@njit(nogil=True)
def put_narrow(noise, means, spans, out):
    """Put the noise of narrow bands (bands, cores) and their greatest means in `out`.

    Those nearby all cores are from spans[0, 0] to before spans[1, -1]. `out` is (cores, 2, bands).
    """
    for b in range(len(noise)):
        greatest = 0.0
        for i in range(spans[0, 0], spans[1, -1]):
            greatest = max(greatest, means[b, i])
        for k in range(noise.shape[1]):
            out[k, 0, b], out[k, 1, b] = noise[b, k], greatest


@njit(nogil=True)
def mean_square(noise, gains):
    """Mean square of the samples in the octaves, from the noise of these (cores, octaves).

    The noise of an octave is the median over the cores; white noise of power 1 has `gains`.
    """
    total, room = 0.0, np.empty(len(noise))
    for b in range(noise.shape[1]):
        room[:] = noise[:, b]
        total += centre_of(room, len(room)) / (gains[b] * 2.0 ** (1 + b))
    return total


@njit(nogil=True)
def may_hum(bounded, noise, crests):
    """Whether crests of hum may count in an octave of a core.

    `bounded` is the noise of octaves (octaves, cores), `noise` that of the bands below them, for
    which noise of power 1 has `crests` (octaves, bands) in the octaves.
    """
    for k in range(noise.shape[1]):
        for b in range(crests.shape[0]):
            total = 0.0
            for i in range(crests.shape[1]):
                total += crests[b, i] * noise[i, k]
            if total > ALMOST * TIMES_BACKGROUND * bounded[b, k]:
                return True
    return False
