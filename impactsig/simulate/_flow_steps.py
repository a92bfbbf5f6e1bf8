"""Kernels: a flow from step to step, the spikes in each step, and states between.

Dormand and Prince's 8(5,3) with its interpolant of degree 7. What spikes are looked for in, the
integral of the signal or the signal itself, is made a polynomial of degree 11 over the step, in
Bernstein form: its coefficients bound it, so that where they have one sign there is no root, where
the sign changes once there is one, and else halving decides. A root is then corrected by a step
that ends there, which is of order 8 where the interpolant is of 7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from ._tableau import DEGREE

MORE, DONE, DIVERGED, ENDLESS = range(4)
DEPTH = 44  # halvings of a step after which two roots are one, that only touches the level
TOLERANCE = 1e-13


class Task(NamedTuple):
    """What is looked for, and until when."""

    fires: bool  # integrate and fire; else crossings
    level: float  # threshold of the integral, or level of the signal
    up: bool
    down: bool
    end: float
    wanted: int  # spikes to find


class Field(NamedTuple):
    """The flow and its signal."""

    rates: object
    signal: object
    coordinate: int  # the signal is that one; -1: a function
    parameters: np.ndarray
    size: int  # coordinates of the flow


class Course(NamedTuple):
    """Where the flow is.

    After the coordinates, state and rate hold the integral, where one fires, and then zeros: the
    length of all arrays of coordinates is a multiple of 4, so that the innermost loops are of fixed
    length.
    """

    clock: np.ndarray  # time, and what rounding took from it
    state: np.ndarray
    rate: np.ndarray
    pace: np.ndarray  # step to try next (0: none yet), side of the level (-1, 0 not known, 1)


class Scratch(NamedTuple):
    """Room for one step; d as in `Course`."""

    k: np.ndarray  # (16, d)
    stage: np.ndarray  # (d,)
    rate: np.ndarray  # (d,)
    error3: np.ndarray  # (d,)
    error5: np.ndarray  # (d,)
    new: np.ndarray  # (d,) state at the end of the step
    landing: np.ndarray  # (d,) and of a shorter one
    dense: np.ndarray  # (7, d)
    gauge: np.ndarray  # (DEGREE + 1,)
    stack: np.ndarray  # (DEPTH + 2, DEGREE + 3): coefficients and ends of a part of the step
    coefficients: np.ndarray  # (DEGREE + 1,)
    ladder: np.ndarray  # (DEGREE + 1,)


@njit(cache=True, nogil=True, error_model="numpy")
def rates_at(field, fires, t, y, out):
    """Rates of the coordinates and, where one fires, of the integral."""
    field.rates(t, y.ctypes, field.parameters.ctypes, out.ctypes)
    if fires:
        out[field.size] = field.signal(y.ctypes, field.coordinate)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def weigh(weights, i, k, stages, out):
    """Sum of the first rates by a row of weights.

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


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def stages(a, c, rates, signal, number, p, size, fires, k, stage, rate, first, last, t, h, y):
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
        if fires:
            rate[size] = signal(at, number)
        for n in range(len(y)):
            k[i, n] = rate[n]


@njit(cache=True, nogil=True, error_model="numpy")
def take(tab, field, fires, s, t, h, y, into):
    """A step of h; stage 0 has been worked out."""
    stages(
        tab.a, tab.c, field.rates, field.signal, field.coordinate, field.parameters, field.size,
        fires, s.k, s.stage, s.rate, 1, 12, t, h, y,
    )  # fmt: skip
    weigh(tab.a, 12, s.k, 12, into)
    for n in range(len(y)):
        into[n] = y[n] + h * into[n]


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def stride(tab, field, fires, s, course, end):
    """A step within the tolerance, not beyond `end`, into `s.new`; its length, 0 where none is."""
    t, y = course.clock[0], course.state
    s.k[0] = course.rate
    wish = course.pace[0]
    if wish == 0.0:
        size, speed = 0.0, 0.0
        for n in range(len(y)):
            size, speed = max(size, abs(y[n])), max(speed, abs(course.rate[n]))
        # A guess; the error estimate corrects it.
        wish = 0.01 * size / speed if size > 0 and speed > 0 else 1e-6
    grow = 6.0
    while True:
        h = min(wish, end - t)
        take(tab, field, fires, s, t, h, y, s.new)
        rates_at(field, fires, t + h, s.new, s.k[12])
        error = error_of(tab, s, h, y, field.size + fires)
        if math.isfinite(error) and error <= 1.0:
            factor = grow if error == 0.0 else min(grow, 0.9 * error**-0.125)
            if h == wish or factor < 1.0:
                wish = h * factor
            course.pace[0] = wish
            return h
        wish = h * (max(0.2, 0.9 * error**-0.125) if math.isfinite(error) else 0.1)
        grow = 1.0
        if t + wish == t or wish < 1e-300:
            return 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def go(s, course, h, end):
    """To the end of the step."""
    clock = course.clock
    if h >= end - clock[0]:
        clock[0], clock[1] = end, 0.0
    else:
        step = h + clock[1]
        total = clock[0] + step
        clock[1] = step - (total - clock[0])
        clock[0] = total
    course.state[:] = s.new
    course.rate[:] = s.k[12]


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(tab, field, fires, s, t, h, y):
    """Prepare the interpolant: of the integral where one fires, else of the coordinates."""
    stages(
        tab.a, tab.c, field.rates, field.signal, field.coordinate, field.parameters, field.size,
        fires, s.k, s.stage, s.rate, 13, 16, t, h, y,
    )  # fmt: skip
    first = field.size if fires else 0
    for n in range(first, field.size + fires):
        gain = s.new[n] - y[n]
        s.dense[0, n] = gain
        s.dense[1, n] = h * s.k[0, n] - gain
        s.dense[2, n] = 2 * gain - h * (s.k[12, n] + s.k[0, n])
        for m in range(4):
            total = 0.0
            for i in range(16):
                total += tab.d[m, i] * s.k[i, n]
            s.dense[3 + m, n] = h * total


@njit(cache=True, nogil=True, error_model="numpy")
def between(s, y, share, n):
    """A coordinate at a share of the step."""
    value = 0.0
    for m in range(6, -1, -1):
        value = (value + s.dense[m, n]) * (share if m % 2 == 0 else 1 - share)
    return y[n] + value


@njit(cache=True, nogil=True, error_model="numpy")
def watched(field, task):
    """Which entry of the state is compared with the level; -1: a function of them."""
    return field.size if task.fires else field.coordinate


@njit(cache=True, nogil=True, error_model="numpy")
def out_of_reach(field, task, s, h, y, level):
    """Whether what is watched cannot come to the level within the step.

    Its rate at none of the 13 stages being more than a quarter of what that would take. A step
    within the tolerance, in which the rate is a polynomial of low degree to 13 digits, cannot hide
    more between stages.
    """
    n = watched(field, task)
    if n < 0:
        return False
    greatest = 0.0
    for i in range(13):
        greatest = max(greatest, abs(s.k[i, n]))
    return abs(level - y[n]) > 4 * h * greatest


@njit(cache=True, nogil=True, error_model="numpy")
def gauge(tab, field, task, s, y):
    """What is compared with the level, at the nodes of the step."""
    only = watched(field, task)
    for j in range(DEGREE + 1):
        share = tab.nodes[j]
        if only >= 0:
            s.gauge[j] = between(s, y, share, only) if j < DEGREE else s.new[only]
            continue
        for n in range(field.size):
            s.stage[n] = between(s, y, share, n) if j < DEGREE else s.new[n]
        s.gauge[j] = field.signal(s.stage.ctypes, -1)


@njit(cache=True, nogil=True, error_model="numpy")
def pose(tab, s, level):
    """Bernstein coefficients of the gauge less the level, over the whole step."""
    for i in range(DEGREE + 1):
        total = 0.0
        for j in range(DEGREE + 1):
            total += tab.bernstein[i, j] * (s.gauge[j] - level)
        s.coefficients[i] = total
    # Steps must meet without a jump in which a crossing would be lost.
    s.coefficients[0] = s.gauge[0] - level
    s.coefficients[DEGREE] = s.gauge[DEGREE] - level


@njit(cache=True, nogil=True, error_model="numpy")
def value_at(c, ladder, x):
    """Value and slope of a polynomial in Bernstein form (de Casteljau)."""
    ladder[:] = c
    for m in range(DEGREE, 1, -1):
        for i in range(m):
            ladder[i] = (1 - x) * ladder[i] + x * ladder[i + 1]
    slope = ladder[1] - ladder[0]
    return ladder[0] + x * slope, DEGREE * slope


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def halve(stack, top):
    """Put both halves of the part on top of the stack in its place, the first one on top."""
    left, right = stack[top + 1], stack[top]
    low, high = right[DEGREE + 1], right[DEGREE + 2]
    middle = 0.5 * (low + high)
    for m in range(DEGREE + 1):
        left[m] = right[0]
        for i in range(DEGREE - m):
            right[i] = 0.5 * (right[i] + right[i + 1])
    # De Casteljau's last row, taken as it was made, is the second half.
    left[DEGREE + 1], left[DEGREE + 2] = low, middle
    right[DEGREE + 1], right[DEGREE + 2] = middle, high


@njit(cache=True, nogil=True, error_model="numpy")
def begin(s):
    """Put the whole step on the stack."""
    s.stack[0, : DEGREE + 1] = s.coefficients
    s.stack[0, DEGREE + 1], s.stack[0, DEGREE + 2] = 0.0, 1.0
    return 0


@njit(cache=True, nogil=True, error_model="numpy")
def next_crossing(s, top, side):
    """The next crossing: what is left on the stack, where (-1: nowhere), and the side after it.

    What is zero counts as still on the side it came from.
    """
    stack = s.stack
    while top >= 0:
        changes, last = 0, side
        for i in range(DEGREE + 1):
            value = stack[top, i]
            sign = 1.0 if value > 0 else (-1.0 if value < 0 else 0.0)
            if sign != 0.0:
                if last != 0.0 and sign != last:
                    changes += 1
                last = sign
        low, high = stack[top, DEGREE + 1], stack[top, DEGREE + 2]
        if changes == 0:
            side = last
            top -= 1
        elif changes == 1 and side != 0.0:
            top -= 1
            return top, root_in(s.coefficients, s.ladder, low, high, side), last
        elif high - low < 2.0**-DEPTH:
            top -= 1
            end = stack[top + 1, DEGREE]
            if end * side < 0:
                return top, high, -side
        else:
            if side == 0.0 and stack[top, 0] != 0.0:
                side = 1.0 if stack[top, 0] > 0 else -1.0
                continue
            halve(stack, top)
            top += 1
    return -1, -1.0, side


@njit(cache=True, nogil=True, error_model="numpy")
def correct(tab, field, task, s, t, h, y, level, share):
    """Correct a root by steps that end there; stages 1 to 11 of the step are lost."""
    for _ in range(5):
        value, slope = value_at(s.coefficients, s.ladder, share)
        if slope == 0.0:
            break
        take(tab, field, task.fires, s, t, share * h, y, s.landing)
        if task.fires:
            value = s.landing[field.size] - level
        else:
            value = field.signal(s.landing.ctypes, field.coordinate) - level
        change = value / slope
        if not abs(change) < 1e-3:
            break
        share = min(max(share - change, 0.0), 1.0)
        if abs(change) < 1e-9:
            break
    return share


@njit(cache=True, nogil=True, error_model="numpy")
def spikes(tab, field, task, s, course, steps):
    """Spikes in so many steps: how it ended, when they are, and how far the signal was."""
    times = np.empty(min(task.wanted, 256))
    found = 0
    y = course.state
    if course.pace[0] == 0.0:
        rates_at(field, task.fires, course.clock[0], y, course.rate)
        if task.fires:
            course.pace[1] = -1.0
    for _ in range(steps):
        t = course.clock[0]
        if t >= task.end:
            return DONE, times[:found]
        if t > 1e300:  # at rest, steps grow without end
            return ENDLESS, times[:found]
        h = stride(tab, field, task.fires, s, course, task.end)
        if h == 0.0:
            return DIVERGED, times[:found]
        if out_of_reach(field, task, s, h, y, task.level) and course.pace[1] != 0.0:
            go(s, course, h, task.end)
            continue
        interpolate(tab, field, task.fires, s, t, h, y)
        gauge(tab, field, task, s, y)
        for j in range(DEGREE + 1):
            if not math.isfinite(s.gauge[j]):
                return DIVERGED, times[:found]
        level = task.level
        side = course.pace[1]
        while True:
            pose(tab, s, level)
            top = begin(s)
            while top >= 0:
                top, share, side = next_crossing(s, top, side)
                if share < 0 or not (task.up if side > 0 else task.down):
                    continue
                share = correct(tab, field, task, s, t, h, y, level, share)
                at = t + (share * h + course.clock[1])
                if found == len(times):
                    more = np.empty(min(2 * found, task.wanted))
                    more[:found] = times
                    times = more
                # Two crossings within rounding of each other keep their order.
                times[found] = at if found == 0 else max(at, times[found - 1])
                found += 1
                if found == task.wanted:
                    return DONE, times
                if task.fires:
                    break
            if not task.fires or side < 0:
                break
            # Fired: what is integrated from here on has the next multiple to reach.
            level += task.level
            side = -1.0
        course.pace[1] = side
        go(s, course, h, task.end)
        if task.fires:
            y[field.size] -= level - task.level
    return MORE, times[:found]


@njit(cache=True, nogil=True, error_model="numpy")
def states(tab, field, s, course, instants, out, done, steps):
    """States at instants, ascending; those from `done` on. How it ended, and how many are done."""
    y = course.state
    if course.pace[0] == 0.0:
        rates_at(field, False, course.clock[0], y, course.rate)
    for _ in range(steps):
        t = course.clock[0]
        while done < len(instants) and instants[done] <= t:
            out[done] = y[: field.size]
            done += 1
        if done == len(instants):
            return DONE, done
        end = instants[-1]
        h = stride(tab, field, False, s, course, end)
        if h == 0.0:
            return DIVERGED, done
        after = end if h >= end - t else t + h
        if instants[done] < after:
            interpolate(tab, field, False, s, t, h, y)
            while instants[done] < after:
                share = min((instants[done] - t - course.clock[1]) / h, 1.0)
                for n in range(field.size):
                    out[done, n] = between(s, y, share, n)
                done += 1
        go(s, course, h, end)
    return MORE, done
