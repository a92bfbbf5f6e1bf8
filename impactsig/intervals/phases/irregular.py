"""Whether a train without slots is chaotic (locked or predictable) or irregular."""

from __future__ import annotations

import numpy as np

from .tracking import Warps, harmonics, is_sparse

LOCKED_POWER = 18.0  # of a harmonic, of which noise has 1 on average before the rate is tracked
PREDICTED = 7.0  # -ln of the p-value of a prediction that counts as none
UNPREDICTED = -2.5  # log-odds that no prediction leaves where no forcing is given
SAYING = 60.0  # intervals whose lack of both signs divides the odds of chaos by e
NEIGHBORS = 6
SHUFFLES = 99
LEAST_VECTORS = 40
MOST_VECTORS = 2000
AROUND, MERGED = 3, 1.5  # intervals to either side, and times their median that two together are
MOST_MERGED = 0.25  # share of the intervals, from which on long ones belong to the motion


def chaos_odds(warps: Warps | None, intervals: np.ndarray) -> float:
    """Log-odds of chaos against linear noise, by the stronger of two signs.

    *Locking*: the greatest power |S_h|^2/N of the first three harmonics of the forcing, at a
    constant rate or at one that is tracked. (A tracked phase would align what has none.)
    *Prediction*: the error of predicting, from the futures of the nearest pairs of intervals, what
    a linear prediction leaves of an interval, against those of shuffled futures, as a normal
    deviate.

    Neither sign in few intervals says little against chaos.
    """
    predicted = max(_prediction_odds(intervals), -len(intervals) / SAYING)
    if warps is None or is_sparse(warps.cycles):
        # measured chaos is often no more predictable than that: its absence says little
        return max(predicted, UNPREDICTED)
    power = 0.0
    for warp in (warps.constant, warps.rate):
        sums = harmonics(warp)[:3].sum(axis=1)
        power = max(power, float(np.max(np.abs(sums) ** 2)) / len(warp))
    return max(power - LOCKED_POWER, predicted)


def _prediction_odds(intervals: np.ndarray) -> float:
    """Log-odds by prediction, with and without intervals in which impacts may have been missed.

    After the sum of two intervals a linear prediction is wrong, and so wrong in the same way each
    time, that a linear process appears to be nonlinear.
    """
    # by a power of two, so that squares are numbers and nothing else changes
    intervals = np.ldexp(intervals, -np.frexp(intervals.max(initial=0.0))[1])
    if len(intervals) < LEAST_VECTORS + 2 or not np.ptp(intervals) > 0:
        return 0.0
    triples = np.lib.stride_tricks.sliding_window_view(intervals, 3)[:MOST_VECTORS]
    odds = _predicted(triples)
    merged = _may_be_merged(intervals)
    if odds > 0 and 0 < np.mean(merged) < MOST_MERGED:
        whole = ~np.lib.stride_tricks.sliding_window_view(merged, 3)[:MOST_VECTORS].any(axis=1)
        odds = min(odds, _predicted(triples[whole]))
    return odds


def _may_be_merged(intervals: np.ndarray) -> np.ndarray:
    """Which intervals are much longer than those around them."""
    padded = np.pad(intervals, AROUND, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND + 1)
    usual: np.ndarray = np.median(np.delete(around, AROUND, axis=1), axis=1)
    return intervals > MERGED * usual


def _predicted(triples: np.ndarray) -> float:
    """Log-odds that the third interval follows from the first two, beyond a linear prediction."""
    from scipy.spatial import cKDTree
    from scipy.special import log_ndtr

    n = len(triples)
    if n < LEAST_VECTORS or not np.ptp(triples) > 0:
        return 0.0
    future = _innovations(triples)
    near = cKDTree(triples[:, :2]).query(triples[:, :2], NEIGHBORS + 1)[1]
    near = near[:, 1:]
    rng = np.random.default_rng(0)
    futures = np.empty((n, SHUFFLES + 1))
    futures[:, 0] = future
    for k in range(SHUFFLES):
        futures[:, k + 1] = rng.permutation(future)
    predicted = futures[near[:, 0]]
    for k in range(1, NEIGHBORS):
        predicted += futures[near[:, k]]
    error = np.mean((predicted / NEIGHBORS - futures) ** 2, axis=0)
    deviation = (error[0] - error[1:].mean()) / max(float(error[1:].std()), 1e-300)
    return float(-log_ndtr(deviation) - PREDICTED)


def _innovations(triples: np.ndarray) -> np.ndarray:
    """What two intervals do not predict of the next, linearly in normal scores.

    Intervals of a Gaussian linear process seen through a monotone function leave what is
    independent of those two.
    """
    from scipy.special import ndtri
    from scipy.stats import rankdata

    scores = ndtri((rankdata(triples).reshape(-1, 3) - 0.5) / triples.size)
    columns = np.column_stack((np.ones(len(scores)), scores[:, :2]))
    return scores[:, 2] - columns @ np.linalg.lstsq(columns, scores[:, 2], rcond=None)[0]
