"""Kernels for `_tones.py`: log-odds of low tones, and where they begin."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...signal.order_kernels import select
from .._nearby_kernels import ends_about, greatest_beside
from .crest_kernels import LEAST_OCTAVES

SLOPES = 0.7, 1.7, 5.4, 1.5  # of ln G, ln B, ln(G_1/2 + 5), ln B_max
OFFSET = 12.1
LEAST_MEDIAN, LEAST_LOUD = 5.0, 0.15
NOISE = 24.0  # G that noise reaches once in a hundred hours
FAINTEST = 20.0  # G, below which the odds are hopeless
SWELLING, PER_CREST, MOST_CRESTS = 10.0, 2.0, 5.0  # G that few noises reach; more for each, at most
AFTER, SWELL, SWELL_SLOPE = 16e-3, 0.1, 40.0  # [s], share of G left then, and odds for more
SPREAD = 2e-3  # [s], of the impact about its place


@allocating
def put_tone_odds(crest, weak, g, b, silent, reach, least, out):
    """Log-odds of crests of G, relative to all within `reach`; -inf if no more than `least`.

    Parameters
    ----------
    crest, weak : indices of `g`, which is G of each frame: crests above FAINTEST, and all others
        above SWELLING
    b, silent : B of each frame, and whether it is digital silence
    reach : frames in a second
    least : (n,) log-odds that are of no use
    out : (n,) room for the log-odds
    """
    ln_g, ln_b, ln_median, ln_loud = SLOPES
    size, after = min(2 * reach + 1, len(g)), round(AFTER * reach)
    low, high = np.empty(len(crest), np.int64), np.empty(len(crest), np.int64)
    ends_about(weak, crest, reach, reach + 1.0, low, high)
    room = np.empty(size)
    for k in range(len(crest)):
        own, first = g[crest[k]], min(max(crest[k] - reach, 0), len(g) - size)
        swells = PER_CREST * min(0.5 * (high[k] - low[k]), MOST_CRESTS)
        loudest = 0.0
        for i in range(max(first - 2, 0), min(first + size + 2, len(b))):
            loudest = max(loudest, b[i])
        later = g[min(crest[k] + after, len(g) - 1)] / own
        beside = greatest_beside(b, crest[k], 2)
        odds = ln_g * np.log(own) + ln_b * np.log(beside) + OFFSET
        odds -= ln_loud * np.log(max(loudest, LEAST_LOUD))
        odds -= SWELL_SLOPE * max(later - SWELL, 0.0)
        most = own - NOISE - swells
        out[k] = -np.inf
        if min(odds - ln_median * np.log(LEAST_MEDIAN), most) > least[k]:
            usual = usual_likelihood(g[first : first + size], silent[first : first + size], room)
            out[k] = min(odds - ln_median * usual, most)


@kernel
def usual_likelihood(g, silent, room):
    """ln(G_1/2 + 5) of frames.

    With digital silence it is the mean of that and of that of the others. There is `room` for all.
    """
    count = 0
    for i in range(len(g)):
        room[i] = g[i]
    usual = np.log(select(room, 0, len(g) - 1, len(g) // 2) + LEAST_MEDIAN)
    for i in range(len(g)):
        if not silent[i]:
            room[count] = g[i]
            count += 1
    if count == len(g):
        return usual
    heard = select(room, 0, count - 1, count // 2) if count else 0.0
    return 0.5 * (usual + np.log(heard + LEAST_MEDIAN))


@allocating
def put_onsets(place, height, audible, near, seconds, frame, off):
    """Frame at which each low tone begins, and the error of that [s].

    Crests of C within three SPREAD are as likely as they are high, and as a normal distribution
    about `near`. No crest is as likely as one of LEAST_OCTAVES there: if none is audible, the tone
    begins there.
    """
    reach = 3.0 * SPREAD / seconds
    first, last = np.empty(len(near), np.int64), np.empty(len(near), np.int64)
    ends_about(place, near, reach, reach, first, last)
    likely = np.zeros(len(place))
    for k in range(len(near)):
        most, best = 0.0, -1
        for i in range(first[k], last[k]):
            away = seconds * (place[i] - near[k]) / SPREAD
            likely[i] = height[i] * np.exp(-0.5 * away**2) if height[i] >= audible else 0.0
            if likely[i] > most:
                most, best = likely[i], i
        if most < LEAST_OCTAVES * audible:
            frame[k], off[k] = np.int64(max(near[k], 0.0)), SPREAD
            continue
        squares = total = 0.0
        for i in range(first[k], last[k]):
            squares += likely[i] * (seconds * (place[i] - place[best])) ** 2
            total += likely[i]
        frame[k], off[k] = place[best], np.sqrt(squares / total)
