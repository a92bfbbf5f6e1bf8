"""The modes of a uniform cantilever, of length 1, for any mode to rounding."""

from __future__ import annotations

import math

import numpy as np


def signs(count: int) -> np.ndarray:
    """Of the first shapes at the tip."""
    return (-1.0) ** np.arange(count)


def roots(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Roots b of cos b cosh b = -1, and how far they are above (n - 1/2) pi.

    With b = (n - 1/2) pi + d the equation is sin d = (-1)^(n - 1) / cosh b, in which nothing
    overflows or cancels; d falls as exp(-b).
    """
    middle = (np.arange(count) + 0.5) * math.pi
    sign = signs(count)
    above = sign * np.exp(-middle)
    for _ in range(8):  # Newton's method doubles the digits; from three it needs four rounds
        b = middle + above
        small = np.exp(-b)
        secant = 2 * small / (1 + small * small)
        tangent = (1 - small * small) / (1 + small * small)
        off = np.sin(above) - sign * secant
        above = above - off / (np.cos(above) + sign * secant * tangent)
    return middle + above, above


def sigma_of(b: np.ndarray, above: np.ndarray) -> np.ndarray:
    """(cosh b + cos b) / (sinh b + sin b), divided through by cosh b; sin b = +-cos(above)."""
    small = np.exp(-b)
    secant = 2 * small / (1 + small * small)
    tangent = (1 - small * small) / (1 + small * small)
    cosine = -signs(len(b)) * np.sin(above)
    sine = signs(len(b)) * np.cos(above)
    return (1 + cosine * secant) / (tangent + sine * secant)


def shape(b: float, above: float, sign: float, xi: np.ndarray) -> np.ndarray:
    """phi(xi) / phi(1) with phi(1) = 2 sign, of growing and falling exponentials apart."""
    cosine, sine = -sign * math.sin(above), sign * math.cos(above)
    small = math.exp(-b)
    # 1 - sigma, times exp(b): what multiplies the growing half.
    grows = 2 * (sine - cosine - small) / (1 - small * small + 2 * small * sine)
    sigma = 1 - grows * small
    y = b * xi
    far = grows * np.exp(y - b) / 2 + (1 + sigma) / 2 * np.exp(-y)
    far += sigma * np.sin(y) - np.cos(y)
    # Near the clamp all of it is y^2: there by the differences, of which none cancels.
    near = np.minimum(y, 1.0)
    even = 2 * (np.sinh(near / 2) ** 2 + np.sin(near / 2) ** 2)
    odd = near**3 / 3 * (1 + near**4 / 840 * (1 + near**4 / 7920 * (1 + near**4 / 32760)))
    return np.where(y < 1, even - sigma * odd, far) / (2 * sign)
