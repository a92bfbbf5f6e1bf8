"""Dormand and Prince's method of order 8(5,3), from scipy, and polynomials in Bernstein form."""

from __future__ import annotations

from functools import lru_cache
from math import comb
from typing import NamedTuple

import numpy as np

DEGREE = 11  # of the polynomials in which events are looked for


class Tableau(NamedTuple):
    """[HairerNorsettWanner1993]_, section II.10; the nodes and matrix of `events` are ours.

    Stages 0 to 11 make the step, stage 12 is the rate at its end, 13 to 15 serve the interpolant
    of degree 7.
    """

    a: np.ndarray  # (16, 16); row 12 is the step itself
    c: np.ndarray  # (16,)
    errors: np.ndarray  # (2, 14) error estimates of orders 3 and 5
    d: np.ndarray  # (4, 16) interpolant
    nodes: np.ndarray  # (DEGREE + 1,) shares of a step, both ends among them
    bernstein: np.ndarray  # from values at the nodes to coefficients


@lru_cache(maxsize=1)
def dormand_prince() -> Tableau:
    """The coefficients of the method."""
    from scipy.integrate import DOP853

    a = np.zeros((16, 16))
    a[:12, :12], a[12, :12], a[13:] = DOP853.A, DOP853.B, DOP853.A_EXTRA
    c = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
    errors = np.zeros((2, 14))
    errors[0, :13], errors[1, :13] = DOP853.E3, DOP853.E5
    nodes = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2
    binomial = np.array([comb(DEGREE, k) for k in range(DEGREE + 1)], float)
    power = np.arange(DEGREE + 1)
    basis = binomial * nodes[:, None] ** power * (1 - nodes[:, None]) ** power[::-1]
    arrays = (a, c, errors, DOP853.D, nodes, np.linalg.inv(basis))
    return Tableau(*(np.ascontiguousarray(array, np.float64) for array in arrays))
