"""Isolated samples in a sound: clicks of a cable or a lost word, not impacts.

If the sample is replaced by the mean of its two neighbours, an impact that begins there continues
to ring, and of a click nothing remains: the samples within 2 ms after it, and their second
differences, have at most twice the power of those before, or a hundredth of that of the click. Its
distance from the mean is more than three times the RMS of the differences, and more than the
difference of its neighbours: a sound that begins with a jump is not a click. The latter is at most
a fifth of the distance, or at most twice the usual difference before it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ..._compiling.compiled import njit
from ..signal.stream import Piece
from ._windows import Window

BESIDE = 2e-3  # [s]
SKIPPED = 3  # samples next to the click, which filters may smear it over
LEFT, STANDS_OUT = 2.0, 3.0  # power left, and distance in RMS of differences
NOTHING = 0.01  # of the power of the click
APART, USUAL = 5.0, 2.0  # times as far from its neighbours as these are; times as far as usual
FEWEST = 5  # impacts beside which others are clicks
RAREST = 3  # clicks: one or two may as well be impacts that begin so
MOST = 3  # times the number of others: if nearly all impacts are so short, they are impacts


@njit(nogil=True)
def stands_alone(x, i, beside):
    """Whether sample i is the only outlier within `beside` samples, and one more, of it."""
    middle = 0.5 * (x[i - 1] + x[i + 1])
    off = (x[i] - middle) ** 2
    if off == 0.0:
        return False
    count, before, after = beside - SKIPPED, 0.0, 0.0
    for j in range(SKIPPED, beside):
        earlier = x[i - j - 1] - 2.0 * x[i - j] + x[i - j + 1]
        later = x[i + j - 1] - 2.0 * x[i + j] + x[i + j + 1]
        before += earlier * earlier
        after += later * later
        if off * count <= STANDS_OUT**2 * max(before, after):  # nearly always soon
            return False
    early = late = slope = 0.0
    for j in range(SKIPPED, beside):
        early += (x[i - j] - middle) ** 2
        late += (x[i + j] - middle) ** 2
        slope += (x[i - j + 1] - x[i - j - 1]) ** 2
    nothing = NOTHING * off * count
    if after > max(LEFT * before, nothing) or late > max(LEFT * early, nothing):
        return False
    apart = (x[i + 1] - x[i - 1]) ** 2
    return apart < off and apart < max(off / APART**2, USUAL**2 * slope / count)


@njit(nogil=True)
def lone_samples(x, attacks, beside, reach, out):
    """out[k]: whether an isolated sample is at attacks[k], between two samples.

    It is the one within `reach` of it that is furthest from the mean of its neighbours.
    """
    for k in range(len(attacks)):
        first = max(int(attacks[k]) + 1 - reach, beside + 1)
        last = min(int(attacks[k]) + 2 + reach, len(x) - beside - 1)
        at, most = -1, 0.0
        for i in range(first, last):
            off = abs(x[i] - 0.5 * (x[i - 1] + x[i + 1]))
            if off > most:
                at, most = i, off
        out[k] = at >= 0 and stands_alone(x, at, beside)


@njit(nogil=True)
def all_lone_samples(x, first, last, beside, out):
    """out[i - first]: whether sample i is isolated."""
    for i in range(first, last):
        out[i - first] = stands_alone(x, i, beside)


def are_clicks(lone: np.ndarray) -> np.ndarray:
    """Impacts that are single samples, unless hardly any, or nearly all, are."""
    count, others = np.count_nonzero(lone), np.count_nonzero(~lone)
    few = others >= FEWEST and RAREST <= count <= MOST * others
    return lone if few else np.zeros(len(lone), bool)


def repairs(parts: Iterable[Window], rate: float) -> tuple[np.ndarray, np.ndarray]:
    """The isolated samples of a record, and the means of their neighbours."""
    beside = round(BESIDE * rate)
    places, values = [np.empty(0, np.int64)], [np.empty(0)]
    for window in parts:
        x, valid = window.samples(beside + 1, beside + 1, 1)
        first = max(beside + 1, valid[0] + beside + 1)
        last = min(beside + 1 + len(window.core), valid[1] - beside - 1)
        if first >= last:
            continue
        lone = np.empty(last - first, np.bool_)
        all_lone_samples(x, first, last, beside, lone)
        at = first + np.flatnonzero(lone)
        places.append(window.segment + window.first + at - (beside + 1))
        values.append(0.5 * (x[at - 1].astype(float) + x[at + 1]))
    return np.concatenate(places), np.concatenate(values)


def repaired(pieces: Iterable[Piece], places: np.ndarray, values: np.ndarray) -> Iterator[Piece]:
    """The pieces of a record with these samples replaced."""
    for first, samples in pieces:
        low, high = np.searchsorted(places, (first, first + len(samples)))
        kind = np.result_type(samples.dtype, np.float32)
        samples = samples.astype(kind, copy=bool(low < high))
        if low < high:
            samples[places[low:high] - first] = values[low:high]
        yield Piece(first, samples)
