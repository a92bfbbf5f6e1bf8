"""Probability that a faint crest is an impact: a local false discovery rate.

Where several impacts are certain, their width is the usual one, and the responses of this one width
are looked at again for fainter ones, with a lower threshold. Crests of height u, in standard
deviations of their noise, are impacts or not. What is no impact is as likely to point down as up
in the record's noise, whatever its distribution, so the downward crests show how many upward ones
are none: their number above the lowest height, and the mean excess of u^2 / 2 over that there. The
excess is exponentially distributed, in white noise with a mean of 1; longer tails have a greater
one. Both are drawn to what white noise has, as few crests say little. What impacts make is a kernel
estimate in ln u, each crest counted as much as it is likely an impact, by expectation and
maximisation; a crest is no evidence of itself. Such an estimate is too low at the top of a density
and too high on its slopes, so it is multiplied by a second one, of the crests over the first
[Jones1995]_. Below all that are certain it says little; there the density is at least what follows
from the lowest of these, if it is a power of u. The probability is the share of impacts in both
densities, one less the local false discovery rate [Efron2004]_.
"""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import allocating, kernel, njit
from .order_kernels import quantile

LOWEST = 3.2
"""Height from which on crests are looked for, in standard deviations of their noise."""
HIGHEST = 1e6
"""Height beyond which all are alike: without noise, squares of heights may be no numbers."""
CRESTS = 1.9e-3
"""For each width of the response, of three samples and more: what is counted in white noise less a
seventh, which the flanks of impacts draw down and noise that is read a little high leaves out."""
GAUSSIAN = 0.98
"""Mean excess of u^2 / 2 over that at LOWEST, in white noise."""
PRIOR, OTHERWISE = 25.0, 5.0
"""Crests that the expectations for white noise count as, beside those seen: their mean excess, and
their number, which other noise has half or twice of."""
LEFT = 0.9
"""Share of the crests of noise that is then measured as pulses (`judging_kernels.consistent`)."""
ABOUT = 3.0
"""Times as wide or narrow as the usual width: an event of it or not."""
EACH, FINE = 4.5, 6.0
"""Widths that are independent in an e-fold of widths, each refined to a quarter of an octave; width
[samples] below which narrower ones have no more crests."""
SEEN, RANGE = 0.001, 4.0 * math.log(2.0)
"""Impacts that are assumed seen before any is, and range of ln u that these are spread over."""
TAIL, FEWEST = 0.1, 5.0
"""Share of the certain impacts, the lowest, that show how their number falls with the height below
them, and how many these are at least."""
BANDWIDTH, STEP, BINS = 0.3, 0.07, 50
"""Of the kernel in ln u; of the bins that it is laid over, and how many."""
WIDER, MOST = 0.7, 20.0
"""Bandwidth of an estimate from the certain impacts alone, and times it that impacts are at most:
a few high crests of noise, far below all impacts, are no evidence of each other."""
OWN = 1.29
"""Times its kernel that a crest adds to the corrected estimate where it lies, 2 - 1 / sqrt(2)."""
ROUNDS, SETTLED = 20, 1e-3
"""Of expectation and maximisation, at most; change of a probability that ends them."""
TINIEST = 1e-300
_PLACES = STEP * (np.arange(BINS) + 0.5)
# What a kernel lays below the lowest height is laid back above it.
_KERNEL = np.exp(-0.5 * ((_PLACES[:, None] - _PLACES) / BANDWIDTH) ** 2)
_KERNEL += np.exp(-0.5 * ((_PLACES[:, None] + _PLACES) / BANDWIDTH) ** 2)
_KERNEL /= BANDWIDTH * math.sqrt(2.0 * math.pi)
_WIDER = np.exp(-0.5 * ((_PLACES[:, None] - _PLACES) / WIDER) ** 2)
_WIDER /= WIDER * math.sqrt(2.0 * math.pi)


@kernel
def excursions(u: float) -> float:
    """Excursions above u of Gaussian noise for each width of a sliding mean, u^2 Q(u).

    Q is the upper tail [Aldous1989]_.
    """
    return u * u * 0.5 * math.erfc(u / math.sqrt(2.0))


@kernel
def trials_about(width: float) -> float:
    """Times as many ways to be noise has an event that was looked for at all widths about one.

    These are a third to three times the width [samples]; each has as many trials as it goes into
    the time, in samples that narrow ones do not fill.
    """
    lowest = max(width / ABOUT, 1.0)
    narrow = width / FINE * max(math.log(FINE / lowest), 0.0)
    return EACH * (narrow + width / max(lowest, FINE) - 1.0 / ABOUT)


@njit(nogil=True)
def probabilities(
    upward: np.ndarray,
    downward: np.ndarray,
    certain: np.ndarray,
    widths_up: float,
    widths_down: float,
    trials_up: float,
    trials_certain: float,
    out: np.ndarray,
) -> None:
    """Probability of each upward crest to be an impact, then of each certain impact.

    Parameters
    ----------
    upward, downward : arrays (n,), (m,)
        Heights of the crests, all above LOWEST, outside of what was found for certain.
    certain : array (k,)
        Heights of what was found at any width.
    widths_up, widths_down : float
        How many widths of the response the time holds that either crests were found in.
    trials_up, trials_certain : float
        Times as many ways to be noise have these crests as those of one width.
    out : array (n + k,), filled
    """
    excess = PRIOR * GAUSSIAN
    for u in downward:
        excess += 0.5 * (u * u - LOWEST * LOWEST)
    excess = max(excess / (PRIOR + len(downward)), 0.9)
    share = (OTHERWISE + len(downward)) / (OTHERWISE + CRESTS * widths_down)
    count = share * CRESTS * widths_up
    n = len(upward)
    lowest, spread, top = _tail(certain)
    u = np.concatenate((upward, certain))
    places, noise = np.empty(len(u), np.int64), np.empty(len(u))
    for k in range(len(u)):
        u[k] = min(u[k], HIGHEST)
        places[k] = max(0, min(int(math.log(u[k] / LOWEST) / STEP), BINS - 1))
        over = 0.5 * (u[k] * u[k] - LOWEST * LOWEST)
        noise[k] = count / excess * u[k] * u[k] * math.exp(-over / excess)
        noise[k] *= trials_up if k < n else trials_certain
        out[k] = 0.0 if k < n else 1.0
    seen, first, impacts, most = np.empty(BINS), np.empty(BINS), np.empty(BINS), np.empty(BINS)
    seen[:] = 0.0
    for k in range(n, len(u)):
        seen[places[k]] += MOST
    _spread(_WIDER, seen, most)
    for _ in range(ROUNDS):
        seen[:] = 0.0
        for k in range(len(u)):
            seen[places[k]] += out[k]
        _spread(_KERNEL, seen, first)
        for i in range(BINS):
            seen[i] /= max(first[i], TINIEST)
        _spread(_KERNEL, seen, impacts)
        for i in range(BINS):
            impacts[i] = min(impacts[i] * first[i], most[i])
        change = 0.0
        for k in range(len(u)):
            i = places[k]
            others = max(impacts[i] - OWN * _KERNEL[i, i] * out[k], SEEN / RANGE)
            if k < n and u[k] < top:
                off = 1.0 + math.log(top / u[k]) / spread
                others = max(others, lowest**2 / spread * off ** (-1.0 - lowest))
            before, out[k] = out[k], others / (others + noise[k])
            change = max(change, abs(out[k] - before))
        if change < SETTLED:
            break
    for k in range(n):
        out[k] /= out[k] + LEFT * (1.0 - out[k])


@allocating
def _tail(certain: np.ndarray) -> tuple[int, float, float]:
    """How many the lowest certain impacts are, the sum of their distances in ln u, and from where.

    If their number falls with a power of u below there, the distances are exponential
    [Hill1975]_; those of others, whatever the power, then follow a Pareto distribution of Lomax.
    """
    top = quantile(certain, max(TAIL, min(FEWEST / max(len(certain), 1), 1.0)))
    lowest, spread = 0, 0.0
    for u in certain:
        if u < top:
            lowest += 1
            spread += math.log(top / u)
    return lowest, spread, top if lowest else 0.0


@kernel
def _spread(kernel: np.ndarray, counts: np.ndarray, out: np.ndarray) -> None:
    """Kernel density estimate of counts per bin."""
    out[:] = 0.0
    for j in range(BINS):
        if counts[j] > 0.0:
            for i in range(BINS):
                out[i] += kernel[j, i] * counts[j]
