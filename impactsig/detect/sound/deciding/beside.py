"""Powers beside the attacks of a record, by which gradual rises are distinguished."""

from __future__ import annotations

import functools

import numpy as np

from ._beside_kernels import powers_beside


class PowersBeside:
    """Mean squares of the innovations beside attacks, in stretches that follow one another.

    Parameters
    ----------
    edges : tuple of float
        Ascending limits of the stretches, in seconds after an attack.
    rate : float
    lags : (int, int)
        Lag and slope of the innovations.
    beyond : bool
        Whether the first and the last sample go on. Otherwise attacks near them have no powers.
    """

    def __init__(
        self, edges: tuple[float, ...], rate: float, lags: tuple[int, int], beyond: bool
    ) -> None:
        self.edges = samples_at(edges, rate)
        self.lags, self.beyond = lags, beyond
        self.found = [np.empty((len(edges) - 1, 0))]

    def add(self, x: np.ndarray, attack: np.ndarray, asked: np.ndarray) -> None:
        """Add the next attacks, places between samples of x; those not `asked` have no powers."""
        power = np.empty((len(self.edges) - 1, len(attack)))
        powers_beside(x, attack, asked, self.edges, self.lags, self.beyond, power)
        self.found.append(power)

    def powers(self) -> np.ndarray:
        """Those of all attacks, (stretches, n); NaN where they were not asked for."""
        return np.concatenate(self.found, axis=1)


@functools.lru_cache(maxsize=16)
def samples_at(edges: tuple[float, ...], rate: float) -> np.ndarray:
    """The edges in whole samples."""
    return np.array([round(edge * rate) for edge in edges])
