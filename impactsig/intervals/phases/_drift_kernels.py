"""Kernels of the drift spline: a pentadiagonal system solved by Cholesky's method."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import njit

kernel = njit(nogil=True, error_model="numpy")

ROUNDS = 3
TRACE = 1e-15  # of the greatest diagonal element, added to all
LEAST_SPAN = 1e-9  # [cycles] of all impacts


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
def settle(x, offset, count, stiffness, spread, floor):
    """Knots of every stiffness, with what `solve` returns beside them and the last ratio.

    The ratio is noise^2 stiffness. Noise level and knots are found in turn; the noise is at least
    `floor`, at first `spread`. Of `count` knots the first is at x[0] and the last at x[-1].
    """
    dx = max(x[-1] - x[0], LEAST_SPAN) / (count - 1)
    place, left, right = np.empty(len(x), np.int64), np.empty(len(x)), np.empty(len(x))
    gram, target = np.zeros((3, count)), np.zeros(count)  # lower bands, as scipy.linalg has them
    for k in range(len(x)):
        since = (x[k] - x[0]) / dx
        place[k] = min(max(np.int64(since), 0), count - 2)
        right[k] = since - place[k]
        left[k] = 1 - right[k]
        gram[0, place[k]] += left[k] ** 2
        gram[0, place[k] + 1] += right[k] ** 2
        gram[1, place[k]] += left[k] * right[k]
        target[place[k]] += left[k] * offset[k]
        target[place[k] + 1] += right[k] * offset[k]
    bend = second_differences(count)
    knots, told = np.empty((len(stiffness), count)), np.empty((len(stiffness), 3))
    for j in range(len(stiffness)):
        noise = spread
        for _ in range(ROUNDS):
            ratio = noise**2 * stiffness[j]
            found, half_log_det, squares = solve(
                gram, bend, target, offset, place, left, right, ratio
            )
            before, noise = noise, max(math.sqrt(squares / len(offset)), floor)
            if abs(noise - before) < 0.01 * before:
                break
        knots[j] = found
        told[j, 0], told[j, 1], told[j, 2] = half_log_det, squares, ratio
    return knots, told


@kernel
def second_differences(count):
    """Lower bands of D'D."""
    bend = np.zeros((3, count))
    for k in range(count - 2):
        bend[0, k] += 1.0
        bend[0, k + 1] += 4.0
        bend[0, k + 2] += 1.0
        bend[1, k] -= 2.0
        bend[1, k + 1] -= 2.0
        bend[2, k] = 1.0
    return bend
