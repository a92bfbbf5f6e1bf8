"""Kernels of linear processes: Burg's method, Levinson's recursion, simulation, prediction."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit


@njit(nogil=True)
def burg(x, order):
    """Reflection coefficients up to an order, and the residual mean square of each order.

    Forward and backward errors f_t, b_t of order m - 1 give
    k_m = 2 sum f_t b_(t-1) / sum (f_t^2 + b_(t-1)^2).
    """
    n = len(x)
    forward, backward = x.copy(), x.copy()
    reflection = np.zeros(order)
    left = np.empty(order + 1)
    left[0] = np.mean(x * x)
    for m in range(order):
        product, power = 0.0, 0.0
        for t in range(m + 1, n):
            product += forward[t] * backward[t - 1]
            power += forward[t] ** 2 + backward[t - 1] ** 2
        k = 2 * product / power if power > 0 else 0.0
        reflection[m] = k
        left[m + 1] = left[m] * (1 - k * k)
        for t in range(n - 1, m, -1):
            ahead, behind = forward[t], backward[t - 1]
            forward[t] = ahead - k * behind
            backward[t] = behind - k * ahead
    return reflection, left


@njit(nogil=True)
def levinson(reflection):
    """Coefficients a of x_t = sum a_j x_(t-j) + e_t from reflection coefficients."""
    order = len(reflection)
    found = np.zeros(order)
    for m in range(order):
        before = found[:m].copy()
        for j in range(m):
            found[j] = before[j] - reflection[m] * before[m - 1 - j]
        found[m] = reflection[m]
    return found


@njit(nogil=True)
def realisation(coefficients, innovations):
    """The series driven by given innovations, starting at rest."""
    order = len(coefficients)
    x = np.zeros(len(innovations))
    for t in range(len(x)):
        total = innovations[t]
        for j in range(min(order, t)):
            total += coefficients[j] * x[t - 1 - j]
        x[t] = total
    return x


@njit(nogil=True)
def linear_moments(x, order):
    """Normal equations of the regression of a value on its predecessors and a constant.

    Returns the matrix of the regressors, its right side, and the sum of the squared values.
    """
    size = order + 1
    matrix, right = np.zeros((size, size)), np.zeros(size)
    row = np.ones(size)
    power = 0.0
    for i in range(order, len(x)):
        for j in range(order):
            row[j] = x[i - 1 - j]
        power += x[i] * x[i]
        for a in range(size):
            right[a] += row[a] * x[i]
            for b in range(size):
                matrix[a, b] += row[a] * row[b]
    return matrix, right, power
