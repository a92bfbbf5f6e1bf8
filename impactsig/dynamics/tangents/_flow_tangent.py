"""Kernels for the variational equation of a flow.

With every step of Dormand and Prince's goes the variational equation ``Y' = J Y`` by the same
stages, so that the columns are the derivative of the step as it is taken; it must fulfil a
tolerance of its own, because a direction that the flow has left still contracts. The columns of J
are central differences: exact but for rounding where the rates are quadratic, as Lorenz' and
Rössler's are, and good to about 1e-10 elsewhere.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ...simulation.basis.events import DIVERGED, DONE, EXHAUSTED, TIME, WISH
from ...simulation.flows.flow_steps import go, rates_at, stride

TOLERANCE = 1e-11  # of what a step does to a column, relative to its length
SMALL = 6e-6  # of a coordinate, to difference by: the cube root of rounding


@kernel
def jacobian(field, t, y, sizes, low, high, out):
    """Jacobian by central differences; `y` is changed and restored."""
    d = field.size
    for n in range(d):
        value = y[n]
        h = SMALL * max(abs(value), sizes[n], 1e-300)
        y[n] = value + h
        field.rates(t, y.ctypes, field.parameters.ctypes, high.ctypes)
        above = y[n]
        y[n] = value - h
        field.rates(t, y.ctypes, field.parameters.ctypes, low.ctypes)
        width = above - y[n]
        y[n] = value
        for m in range(d):
            out[m, n] = (high[m] - low[m]) / width


@kernel
def vary(tab, field, s, t, h, y, columns, new, sizes, slopes, j, low, high):
    """Advance the columns over the step whose stages are in `s`, into `new`.

    Returns the mean divergence over the step, and the error in units of the tolerance.
    """
    d = field.size
    trace = 0.0
    for i in range(13):
        for n in range(d):
            x = 0.0
            for m in range(i):
                x += tab.a[i, m] * s.k[m, n]
            s.stage[n] = y[n] + h * x
        jacobian(field, t + tab.c[i] * h, s.stage, sizes, low, high, j)
        for n in range(d):
            trace += tab.a[12, i] * j[n, n]
        for column in range(d):
            for n in range(d):
                x = 0.0
                for m in range(i):
                    x += tab.a[i, m] * slopes[m, n, column]
                low[n] = columns[n, column] + h * x
                if i == 12:
                    new[n, column] = low[n]
            for n in range(d):
                x = 0.0
                for m in range(d):
                    x += j[n, m] * low[m]
                slopes[i, n, column] = x
    worst = 0.0
    for column in range(d):
        third = fifth = 0.0
        for n in range(d):
            e3 = e5 = 0.0
            for i in range(13):
                e3 += tab.errors[0, i] * slopes[i, n, column]
                e5 += tab.errors[1, i] * slopes[i, n, column]
            third, fifth = third + e3 * e3, fifth + e5 * e5
        if fifth > 0:
            worst = max(worst, h * fifth / math.sqrt(fifth + 0.01 * third) / TOLERANCE)
    return trace, worst


@kernel
def orthonormalize(columns, growth):
    """Gram-Schmidt, twice for each column; adds the logarithms of the lengths."""
    d = len(columns)
    for column in range(d):
        for _ in range(2):
            for other in range(column):
                x = 0.0
                for n in range(d):
                    x += columns[n, other] * columns[n, column]
                for n in range(d):
                    columns[n, column] -= x * columns[n, other]
        x = 0.0
        for n in range(d):
            x += columns[n, column] ** 2
        x = math.sqrt(x)
        growth[column] += math.log(x)
        for n in range(d):
            columns[n, column] /= x


@kernel
def carry(tab, field, s, course, end, steps, columns, growth, new, sizes, slopes, j, low, high):
    """Advance the flow and its columns to `end` within a number of steps; status.

    `growth` adds up the logarithms of the columns' growth, and in its last entry the divergence.
    """
    d = field.size
    y = course.state
    if course.pace[WISH] == 0.0:
        rates_at(field, course.clock[TIME], 0.0, y, course.rate)
    for _ in range(steps):
        t = course.clock[TIME]
        if t >= end:
            return DONE
        h = stride(tab, field, s, course, end - t)
        if h == 0.0:
            return DIVERGED
        for n in range(d):
            sizes[n] = max(sizes[n], abs(y[n]))
        trace, error = vary(tab, field, s, t, h, y, columns, new, sizes, slopes, j, low, high)
        if error > 1:
            course.pace[WISH] = h * max(0.2, 0.9 * error**-0.125)
            continue
        if not error <= 1:
            return DIVERGED
        course.pace[WISH] = min(
            course.pace[WISH], h * (0.9 * error**-0.125 if error > 1e-6 else 5.0)
        )
        growth[d] += h * trace
        for n in range(d):
            for m in range(d):
                columns[n, m] = new[n, m]
        orthonormalize(columns, growth)
        go(s, course, h, end)
    return EXHAUSTED
