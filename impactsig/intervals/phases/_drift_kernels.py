"""Kernels of the drift spline: a pentadiagonal system solved by Cholesky's method."""

from __future__ import annotations

import math

import numpy as np

from ..._compiled import njit

kernel = njit(nogil=True, error_model="numpy")

ROUNDS = 3
TRACE = 1e-15  # of the greatest diagonal element, added to all


@kernel
def solve(gram, bend, target, offset, place, left, right, ratio):
    """Knots c, half the logarithm of the determinant, and the penalised sum of squares.

    (B'B + ratio D'D) c = B'y, where `gram` and `bend` hold the lower bands of B'B and D'D, row k
    the k-th below the diagonal, and `target` is B'y. An impact lies the share `right` of the way
    from the knot `place` to the next.
    """
    count = len(target)
    bands = gram + ratio * bend
    # a knot that no impact is near hangs by its neighbours; the trace keeps the factor finite
    trace = TRACE * bands[0].max()
    knots = np.empty(count)
    half_log_det = 0.0
    for k in range(count):  # bands become the factor, column by column
        diagonal = bands[0, k] + trace
        value = target[k]
        if k > 0:
            diagonal -= bands[1, k - 1] ** 2
            value -= bands[1, k - 1] * knots[k - 1]
        if k > 1:
            diagonal -= bands[2, k - 2] ** 2
            value -= bands[2, k - 2] * knots[k - 2]
        root = math.sqrt(max(diagonal, trace))
        bands[0, k] = root
        half_log_det += math.log(root)
        knots[k] = value / root
        if k + 1 < count:
            if k > 0:
                bands[1, k] -= bands[2, k - 1] * bands[1, k - 1]
            bands[1, k] /= root
        if k + 2 < count:
            bands[2, k] /= root
    for k in range(count - 1, -1, -1):
        if k + 1 < count:
            knots[k] -= bands[1, k] * knots[k + 1]
        if k + 2 < count:
            knots[k] -= bands[2, k] * knots[k + 2]
        knots[k] /= bands[0, k]
    squares = 0.0
    for j in range(len(offset)):
        rest = offset[j] - left[j] * knots[place[j]] - right[j] * knots[place[j] + 1]
        squares += rest * rest
    for k in range(count - 2):
        squares += ratio * (knots[k] - 2 * knots[k + 1] + knots[k + 2]) ** 2
    return knots, half_log_det, squares


@kernel
def settle(gram, bend, target, offset, place, left, right, stiffness, spread, floor):
    """Alternate noise level and knots: what `solve` returns, and the last ratio.

    The ratio is noise^2 stiffness; the noise is at least `floor`, at first `spread`.
    """
    noise = spread
    for _ in range(ROUNDS):
        ratio = noise**2 * stiffness
        knots, half_log_det, squares = solve(gram, bend, target, offset, place, left, right, ratio)
        before, noise = noise, max(math.sqrt(squares / len(offset)), floor)
        if abs(noise - before) < 0.01 * before:
            break
    return knots, half_log_det, squares, ratio
