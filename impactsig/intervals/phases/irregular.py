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
    from scipy.spatial import cKDTree
    from scipy.special import log_ndtr

    # by a power of two, so that squares are numbers and nothing else changes
    intervals = np.ldexp(intervals, -np.frexp(intervals.max(initial=0.0))[1])
    vectors = np.column_stack((intervals[:-2], intervals[1:-1]))[:MOST_VECTORS]
    n = len(vectors)
    if n < LEAST_VECTORS or not np.ptp(intervals) > 0:
        return 0.0
    future = _innovations(intervals[: MOST_VECTORS + 2])
    near = cKDTree(vectors).query(vectors, NEIGHBORS + 1)[1]
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


def _innovations(intervals: np.ndarray) -> np.ndarray:
    """What two intervals do not predict of the next, linearly in normal scores.

    Intervals of a Gaussian linear process seen through a monotone function leave what is
    independent of those two.
    """
    from scipy.special import ndtri
    from scipy.stats import rankdata

    scores = ndtri((rankdata(intervals) - 0.5) / len(intervals))
    columns = np.column_stack((np.ones(len(scores) - 2), scores[:-2], scores[1:-1]))
    return scores[2:] - columns @ np.linalg.lstsq(columns, scores[2:], rcond=None)[0]
