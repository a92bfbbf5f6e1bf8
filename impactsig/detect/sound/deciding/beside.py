"""Powers beside the attacks of a record, by which gradual rises are distinguished."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ._beside_kernels import powers_beside


class PowersBeside:
    """Mean squares of the innovations beside attacks, in stretches that follow one another.

    Parameters
    ----------
    edges : sequence of float
        Ascending limits of the stretches, in seconds after an attack.
    rate : float
    lags : (int, int)
        Lag and slope of the innovations.
    """

    def __init__(self, edges: Sequence[float], rate: float, lags: tuple[int, int]) -> None:
        self.edges = np.array([round(edge * rate) for edge in edges])
        self.lags = lags
        self.found = [np.empty((len(edges) - 1, 0))]

    def add(self, x: np.ndarray, attack: np.ndarray, asked: np.ndarray) -> None:
        """Add the next attacks, places between samples of x; those not `asked` have no powers."""
        power = np.empty((len(self.edges) - 1, len(attack)))
        powers_beside(x, attack, asked, self.edges, self.lags, power)
        self.found.append(power)

    def within(self, x: np.ndarray, attack: np.ndarray) -> np.ndarray:
        """Which stretches lie in x, beyond which its first and last samples go on."""
        first, last = self.edges[0] - sum(self.lags), self.edges[-1]
        return np.asarray((attack + first >= 0) & (attack + last < len(x)))

    def powers(self) -> np.ndarray:
        """Those of all attacks, (stretches, n); NaN where they were not asked for."""
        return np.concatenate(self.found, axis=1)
