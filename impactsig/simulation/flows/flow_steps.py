"""Kernels that step a flow by Dormand and Prince's 8(5,3), with dense output."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ..basis.delay import DISPLACEMENT, fed
from ..basis.events import DIVERGED, DONE, EXHAUSTED, ROUNDED, TIME, WISH

TOLERANCE = 1e-13


class Field(NamedTuple):
    """The flow and its signal."""

    rates: object
    signal: object
    coordinate: int  # the signal is that one; -1: a function
    parameters: np.ndarray
    size: int  # coordinates of the flow
    followed: int  # the same, and one more where the integral of the signal is followed
    fires: object = None  # True where it is; None: kernels are compiled without it
    control: object = None  # a `Control` where there is one


class Course(NamedTuple):
    """The state of the integration.

    After the coordinates, state and rate hold the integral, where one fires, and then zeros: the
    length of all arrays of coordinates is a multiple of 4, so that the innermost loops are of fixed
    length.
    """

    clock: np.ndarray  # time, and what rounding took from it
    state: np.ndarray
    rate: np.ndarray
    pace: np.ndarray  # step to try next, side of the level


class Scratch(NamedTuple):
    """Work arrays for one step; d as in `Course`."""

    k: np.ndarray  # (16, d)
    stage: np.ndarray  # (d,)
    rate: np.ndarray  # (d,)
    error3: np.ndarray  # (d,)
    error5: np.ndarray  # (d,)
    new: np.ndarray  # (d,) state at the end of the step
    landing: np.ndarray  # (d,) and of a shorter one
    dense: np.ndarray  # (7, d)
    gauge: np.ndarray  # (GAUGE_DEGREE + 1,)
    stack: np.ndarray  # (DEPTH + 2, GAUGE_DEGREE + 3): coefficients and ends of a part of the step
    coefficients: np.ndarray  # (GAUGE_DEGREE + 1,)
    ladder: np.ndarray  # (GAUGE_DEGREE + 1,)


@kernel
def rates_at(field, t, tau, y, out):
    """Rates of the coordinates and of the integral, tau after the instant t."""
    field.rates(t + tau, y.ctypes, field.parameters.ctypes, out.ctypes)
    steer(field.control, tau, y, out)
    if field.fires is not None:
        out[field.size] = field.signal(y.ctypes, field.coordinate)


@inlined
def steer(control, tau, y, out):
    """Add the feedback to the rate of its coordinate."""
    if control is not None:
        k = control.feedback.signal - DISPLACEMENT
        out[k] += fed(control, tau, y[k])


@inlined
def weigh(weights, i, k, stages, out):
    """Weighted sum of the first rates.

    Two sums of four side by side, because one waits for each addition. Where the stages are odd in
    number, the next one's weight is zero; its rate must be finite.
    """
    for n in range(0, len(out), 4):
        a = b = c = d = 0.0
        e = f = g = h = 0.0
        for j in range(0, stages, 2):
            one, two = weights[i, j], weights[i, j + 1]
            a += one * k[j, n]
            b += one * k[j, n + 1]
            c += one * k[j, n + 2]
            d += one * k[j, n + 3]
            e += two * k[j + 1, n]
            f += two * k[j + 1, n + 1]
            g += two * k[j + 1, n + 2]
            h += two * k[j + 1, n + 3]
        out[n] = a + e
        out[n + 1] = b + f
        out[n + 2] = c + g
        out[n + 3] = d + h


@inlined
def stages(
    a, c, rates, signal, number, p, size, control, fires, k, stage, rate, first, last, t, h, y
):
    """Work out some stages from those before them.

    Arrays one by one: to pass them in tuples costs more than the stages do.
    """
    at, parameters, out = stage.ctypes, p.ctypes, rate.ctypes
    for i in range(first, last):
        for n in range(len(y)):
            k[i, n] = 0.0
        weigh(a, i, k, i, stage)
        for n in range(len(y)):
            stage[n] = y[n] + h * stage[n]
        rates(t + c[i] * h, at, parameters, out)
        steer(control, c[i] * h, stage, rate)
        if fires is not None:
            rate[size] = signal(at, number)
        for n in range(len(y)):
            k[i, n] = rate[n]


@kernel
def take(tab, field, s, t, h, y, into):
    """A step of h; stage 0 has been worked out."""
    stages(
        tab.a, tab.c, field.rates, field.signal, field.coordinate, field.parameters, field.size,
        field.control, field.fires, s.k, s.stage, s.rate, 1, 12, t, h, y,
    )  # fmt: skip
    weigh(tab.a, 12, s.k, 12, into)
    for n in range(len(y)):
        into[n] = y[n] + h * into[n]


@kernel
def error_of(tab, s, h, y, size):
    """Error of the step just taken, in units of the tolerance.

    Every coordinate counts by its own size, or by what the step changes of it.
    """
    s.k[13] = 0.0
    weigh(tab.errors, 0, s.k, 13, s.error3)
    weigh(tab.errors, 1, s.k, 13, s.error5)
    sum3 = sum5 = 0.0
    for n in range(size):
        e3, e5 = s.error3[n], s.error5[n]
        greatest = 0.0
        for i in range(0, 13, 4):
            greatest = max(greatest, abs(s.k[i, n]))
        scale = TOLERANCE * max(abs(y[n]), abs(s.new[n]), h * greatest)
        if scale > 0:
            sum3 += (e3 / scale) ** 2
            sum5 += (e5 / scale) ** 2
        elif not math.isfinite(e5):
            return math.nan
    if sum5 == 0.0:
        return 0.0
    return h * sum5 / math.sqrt((sum5 + 0.01 * sum3) * size)


@kernel
def stride(tab, field, s, course, most):
    """A step within the tolerance, no longer than `most`, into `s.new`; 0 where none is."""
    t, y = course.clock[TIME], course.state
    for n in range(len(y)):
        s.k[0, n] = course.rate[n]
    wish = course.pace[WISH]
    if wish == 0.0:
        size, speed = 0.0, 0.0
        for n in range(len(y)):
            size, speed = max(size, abs(y[n])), max(speed, abs(course.rate[n]))
        # A guess; the error estimate corrects it.
        wish = 0.01 * size / speed if size > 0 and speed > 0 else 1e-6
    grow = 6.0
    while True:
        h = min(wish, most)
        take(tab, field, s, t, h, y, s.new)
        rates_at(field, t, h, s.new, s.k[12])
        error = error_of(tab, s, h, y, field.followed)
        if math.isfinite(error) and error <= 1.0:
            factor = grow if error == 0.0 else min(grow, 0.9 * error**-0.125)
            if h == wish or factor < 1.0:
                wish = h * factor
            course.pace[WISH] = wish
            return h
        wish = h * (max(0.2, 0.9 * error**-0.125) if math.isfinite(error) else 0.1)
        grow = 1.0
        if t + wish == t or wish < 1e-300:
            return 0.0


@kernel
def go(s, course, h, end):
    """Move to the end of the step."""
    clock = course.clock
    if h >= end - clock[TIME]:
        clock[TIME], clock[ROUNDED] = end, 0.0
    else:
        step = h + clock[ROUNDED]
        total = clock[TIME] + step
        clock[ROUNDED] = step - (total - clock[TIME])
        clock[TIME] = total
    for n in range(len(s.new)):
        course.state[n], course.rate[n] = s.new[n], s.k[12, n]


@kernel
def finish(tab, field, s, t, h, y):
    """Compute the last stages of the step, which only its interpolant needs."""
    stages(
        tab.a, tab.c, field.rates, field.signal, field.coordinate, field.parameters, field.size,
        field.control, field.fires, s.k, s.stage, s.rate, 13, 16, t, h, y,
    )  # fmt: skip


@kernel
def interpolate(tab, field, s, t, h, y):
    """Prepare the interpolant: of the integral where one fires, else of the coordinates."""
    finish(tab, field, s, t, h, y)
    first = 0 if field.fires is None else field.size
    for n in range(first, field.followed):
        gain = s.new[n] - y[n]
        s.dense[0, n] = gain
        s.dense[1, n] = h * s.k[0, n] - gain
        s.dense[2, n] = 2 * gain - h * (s.k[12, n] + s.k[0, n])
        for m in range(4):
            total = 0.0
            for i in range(16):
                total += tab.d[m, i] * s.k[i, n]
            s.dense[3 + m, n] = h * total


@kernel
def between(s, y, share, n):
    """A coordinate at a share of the step."""
    value = 0.0
    for m in range(6, -1, -1):
        value = (value + s.dense[m, n]) * (share if m % 2 == 0 else 1 - share)
    return y[n] + value


@kernel
def states(tab, field, s, course, instants, out, done, steps):
    """States at as many ascending instants as `out` holds, from `done` on.

    The last instant is where the run ends, to which the last step is shortened. Returns how the
    calculation ended, and how many states are done.
    """
    y = course.state
    if course.pace[WISH] == 0.0:
        rates_at(field, course.clock[TIME], 0.0, y, course.rate)
    for _ in range(steps):
        t = course.clock[TIME]
        while done < len(out) and instants[done] <= t:
            for n in range(field.size):
                out[done, n] = y[n]
            done += 1
        if done == len(out):
            return DONE, done
        end = instants[-1]
        h = stride(tab, field, s, course, end - t)
        if h == 0.0:
            return DIVERGED, done
        after = end if h >= end - t else t + h
        if instants[done] < after:
            interpolate(tab, field, s, t, h, y)
            while done < len(out) and instants[done] < after:
                share = min((instants[done] - t - course.clock[ROUNDED]) / h, 1.0)
                for n in range(field.size):
                    out[done, n] = between(s, y, share, n)
                done += 1
        go(s, course, h, end)
    return EXHAUSTED, done
