"""The first root of a polynomial in Bernstein form.

Its coefficients bound it: where none is negative it does not cross zero, and halving isolates the
first root at which it does.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined, kernel


@inlined
def value(c, w, n, x):
    """Polynomial in Bernstein form and its derivative, by de Casteljau's scheme, at x."""
    for i in range(n + 1):
        w[i] = c[i]
    for m in range(n, 1, -1):
        for i in range(m):
            w[i] += x * (w[i + 1] - w[i])
    if n == 0:
        return w[0], 0.0
    return w[0] + x * (w[1] - w[0]), n * (w[1] - w[0])


@kernel
def first_root(stack, n):
    """First root in [0, 1] of the polynomial of degree n in stack[0], positive at first; or 2.

    The last two columns of the stack keep the ends of the part of [0, 1] that a row is about.
    """
    start, stop = stack.shape[1] - 2, stack.shape[1] - 1
    stack[0, start], stack[0, stop] = 0.0, 1.0
    top = 1
    while top > 0:
        top -= 1
        c = stack[top]
        low, high = c[start], c[stop]
        changes = 0
        sign = 1
        least = math.inf
        for i in range(n + 1):
            least = min(least, c[i])
            if c[i] != 0 and (c[i] > 0) != (sign > 0):
                changes += 1
                sign = -sign
        if least >= 0:
            continue
        if low > 0 and c[0] <= 0:
            return low
        if changes == 1 and c[0] > 0 and c[n] < 0:
            left, right, x = 0.0, 1.0, c[0] / (c[0] - c[n])
            for _ in range(60):
                y, slope = value(c, stack[-1], n, x)
                if y > 0:
                    left = x
                else:
                    right = x
                new = x - y / slope if slope < 0 else -1.0
                if not (left < new < right):
                    new = (left + right) / 2
                if abs(new - x) <= 1e-16 or right - left <= 1e-16 or new == x:
                    break
                x = new
            return low + (high - low) * x
        if high - low < 1e-13:
            if c[n] < 0:
                return high
            continue
        # Halve by de Casteljau's scheme: the left half stands on top.
        left_half = stack[top + 1]
        left_half[0] = c[0]
        for m in range(1, n + 1):
            for i in range(n + 1 - m):
                c[i] = (c[i] + c[i + 1]) / 2
            left_half[m] = c[0]
        middle = (low + high) / 2
        stack[top, start], stack[top, stop] = middle, high
        stack[top + 1, start], stack[top + 1, stop] = low, middle
        top += 2
    return 2.0
