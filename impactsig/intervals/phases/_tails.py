"""Tails of two distributions, for numbers one by one: scipy.special takes longer to import."""

from __future__ import annotations

import math

TINY = 1e-300
MOST_TERMS = 10_000


def beta_above(a: float, b: float, x: float) -> float:
    """Probability that a number of the distribution Beta(a, b) is above x, by its fraction.

    Of the two fractions that one is taken that converges fast (DLMF, 8.17.22 and 8.17.4).
    """
    if not 0 < x < 1:
        return float(x <= 0)
    scale = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    density = math.exp(scale + a * math.log(x) + b * math.log1p(-x))
    if x < (a + 1) / (a + b + 2):
        return 1 - density / a / _fraction(a, b, x)
    return density / b / _fraction(b, a, 1 - x)


def _fraction(a: float, b: float, x: float) -> float:
    """The continued fraction 1 + d1/(1 + d2/(1 + ...)) of the incomplete beta function (Lentz)."""
    value = above = 1.0
    below = 0.0
    for n in range(1, MOST_TERMS):
        m = n // 2
        if n % 2:
            d = -(a + m) * (a + b + m) / ((a + 2 * m) * (a + 2 * m + 1)) * x
        else:
            d = m * (b - m) / ((a + 2 * m - 1) * (a + 2 * m)) * x
        below = 1 / (1 + d * below or TINY)
        above = 1 + d / above or TINY
        value *= above * below
        if abs(above * below - 1) < 1e-16:
            break
    return value


def normal_below(x: float) -> float:
    """Probability that a standard normal number is below x."""
    return math.erfc(-x / math.sqrt(2)) / 2
