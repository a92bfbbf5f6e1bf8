"""Kernels: where a polynomial in Bernstein form crosses zero, one place after the other.

Its coefficients bound it: where they have one sign there is no root, where the sign changes once
there is one, and else halving decides.
"""

from __future__ import annotations

from ..._compiling.compiled import kernel
from ..basis.tableau import GAUGE_DEGREE
from .flow_steps import Scratch

DEPTH = 44  # halvings of a step after which two roots are one, that only touches zero


@kernel
def value_at(c, ladder, x):
    """Value and slope of a polynomial in Bernstein form (de Casteljau)."""
    for m in range(GAUGE_DEGREE + 1):
        ladder[m] = c[m]
    for m in range(GAUGE_DEGREE, 1, -1):
        for i in range(m):
            ladder[i] = (1 - x) * ladder[i] + x * ladder[i + 1]
    slope = ladder[1] - ladder[0]
    return ladder[0] + x * slope, GAUGE_DEGREE * slope


@kernel
def root_in(c, ladder, low, high, side):
    """The root between low and high, where the polynomial leaves `side`."""
    x = 0.5 * (low + high)
    for _ in range(100):
        value, slope = value_at(c, ladder, x)
        if value * side > 0:
            low = x
        else:
            high = x
        next = x - value / slope
        if not low < next < high:
            next = 0.5 * (low + high)
        if abs(next - x) <= 1e-16 or next in (low, high):
            return next
        x = next
    return x


@kernel
def halve(stack, top):
    """Put both halves of the part on top of the stack in its place, the first one on top."""
    left, right = stack[top + 1], stack[top]
    low, high = right[GAUGE_DEGREE + 1], right[GAUGE_DEGREE + 2]
    middle = 0.5 * (low + high)
    for m in range(GAUGE_DEGREE + 1):
        left[m] = right[0]
        for i in range(GAUGE_DEGREE - m):
            right[i] = 0.5 * (right[i] + right[i + 1])
    # De Casteljau's last row, taken as it was made, is the second half.
    left[GAUGE_DEGREE + 1], left[GAUGE_DEGREE + 2] = low, middle
    right[GAUGE_DEGREE + 1], right[GAUGE_DEGREE + 2] = middle, high


@kernel
def begin(s: Scratch):
    """Put the whole step on the stack."""
    for m in range(GAUGE_DEGREE + 1):
        s.stack[0, m] = s.coefficients[m]
    s.stack[0, GAUGE_DEGREE + 1], s.stack[0, GAUGE_DEGREE + 2] = 0.0, 1.0
    return 0


@kernel
def next_crossing(s: Scratch, top, side):
    """The next crossing: what is left on the stack, where (-1: nowhere), and the side after it.

    What is zero counts as still on the side it came from.
    """
    stack = s.stack
    while top >= 0:
        changes, last = 0, side
        for i in range(GAUGE_DEGREE + 1):
            value = stack[top, i]
            sign = 1.0 if value > 0 else (-1.0 if value < 0 else 0.0)
            if sign != 0.0:
                if last != 0.0 and sign != last:
                    changes += 1
                last = sign
        low, high = stack[top, GAUGE_DEGREE + 1], stack[top, GAUGE_DEGREE + 2]
        if changes == 0:
            side = last
            top -= 1
        elif changes == 1 and side != 0.0:
            top -= 1
            return top, root_in(s.coefficients, s.ladder, low, high, side), last
        elif high - low < 2.0**-DEPTH:
            top -= 1
            end = stack[top + 1, GAUGE_DEGREE]
            if end * side < 0:
                return top, high, -side
        else:
            if side == 0.0 and stack[top, 0] != 0.0:
                side = 1.0 if stack[top, 0] > 0 else -1.0
                continue
            halve(stack, top)
            top += 1
    return -1, -1.0, side
