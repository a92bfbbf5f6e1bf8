"""Kernels for the likelihood of a rise in one octave, from the highest down to about 170 Hz."""

from __future__ import annotations

import numpy as np

from ..signal.order_kernels import select
from ._kernels import BLOCK, STEP, halve_and_square
from ._lane_kernels import fused

LOW = 3  # octaves below those that a frame has a coefficient of
DEEPEST = 2**LOW  # frames of a coefficient of the lowest
PART = 32  # frames that share one power
LOCAL = 16  # PARTs in and beside a BLOCK whose median is usual there


@fused
def low_powers(x, left, even, odd, high, out, means):
    """out[k, j]: square of coefficient j of the k-th octave below the rate of x.

    Row k of `out` is filled with len(x) / 2^(k+1) values, and means[k] with the means of PARTs
    from x[left] on. `even`, `odd` and `high` are scratch of half the length of x.
    """
    count, per, first = len(x) // 2, PART // 2, left // 2
    halve_and_square(x, high, even[:count], 1, out[0, :count])
    for k in range(out.shape[0]):
        for g in range(means.shape[1]):
            total = 0.0
            for j in range(first + g * per, first + (g + 1) * per):
                total += out[k, j]
            means[k, g] = total / per
        if k == out.shape[0] - 1:
            break
        count, per, first = count // 2, per // 2, first // 2
        halve_and_square(even, high, odd[:count], 1, out[k + 1, :count])
        even, odd = odd, even


@fused
def usual_power(parts, first, block, least, near):
    """Median of LOCAL parts about a BLOCK, or `least` if that is more.

    The first part of BLOCK 0 is parts[first]; beyond their ends the last ones go on. `near` is
    scratch of LOCAL.
    """
    begin, last = first + block * (BLOCK // PART) + (BLOCK // PART - LOCAL) // 2, len(parts) - 1
    more = 0
    for i in range(LOCAL):
        near[i] = parts[min(max(begin + i, 0), last)]
        more += near[i] > least
    return select(near, 0, LOCAL - 1, LOCAL // 2) if more >= LOCAL - LOCAL // 2 else least


@fused
def raise_likelihood(after, before, per, parts, first, bias, background, freedom, clear, out):
    """Raise `out` to the likelihood of a rise from each `before` to `after`, in one octave.

    Ratios that are not `clear` are no rises. `background` has a power for `per` values, a BLOCK,
    where what is usual in `parts` counts as well. `out` has as many values, or twice as many.
    """
    same, half, count = -(-len(out) // len(after)), 0.5 * freedom, len(after)
    near = np.empty(LOCAL)
    for block in range(-(-count // per)):
        begin, end = block * per, min((block + 1) * per, count)
        now, then, least = after[begin:end], before[begin:end], background[block]
        if not clear_rises(now, then, least, clear):
            continue
        usual = usual_power(parts, first, block, least * bias, near) / bias
        if usual > least:
            least = usual
            if not clear_rises(now, then, least, clear):
                continue
        for i in range(begin, end):
            base = before[i] if before[i] > least else least
            if after[i] > clear * base and base > 0.0:
                ratio = after[i] / base
                likelihood = half * (ratio - 1.0 - np.log(ratio))
                for j in range(same * i, min(same * (i + 1), len(out))):
                    out[j] = max(out[j], likelihood)


@fused
def clear_rises(after, before, least, clear):
    """At how many places `after` is `clear` times what was `before`, at least `least`."""
    rises = 0
    for i in range(np.uint64(len(after))):
        base = before[i] if before[i] > least else least
        rises += after[i] > clear * base
    return rises


@fused
def low_likelihood(power, left, size, width, parts, first, bias, background, freedom, clear, out):
    """Raise out[i] to the likelihood of a rise in an octave of `size` frames a coefficient.

    power[left] is that of frame 0. The mean of `width` from a frame on, weighted by a line that
    falls to zero, is compared with that of as many before it. The others are as above.
    """
    stride, same = max(STEP // size, 1), max(size // STEP, 1)
    count, whole = -(-len(out) // same), 0.5 * width * (width + 1.0)
    after, before = np.zeros(count), np.zeros(count)
    every = np.empty((stride, len(power) // stride))  # what is `stride` apart lies side by side
    for k in range(stride):
        for i in range(every.shape[1]):
            every[k, i] = power[stride * i + k]
    for k in range(width):
        weight, share = (width - k) / whole, 1.0 / width
        at = left + k
        later = every[at % stride, at // stride : at // stride + count]
        at = left - 1 - k
        earlier = every[at % stride, at // stride : at // stride + count]
        for i in range(count):
            after[i] += weight * later[i]
            before[i] += share * earlier[i]
    raise_likelihood(
        after, before, BLOCK // (STEP * same), parts, first, bias, background, freedom, clear, out
    )


@fused
def rise_likelihood(
    every, low, left, size, width, parts, first, bias, background, freedom, clear, out
):  # fmt: skip
    """Raise out[i] to the likelihood of a rise at frame STEP i in one of the octaves.

    `every` are the mean powers after and before these frames; the low octaves, of size[k] frames a
    coefficient and width[k] of these a mean, have the powers low[k], from `left` frames before the
    first frame on. The first part of BLOCK 0 is parts[:, first].
    """
    octaves = every.shape[1]
    for b in range(octaves):
        raise_likelihood(
            every[0, b], every[1, b], BLOCK // STEP, parts[b], first, bias[b], background[b],
            freedom[b], clear[b], out,
        )  # fmt: skip
    for k in range(len(size)):
        b = octaves + k
        low_likelihood(
            low[k], left // size[k], size[k], width[k], parts[b], first, bias[b], background[b],
            freedom[b], clear[b], out,
        )  # fmt: skip
