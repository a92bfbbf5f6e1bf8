r"""What a slope between two scales misses the dimension of the attractor by.

Three standard errors, beside that of chance. Over W e-folds lacunarity, the oscillation of slopes
with the contraction of the motion, moves a slope by `KAPPA` / W. Unrelated vectors (`_unrelated`)
raise it by u at the most, and the extent of the attractor, which hides them, lowers it by as much:
of an unknown anywhere within u, the standard error is u / sqrt 3. And where slopes freed of
unrelated vectors still rise towards smaller scales, by g from the upper half of the scales to the
lower one, the limit is above the slope, by g / 2 as far as the lower half shows: taken for an
unknown within g / 2.

The dimension is read off those scales, W = `LEAST_SPAN` at least, where the error of chance and the
first two are least together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from . import _jackknife
from ._kernel_sum import KernelSum
from ._unrelated import freed

KAPPA = 0.13
"""The slope over W e-folds misses the dimension by KAPPA / W, as a standard error.

Of long noise-free series it misses it by 0.13 / W, root mean square, for W between 1 and 10: of the
beam at both frequencies, of Hénon's map and of Lorenz' intervals, these the most.
"""

LEAST_SPAN = 1.6
"""W from which on a dimension is read."""

UNIFORM = 1 / math.sqrt(3)
"""Standard error of what is anywhere between -1 and 1."""


class Departure(NamedTuple):
    """Standard errors of a slope as the dimension of the attractor."""

    span: float
    unrelated: float
    rising: float


def departure(sums: KernelSum, chance: np.ndarray, span: float) -> Departure:
    """Standard errors of the least-squares slope over all scales.

    Parameters
    ----------
    chance : ndarray, shape (scales,)
        U.
    span : float
        W of the scales below the extent of the attractor.
    """
    logs = np.log(sums.scales)
    related = np.log(freed(sums.sums, chance))
    steeper = float(_weights(logs) @ (np.log(sums.sums) - related))
    half = (len(logs) + 1) // 2
    change = np.zeros(len(logs))
    change[:half] = _weights(logs[:half])
    change[-half:] -= _weights(logs[-half:])
    rise = float(change @ related)
    by_chance = float(_jackknife.variance(_shares(sums) @ change))
    certain = math.sqrt(max(rise**2 - by_chance, 0.0)) if rise > 0 else 0.0
    return Departure(KAPPA / span, UNIFORM * abs(steeper), UNIFORM * certain / 2)


def best_scales(sums: KernelSum, chance: np.ndarray) -> slice:
    """The scales over which the errors of a slope are least together."""
    logs = np.log(sums.scales)
    steeper = np.log(sums.sums) - np.log(freed(sums.sums, chance))
    some, spans = [], []
    weights: list[np.ndarray] = []
    for first in range(len(logs)):
        for end in range(first + 3, len(logs) + 1):
            span = logs[end - 1] - logs[first]
            if span > LEAST_SPAN - 1e-9:
                some.append(slice(first, end))
                spans.append(span)
                weights.append(np.zeros(len(logs)))
                weights[-1][first:end] = _weights(logs[first:end])
    if not some:
        return slice(0, len(logs))
    of_each = np.column_stack(weights)
    errors = (
        _jackknife.variance(_shares(sums) @ of_each)
        + (KAPPA / np.array(spans)) ** 2
        + (UNIFORM * (steeper @ of_each)) ** 2
    )
    return some[int(np.argmin(errors))]


def _shares(sums: KernelSum) -> np.ndarray:
    found: np.ndarray = sums.parts / sums.parts.sum(axis=(0, 1))
    return found


def _weights(logs: np.ndarray) -> np.ndarray:
    """Weights of ln K in a least-squares slope."""
    centred = logs - logs.mean()
    found: np.ndarray = centred / (centred @ centred)
    return found
