"""Dormand and Prince's method of order 8(5,3), from scipy, and polynomials in Bernstein form."""

from __future__ import annotations

from functools import lru_cache
from math import comb
from typing import NamedTuple

import numpy as np

DEGREE = 7  # of the interpolant
GAUGE_DEGREE = 11  # of the polynomials in which spikes of flows are looked for


class Tableau(NamedTuple):
    """[HairerNorsettWanner1993]_, section II.10, for oscillators; the Bernstein form is ours.

    Stages 0 to 11 make the step, stage 12 is the rate at its end, 13 to 15 serve the interpolant.
    """

    a: np.ndarray  # (16, 16); row 12 is the step itself
    c: np.ndarray  # (16,)
    errors: np.ndarray  # (2, 14) error estimates of orders 3 and 5
    d: np.ndarray  # (4, 16) the last four terms of the interpolant
    bernstein: np.ndarray  # (DEGREE + 1, DEGREE) from terms of the interpolant to coefficients


class FlowTableau(NamedTuple):
    """The same for flows; an array more for either would cost their kernels a tenth."""

    a: np.ndarray
    c: np.ndarray
    errors: np.ndarray
    d: np.ndarray
    nodes: np.ndarray  # (GAUGE_DEGREE + 1,) shares of a step, both ends among them
    bernstein: np.ndarray  # (GAUGE_DEGREE + 1, same) from values at the nodes to coefficients


@lru_cache(maxsize=1)
def tableau() -> Tableau:
    """The method for oscillators."""
    # Term m of the interpolant is x^(m//2 + 1) (1 - x)^((m + 1)//2) = x^i (1 - x)^j.
    bernstein = np.zeros((DEGREE + 1, DEGREE))
    for m in range(DEGREE):
        i, j = m // 2 + 1, (m + 1) // 2
        for n in range(i, DEGREE + 1 - j):
            bernstein[n, m] = comb(DEGREE - i - j, n - i) / comb(DEGREE, n)
    return Tableau(*_dormand_prince(), bernstein)


@lru_cache(maxsize=1)
def flow_tableau() -> FlowTableau:
    """The method for flows."""
    degree = GAUGE_DEGREE
    nodes = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    binomial = np.array([comb(degree, k) for k in range(degree + 1)], float)
    power = np.arange(degree + 1)
    basis = binomial * nodes[:, None] ** power * (1 - nodes[:, None]) ** power[::-1]
    return FlowTableau(*_dormand_prince(), nodes, np.ascontiguousarray(np.linalg.inv(basis)))


def _dormand_prince() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The coefficients: stages, their times, error estimates, interpolant."""
    from scipy.integrate import DOP853

    a = np.zeros((16, 16))
    a[:12, :12], a[12, :12], a[13:] = DOP853.A, DOP853.B, DOP853.A_EXTRA
    c = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
    errors = np.zeros((2, 14))
    errors[0, :13], errors[1, :13] = DOP853.E3, DOP853.E5
    return a, c, errors, np.ascontiguousarray(DOP853.D, np.float64)
