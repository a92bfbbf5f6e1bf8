r"""Correlation sum with a Gaussian kernel, corrected for measurement noise.

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
from scipy.optimize import brentq

from ..._running.threads import in_threads
from .._series import unbroken
from ._kernel_pairs import Leaves, kernel_sums, leaves

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

BLOCKS = 32

PARTS = 16
"""Parts of the sum, for threads."""


class KernelSum(NamedTuple):
    """Kernel sums by the blocks of time of the two vectors of a pair.

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

    def over(self, some: slice) -> KernelSum:
        """The sums at some of the scales."""
        return KernelSum(
            self.scales[some],
            self.parts[..., some],
            self.pairs[..., some],
            self.raw[some],
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
    """K of the delay vectors of a series, from the floor up to the scale where it is `largest`.

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
    stride, some_of = 0, None
    while end < len(scales):
        before, stride = stride, max(int(len(places) * share / VECTORS), 1)
        begin, end = end, end + (AT_ONCE if stride > 1 else AT_ONCE_OF_ALL)
        some = scales[begin:end][::-1]
        share /= 2
        weights = 1 / (4 * (some[:, None] ** 2 - eigenvalues))
        factor = np.sqrt(np.prod(4 * some[:, None] ** 2 * weights, axis=1))
        if some_of is None or stride != before:
            used = slice(stride // 2, None, stride)
            some_of = _Vectors.of(vectors[used], places[used], theiler, len(x))
        sums, pairs = some_of.sums(theiler, weights, workers), some_of.pairs
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
    """Scale at which K is `largest`, from random pairs; None if it is below the floor.

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
        exponents = squares @ (0.25 / width)
        # What is beyond is no part of the mean, and slow where it underflows.
        total = float(np.exp(-exponents[exponents < 40]).sum())
        return math.log(max(factor * total / len(squares), 1e-17) / largest)

    if low >= high or excess(low) >= 0:
        return None
    return math.exp(brentq(excess, low, high, xtol=2e-3))


class _Vectors(NamedTuple):
    """Delay vectors in a tree, and the number of pairs in each two blocks."""

    tree: Leaves
    pairs: np.ndarray

    @classmethod
    def of(cls, vectors: np.ndarray, places: np.ndarray, theiler: int, length: int) -> _Vectors:
        blocks = places * BLOCKS // length
        starts = np.searchsorted(blocks, np.arange(BLOCKS + 1))
        # The first that comes after each: pairs with the rest of its block, and with all later.
        first = np.searchsorted(places, places + theiler, side="right")
        some = first < len(places)
        first, block = first[some], blocks[first[some]]
        both, shape = blocks[some] * BLOCKS + block, (BLOCKS, BLOCKS)
        count = np.bincount(both, minlength=BLOCKS**2).reshape(shape)
        rest = np.bincount(both, starts[block + 1] - first, BLOCKS**2).reshape(shape)
        pairs = rest + (count.cumsum(axis=1) - count) * np.diff(starts)
        return cls(leaves(vectors, places, blocks), pairs)

    def sums(self, theiler: int, weights: np.ndarray, workers: int | None) -> np.ndarray:
        """Kernel sums by the blocks of both vectors, the earlier first."""
        root = np.sqrt(weights[-1])
        tree = self.tree._replace(
            points=self.tree.points * root[:, None],
            low=self.tree.low * root,
            high=self.tree.high * root,
        )
        weights = weights / weights[-1]
        if np.all(weights == weights[:, :1]):
            weights = np.ascontiguousarray(weights[:, :1])
        sums = np.zeros((PARTS, BLOCKS, BLOCKS, len(weights)))

        def part(k: int) -> None:
            kernel_sums(tree, k, PARTS, float(theiler), weights, sums[k])

        in_threads(part, range(PARTS), workers)
        total = sums.sum(axis=0)
        lower = np.tril(np.ones((BLOCKS, BLOCKS)), -1)[..., None]
        found: np.ndarray = total * (1 - lower) + (total * lower).swapaxes(0, 1)
        return found
