"""The shape that impacts of one machine share, and each of them measured with it.

Skew, flatness, power and length of the edges and the difference of their powers are taken as
normally distributed over the pulses of one span. Mean and spread are estimated from all of them
(empirical Bayes), each pulse being linear about its fit: clear pulses show the shape, and faint
ones are measured with it.
"""

from __future__ import annotations

import numpy as np

from ._pulse_errors import WIDER
from ._shared_shape_kernels import estimate_shape

LEAST = 5
"""Pulses that a shape is read from."""
ROUNDS = 8
MEAN = np.array([0.0, -3.0, 0.0, 0.0, 0.0])
ABOUT = np.array([0.5, 2.0, 0.25, 0.7, 0.3])
"""What the mean shape is drawn from; the length is about that of the matched responses."""
SPREAD, WEIGHT = np.array([0.1, 0.5, 0.05, 0.04, 0.05]), 2.0
"""Standard deviation of shapes to begin with, and how many pulses it counts as."""
UNLIKE = 0.3
"""Part of the mean shape's uncertainty that is misfit, from which on no shape is shared."""
BENT = 0.35
"""Of the way that an instant is moved by: the standard error of taking the fit to be linear."""
SHAPE = np.zeros((5, WIDER))
SHAPE[0, [2, 4]] = 1.0, -1.0
SHAPE[1, [2, 3, 4]] = -0.5, 1.0, -0.5
SHAPE[2, 5] = 1.0
SHAPE[3, [2, 4]] = 0.5
SHAPE[4, 6] = 1.0
"""Shape from the parameters of `_pulse_errors.WIDER`."""

# Columns of what is kept of a fit.
START, MISFIT, UNIT, EDGE, BESIDE, FITTED = 0, 1, 2, 3, 4, 7
SCORE = FITTED + WIDER - 1
SQUARE = SCORE + WIDER
KEPT = SQUARE + WIDER * WIDER


def share_shape(rows: np.ndarray, errors: int, fit: int, timed: bool) -> None:
    """Measure the pulses of `rows` anew, in place, each by the shape that they share.

    Parameters
    ----------
    rows : ndarray
        As `impactsig.detect._pulse.measure_all` fills them.
    errors, fit : int
        First columns of the standard errors, and of what is kept of a fit.
    timed : bool
        Contact times are those from first to last touch.
    """
    kept = rows[:, fit:]
    alike = np.flatnonzero((rows[:, 5] == 0) & (rows[:, 6] == 0) & (kept[:, START] == rows[:, 0]))
    if len(alike) < LEAST:
        return
    kept = kept[alike]
    count = len(kept)
    loose = 1.0 + kept[:, MISFIT]
    square = kept[:, SQUARE:].reshape(count, WIDER, WIDER) / loose[:, None, None]
    score = kept[:, SCORE:SQUARE] / loose[:, None]
    fitted = np.zeros((count, WIDER))
    fitted[:, :-1] = kept[:, FITTED:SCORE]
    square = square + 1e-9 * np.eye(WIDER)
    first = fitted @ SHAPE.T
    about = MEAN.copy()
    about[3] = np.median(kept[:, EDGE])
    step, covariance, explained, weight, uncertain = estimate_shape(
        square, score, first, SHAPE, about, ABOUT, SPREAD, WEIGHT, ROUNDS
    )
    # What no member of the family follows is the same in all: it does not average out.
    weights = np.maximum(len(SHAPE) - explained @ weight, 0.0)
    alone = np.sqrt(weights * kept[:, MISFIT] / loose).sum() ** 2 / max(weights.sum(), 1e-9)
    if alone > UNLIKE:
        return
    old, new = fitted, fitted + step
    new[:, 2:] = np.clip(new[:, 2:], old[:, 2:] - 1.0, old[:, 2:] + 1.0)
    by_mean = covariance @ (SHAPE.T * weight)
    covariance = covariance + by_mean @ uncertain @ by_mean.transpose(0, 2, 1)
    _measure(rows, alike, kept, old, new, covariance, errors, timed)


def _measure(
    rows: np.ndarray,
    alike: np.ndarray,
    kept: np.ndarray,
    old: np.ndarray,
    new: np.ndarray,
    covariance: np.ndarray,
    errors: int,
    timed: bool,
) -> None:
    """Write instants, contact times and peaks, and their errors, of the parameters `new`."""
    lengths = np.exp(new[:, 2:5])
    contact = lengths.sum(axis=1)
    moved, before = new[:, 1] - old[:, 1], np.exp(old[:, 2:5]).sum(axis=1)
    near = (np.abs(moved) < 0.5 * before) & (contact > 0.5 * before) & (contact < 2.0 * before)
    near &= (new[:, 0] > 0.5 * old[:, 0]) & (new[:, 0] < 2.0 * old[:, 0])
    near &= rows[alike, 0] + moved >= 0.0
    alike, moved, contact, lengths = alike[near], moved[near], contact[near], lengths[near]
    new, kept, covariance = new[near], kept[near], covariance[near]
    beside = kept[:, BESIDE:FITTED]
    by_length = np.zeros((len(new), WIDER))
    by_length[:, 2:5] = lengths
    rows[alike, 0] += moved
    rows[alike, errors] = np.sqrt(covariance[:, 1, 1] + beside[:, 0] + (BENT * moved) ** 2)
    if timed:
        length = np.einsum("ki,kij,kj->k", by_length, covariance, by_length)
        rows[alike, 1] = contact
        rows[alike, 4] = lengths[:, 0] + 0.5 * lengths[:, 1]
        rows[alike, errors + 1] = np.sqrt(length + beside[:, 1])
    crest = kept[:, UNIT] > 0.0
    unit, crested = kept[crest, UNIT], alike[crest]
    variance = covariance[crest, 0, 0] + beside[crest, 2]
    rows[crested, 2] = new[crest, 0] * unit
    rows[crested, errors + 2] = np.sqrt(variance) * unit
