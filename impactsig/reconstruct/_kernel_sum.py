r"""The correlation sum with a Gaussian kernel, freed of measurement noise.

With d the difference of two delay vectors and S the covariance of the noise on one of them,

.. math:: K(H) = \sqrt{\frac{\det H^2 I}{\det (H^2 I - S)}} \;
    \Big\langle \exp\big(-\tfrac14 d^T (H^2 I - S)^{-1} d\big) \Big\rangle

over all pairs further apart in time than the Theiler window has the same mean as the noise-free sum
of exp(-|d|^2 / 4 H^2): Gaussian noise of covariance 2 S convolves the kernel, and widths add. H
must be above the square root of the greatest eigenvalue of S.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._kernel_pairs import forest, kernel_sums
from ._series import unbroken
from ._threads import in_threads

STEP = math.log(2) / 2
"""Between two scales, in ln H."""

LARGEST = 0.03
"""K above which the extent of the attractor shows in every slope."""

LEAST_PAIRS = 60.0
"""Sum of the kernel, before the correction, below which chance decides."""

FLOOR = 1.5
"""Least scale in standard deviations of the noise of a coordinate."""

AT_ONCE = 4
"""Scales that are summed together, and two octaves: the next lower ones take twice the vectors."""

AT_ONCE_OF_ALL = 12
"""The same where all vectors are taken."""

VECTORS = 10_000
"""Vectors of the largest scales."""

SCALES = 160

BLOCKS = 16


class KernelSum(NamedTuple):
    """Sums of the kernel by the blocks of time that the two vectors of a pair are in.

    Attributes
    ----------
    scales : ndarray, shape (scales,)
        H, ascending, evenly spaced in its logarithm.
    parts : ndarray, shape (blocks, blocks, scales)
        Corrected sums.
    pairs : ndarray, shape (blocks, blocks, scales)
        Pairs summed over: of long series fewer where there are more than enough.
    raw : ndarray, shape (scales,)
        Sums before the correction: about as many pairs decide.
    vectors : int
    """

    scales: np.ndarray
    parts: np.ndarray
    pairs: np.ndarray
    raw: np.ndarray
    vectors: int

    @property
    def sums(self) -> np.ndarray:
        """K(H), shape (scales,)."""
        found: np.ndarray = self.parts.sum(axis=(0, 1)) / self.pairs.sum(axis=(0, 1))
        return found

    def largest(self, count: int) -> KernelSum:
        """The sums of the `count` largest scales alone."""
        return KernelSum(
            self.scales[-count:],
            self.parts[..., -count:],
            self.pairs[..., -count:],
            self.raw[-count:],
            self.vectors,
        )


def kernel_sum(
    x: np.ndarray,
    m: int,
    delay: int,
    theiler: int,
    covariance: np.ndarray,
    floor: float = 0.0,
    workers: int | None = None,
    largest: float = LARGEST,
    given: tuple[float, float] | None = None,
) -> KernelSum | None:
    """K of the delay vectors of a series, from the floor up to where it is `largest`.

    Parameters
    ----------
    x : ndarray, shape (n,)
        As `series` returns it.
    covariance : ndarray, shape (m, m)
        S.
    floor : float
        Least scale, besides that of the noise.
    largest : float
        K at the largest scale.
    given : (float, float), optional
        Least and largest scale, in place of the rule.

    Returns
    -------
    KernelSum or None
        None where no scale is between the floor and the extent of the attractor.
    """
    places = np.flatnonzero(unbroken(x, (m - 1) * delay + 1))
    eigenvalues, axes = np.linalg.eigh(covariance)
    vectors = np.column_stack([x[places + k * delay] for k in range(m)])
    vectors = (vectors - vectors.mean(axis=0)) @ axes
    floor = max(floor, FLOOR * math.sqrt(np.trace(covariance) / m))
    top: float | None
    if given is not None:
        floor, top = max(floor, given[0]), given[1]
    else:
        top = _largest_scale(vectors, places, theiler, eigenvalues, floor, largest)
    if top is None or top <= floor:
        return None
    if floor > 0:
        steps = math.ceil(math.log(top / floor) / STEP)
        if steps < 2:
            return None
        scales = np.geomspace(top, floor, steps + 1)[:SCALES]
    else:
        scales = top * np.exp(-STEP * np.arange(SCALES))
    kept: list[tuple[np.ndarray, ...]] = []
    share = 1.0
    end = 0
    while end < len(scales):
        stride = max(int(len(places) * share / VECTORS), 1)
        begin, end = end, end + (AT_ONCE if stride > 1 else AT_ONCE_OF_ALL)
        some = scales[begin:end][::-1]
        share /= 2
        weights = 1 / (4 * (some[:, None] ** 2 - eigenvalues))
        factor = np.sqrt(np.prod(4 * some[:, None] ** 2 * weights, axis=1))
        used = slice(stride // 2, None, stride)
        sums, pairs = _by_block(vectors[used], places[used], theiler, weights, len(x), workers)
        raw = sums.sum(axis=(0, 1))
        enough = raw >= LEAST_PAIRS
        first = len(some) - int(np.argmin(enough[::-1])) if not enough.all() else 0
        if first < len(some):
            every = np.broadcast_to(pairs[..., None], (*pairs.shape, len(some) - first))
            kept.append((some[first:], (factor * sums)[..., first:], every, raw[first:]))
        if first:
            break
    if not kept:
        return None
    joined = [np.concatenate(part[::-1], axis=-1) for part in zip(*kept, strict=True)]
    scales, parts, pairs, raw = joined
    return KernelSum(scales, parts, pairs, raw, len(places))


def _largest_scale(
    vectors: np.ndarray,
    places: np.ndarray,
    theiler: int,
    eigenvalues: np.ndarray,
    floor: float,
    largest: float,
) -> float | None:
    """The scale at which K is `largest`, by pairs drawn at random; None if it is below the floor.

    Some 900 of them count, which is known to 3 %.
    """
    rng = np.random.default_rng(0)  # evenly spaced pairs would beat with a periodic series
    i, j = rng.integers(len(places), size=(2, 30_000))
    apart = np.abs(places[i] - places[j]) > theiler
    squares = (vectors[i[apart]] - vectors[j[apart]]) ** 2
    extent = math.sqrt(float(squares.sum(axis=1).max(initial=0.0)))
    low, high = math.log(floor or 1e-12 * extent or 1.0), math.log(extent or 1.0)

    def excess(log: float) -> float:
        width = math.exp(2 * log) - eigenvalues
        factor = math.sqrt(float(np.prod(math.exp(2 * log) / width)))
        return factor * float(np.exp(-squares @ (0.25 / width)).mean()) - largest

    if low >= high or excess(low) >= 0:
        return None
    for _ in range(14):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(middle) < 0 else (low, middle)
    return math.exp(low)


def _by_block(
    vectors: np.ndarray,
    places: np.ndarray,
    theiler: int,
    weights: np.ndarray,
    length: int,
    workers: int | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Sums and pairs by the blocks of both vectors, the earlier one first."""
    starts = np.searchsorted(places * BLOCKS // length, np.arange(BLOCKS + 1))
    trees = forest(vectors, places, starts)
    sums = np.zeros((BLOCKS, BLOCKS, len(weights)))
    in_threads(lambda b: kernel_sums(trees, b, theiler, weights, sums[b]), BLOCKS, workers)
    # What comes after each vector, by block.
    after = np.searchsorted(places, places + theiler, side="right")
    partners = starts[1:] - np.clip(after[:, None], starts[:-1], starts[1:])
    before = np.concatenate([np.zeros((1, BLOCKS)), np.cumsum(partners, axis=0)])
    return sums, np.diff(before[starts], axis=0)
