"""Kernels for `_octave_evidence.py`: rattle around crests of C, and their evidence beside it."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._kernels import BLOCK, SAMPLED
from .crest_kernels import NEARBY, heights_reached

QUANTILES, TIMES = (0.75, 0.9), (50.0, 12.0)  # of C, and times these
ABOVE, IN_NOISE = 50.0, 0.75  # times what such a crest is above so many s
FEW = 4.0  # times a: rattle without a number of crests, as of a room that rings
TAIL, STEADY = 0.3, 0.1  # of the greatest C nearby and of the rattle: nor more than their sum
CERTAIN = 36.0  # likelihood of a rise in one narrow band that is evidence of 1
BESIDE_BAND = 0.25  # times a: rise in octaves without which that counts little
FAINT = 0.3  # evidence of nothing


@allocating
def put_evidence(
    place, height, bands, borne_out, likelihood, loudest, clear, greatest, first, last, order,
    silence, rattle, audible, in_noise, reach, out,
):  # fmt: skip
    """Evidence of `Crests` in such `rattle`, with crests of up to `in_noise` in noise.

    `reach` is NEARBY in GROUPs.
    """
    count = len(place)
    certain, reached = np.zeros(count), np.empty(count)
    near = np.empty(count, np.bool_)
    for k in range(count):
        if greatest[k] and np.isfinite(likelihood[k]):
            certain[k] = likelihood[k] / CERTAIN
        near[k] = min(clear[k] / audible + certain[k], borne_out[k]) >= FAINT
        out[k] = 0.0
    heights_reached(
        place, height, order, first, last, silence, reach, NEARBY, near, reached,
    )  # fmt: skip
    for k in range(count):
        if near[k]:
            about = rattle[place[k] // BLOCK]
            without_crowd = min(FEW * audible, TAIL * loudest[k] + STEADY * about)
            about = min(about, max(without_crowd, ABOVE * (reached[k] - in_noise)))
            by_band = clear[k] / (BESIDE_BAND * audible + about)
            calm = min(clear[k] / (audible + about) + certain[k], by_band)
            out[k] = min(calm, borne_out[k])


@kernel
def put_ranks(silent, reach, first, last, rank):
    """The QUANTILES of what is not `silent`, at most `reach` from each BLOCK.

    They are those of such a rank among the samples from `first` to before `last`.
    """
    per = BLOCK // SAMPLED
    begin, end, low, high = 0, 0, 0, 0  # samples, and how many of those before are heard
    for k in range(len(first) // len(QUANTILES)):
        while begin < per * (k - reach):
            low += not silent[begin]
            begin += 1
        while end < min(per * (k + reach + 1), len(silent)):
            high += not silent[end]
            end += 1
        for i in range(len(QUANTILES)):
            at = len(QUANTILES) * k + i
            first[at], last[at], rank[at] = low, high, int(QUANTILES[i] * (high - low))


@kernel
def put_greatest(levels, out):
    """The greatest of the QUANTILES of each BLOCK, each so many TIMES."""
    for k in range(len(out)):
        out[k] = 0.0
        for i in range(len(TIMES)):
            out[k] = max(out[k], np.float32(TIMES[i]) * levels[len(TIMES) * k + i])
