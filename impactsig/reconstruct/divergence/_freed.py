r"""Divergence curve corrected for measurement noise, by a Gaussian kernel.

With d the gap of a pair after k steps as observed, and s the standard deviation of the noise on a
value,

.. math:: A_k(H) = \frac{H}{\sqrt{H^2 - s^2}}
    \Big\langle \exp\Big(-\frac{d^2}{4 (H^2 - s^2)}\Big) \Big\rangle

has the mean of the noise-free sum of exp(-d^2 / 4 H^2): Gaussian noise of variance 2 s^2 convolves
the kernel, and widths add. The width H_k at which A_k is `LEVEL` grows as the gaps do. The errors
of the gap must not bear on the choice of the pair: of timing errors, neighbouring intervals share
one, so that this holds from the second step after the newest coordinate on.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from ._region import BLOCKS, Curve, blocks_of_time
from ._stretch import LOWEST

LEVEL = 0.45
"""Of the kernel. At 1/2 growth near the extent of the attractor reads 2 % higher, at 0.4 lower."""

LEAST_WIDTH = 1.2
"""Least H in standard deviations of the noise on a value."""

PAIRS = 30_000
"""Drawn for the gaps of any two values."""

DIFFERENCE = 1e-2
"""Of ln H, for the derivative of A."""


def freed_curve(log: np.ndarray, time: np.ndarray, noise: float) -> Curve:
    """Curve ln H_k with its scatter over blocks; `LOWEST` where H_k is below the noise.

    Parameters
    ----------
    log : ndarray, shape (K + 1, pairs)
        Logarithms of the gaps.
    time : ndarray, shape (pairs,)
        Of the references.
    noise : float
        s, in the unit of the values.
    """
    block = blocks_of_time(time)
    stretch = np.full(len(log), LOWEST)
    blocks = np.zeros((BLOCKS, len(log)))
    for k, gaps in enumerate(log):
        stretch[k] = width(gaps, noise)
        if stretch[k] == LOWEST:
            continue
        up, down = (_excess(gaps, noise, stretch[k] + sign * DIFFERENCE).mean() for sign in (1, -1))
        sums = np.bincount(block, _excess(gaps, noise, stretch[k]), BLOCKS)
        # As if all blocks were as large as the mean one.
        blocks[:, k] = -sums * BLOCKS / len(time) * 2 * DIFFERENCE / (up - down)
    return Curve(stretch, blocks, True)


def width(gaps: np.ndarray, noise: float) -> float:
    """The ln H at which the mean kernel over gaps, given as logarithms, is `LEVEL`."""
    low = math.log(LEAST_WIDTH * noise) if noise else float(np.quantile(gaps, 0.1)) - 3.0
    high = float(gaps.max()) + 1.0
    if not LOWEST / 2 < low < high or _excess(gaps, noise, low).mean() >= 0:
        return LOWEST
    found: float = brentq(lambda log: _excess(gaps, noise, log).mean(), low, high, xtol=1e-6)
    return found


def unrelated_width(values: np.ndarray, theiler: int, noise: float) -> float:
    """The ln H of the gaps of arbitrary pairs of values, at which the divergence ends."""
    i, j = np.random.default_rng(0).integers(len(values), size=(2, PAIRS))
    gaps = np.abs(values[i] - values[j])[np.abs(i - j) > theiler]
    gaps = gaps[np.isfinite(gaps)]
    return width(np.log(np.where(gaps > 0, gaps, math.exp(LOWEST / 2))), noise)


def _excess(gaps: np.ndarray, noise: float, log: float) -> np.ndarray:
    """Excess of the kernel of each gap over `LEVEL`."""
    left = math.exp(2 * log) - noise**2
    # Beyond 700 the exponential is not a normal number, and slow.
    near: np.ndarray = np.exp(-np.minimum(np.exp(2 * gaps) / (4 * left), 700.0))
    return near * math.sqrt(1 + noise**2 / left) - LEVEL
