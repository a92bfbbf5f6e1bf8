"""How likely an event of a force record is an impact: a local false discovery rate.

Events of height u, in standard deviations of their noise, and of width w are of two kinds. What
Gaussian noise makes of the samples is given: excursions of a sliding mean above u begin u^2 Q(u)
times a width, Q being the upper tail [Aldous1989]_, so that their density is the derivative of
that. How many widths there are to a sample was counted in white noise. What impacts make of
them is not given: a kernel estimate in ln u, each event around counted as much as it is likely an
impact, by expectation and maximisation; their widths are about the usual one, or any. An event is
no evidence of itself. The probability is the share of impacts in both densities, one less the
local false discovery rate [Efron2004]_.

The estimate begins with what is an impact whatever the others are, and is repeated a few times
only: from nothing but noise, chance would otherwise make impacts of the places where it is dense.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._compiled import njit

LOWEST = 4.0
"""Height from which on events are looked for."""
CLEAR = 10.0
"""Height at which an event is no noise, and its width is that of the impact."""
SEVERAL = 5
"""Clear events that show which width is usual."""
MOST, PER_WIDTH = 0.09, 0.5
"""Widths a sample and unit of ln w at which noise has its excursions: the latter over w, at most
the former. Counted in white noise of 20 minutes."""
WIDTH_ERROR, LEAST_SPREAD = 3.0, 0.15
"""Standard deviation of ln w, times the height; and the least from one impact to the next."""
OTHERS, OTHER_WIDTHS = 0.1, 7.0
"""Share of impacts of any width, and range of ln w that these are spread over."""
UNLIKE = math.log(3.0)
"""Beyond it from the usual one, in ln w, a clear width counts for the share of any width."""
SEEN, RANGE = 0.03, 4.0 * math.log(2.0)
"""Impacts that are assumed seen before any is, and range of ln u that these are spread over."""
BANDWIDTH, STEP, BINS = 0.3, 0.05, 50
"""Of the kernel in ln u; of the bins that it is laid over, and how many."""
ROUNDS = 5
_PLACES = STEP * (np.arange(BINS) + 0.5)
# What a kernel lays below the lowest height is laid back above it.
_KERNEL = np.exp(-0.5 * ((_PLACES[:, None] - _PLACES) / BANDWIDTH) ** 2)
_KERNEL += np.exp(-0.5 * ((_PLACES[:, None] + _PLACES) / BANDWIDTH) ** 2)
_KERNEL /= BANDWIDTH * math.sqrt(2.0 * math.pi)


class Crowd(NamedTuple):
    """What the events of some seconds are like."""

    samples: float
    width: float  # usual logarithm of a width
    spread: float  # its standard deviation from impact to impact
    others: float  # share of impacts of any width
    impacts: np.ndarray  # how many there are to a unit of ln u, by bins


@njit(nogil=True)
def excursions(u: float) -> float:
    """Excursions to a unit of ln u that noise makes in a width, -u d/du (u^2 Q(u))."""
    density = math.exp(-0.5 * u * u) / math.sqrt(2.0 * math.pi)
    return max(u * u * (u * density - math.erfc(u / math.sqrt(2.0))), 1e-300)


@njit(nogil=True)
def _noise_over_width(crowd: Crowd, u: float, width: float) -> float:
    """Density of noise at a height and a width, over that of impacts at the width."""
    noise = crowd.samples * min(MOST, PER_WIDTH / width) * excursions(u)
    error = math.hypot(crowd.spread, WIDTH_ERROR / u)
    off = (math.log(width) - crowd.width) / error
    usual = math.exp(-0.5 * off * off) / (error * math.sqrt(2.0 * math.pi))
    return noise / ((1.0 - crowd.others) * usual + crowd.others / OTHER_WIDTHS)


@njit(nogil=True)
def _bin(u: float) -> int:
    return min(int(math.log(max(u, LOWEST) / LOWEST) / STEP), BINS - 1)


@njit(nogil=True)
def probabilities(u: np.ndarray, widths: np.ndarray, samples: float, out: np.ndarray) -> Crowd:
    """Fill `out` with the probability of each event; what they are like together.

    Parameters
    ----------
    u, widths : arrays (n,)
        Heights in standard deviations of the noise, and widths [samples], of all events there are.
    samples : float
        How many samples they were found in.
    out : array (n,), filled
    """
    logs = np.log(widths[u >= CLEAR])
    width, spread, others = 0.0, LEAST_SPREAD, 1.0
    if len(logs) >= SEVERAL:
        width = np.median(logs)
        off = np.abs(logs - width)
        spread = max(LEAST_SPREAD, 1.4826 * np.median(off))
        others = min(1.0, OTHERS + np.count_nonzero(off > UNLIKE) / len(off))
    crowd = Crowd(samples, width, spread, others, np.full(BINS, SEEN / RANGE))
    places, noise = np.empty(len(u), np.int64), np.empty(len(u))
    for k in range(len(u)):
        places[k] = _bin(u[k])
        noise[k] = _noise_over_width(crowd, u[k], widths[k])
        out[k] = 1.0 / (1.0 + noise[k] / crowd.impacts[places[k]])
    seen = np.empty(BINS)
    for _ in range(ROUNDS):
        seen[:] = 0.0
        for k in range(len(u)):
            seen[places[k]] += out[k]
        for i in range(BINS):
            crowd.impacts[i] = SEEN / RANGE
            for j in range(BINS):
                crowd.impacts[i] += _KERNEL[i, j] * seen[j]
        for k in range(len(u)):
            i = places[k]
            impacts = crowd.impacts[i] - _KERNEL[i, i] * out[k]
            out[k] = 1.0 / (1.0 + noise[k] / max(impacts, SEEN / RANGE))
    return crowd


@njit(nogil=True)
def level_of(crowd: Crowd, width: float, least: float) -> float:
    """Height above which events of a width are impacts with the probability `least`."""
    u = LOWEST * math.exp(STEP * BINS)
    while u > LOWEST:
        lower = u * math.exp(-0.2 * STEP)
        impacts = crowd.impacts[_bin(lower)]
        if impacts < least * (impacts + _noise_over_width(crowd, lower, width)):
            return u
        u = lower
    return LOWEST
