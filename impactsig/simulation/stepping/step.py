"""One step: of Dormand and Prince's method as long as the tolerance allows, or a classical one.

[HairerNorsettWanner1993]_, section II.10: stages, error estimates of orders 5 and 3, and the
interpolant of degree 7, here as Bernstein coefficients.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined, kernel
from ..basis.tableau import DEGREE
from .rates import accelerate, pull


@inlined
def classical(law, control, leg, waves, hertz, t, h, y, v, a):
    """Increment of position and velocity over a classical step, t after the start of the leg."""
    v1 = v + h / 2 * a
    a1 = accelerate(law, control, leg, waves, hertz, t + h / 2, y + h / 2 * v, v1)
    v2 = v + h / 2 * a1
    a2 = accelerate(law, control, leg, waves, hertz, t + h / 2, y + h / 2 * v1, v2)
    v3 = v + h * a2
    a3 = accelerate(law, control, leg, waves, hertz, t + h, y + h * v2, v3)
    return h / 6 * (v + 2 * v1 + 2 * v2 + v3), h / 6 * (a + 2 * a1 + 2 * a2 + a3)


@inlined
def stages(law, control, leg, waves, hertz, a, c, kq, kv, first, last, h, y, v):
    """Compute some stages from those before them."""
    for i in range(first, last):
        x = u = 0.0
        for j in range(i):
            x += a[i, j] * kq[j]
            u += a[i, j] * kv[j]
        kq[i] = v + h * u
        kv[i] = accelerate(law, control, leg, waves, hertz, c[i] * h, y + h * x, kq[i])


@kernel
def take(fixed, tab, f, leg, s, h, y, v, a):
    """Increment of position and velocity over a step of h from y, v with acceleration a."""
    if fixed > 0:
        return classical(f.law, f.control, leg, s.waves, s.hertz, 0.0, h, y, v, a)
    kq, kv = s.kq, s.kv
    kq[0], kv[0] = v, a
    stages(f.law, f.control, leg, s.waves, s.hertz, tab.a, tab.c, kq, kv, 1, 12, h, y, v)
    dq = dv = 0.0
    for i in range(12):
        dq += tab.a[12, i] * kq[i]
        dv += tab.a[12, i] * kv[i]
    return h * dq, h * dv


@inlined
def error(p, rate, tab, s, h, y, v, dv, speed):
    """Error of the step just taken, in units of the tolerance.

    In units of velocity: a displacement counts by the rate of the leg. The tolerance is relative to
    the speed and what the step changes of it, but to no less than a thousandth of the greatest
    speed so far; and rounding, of forces that cancel too, is no error of the step's.
    """
    q3 = v3 = q5 = v5 = 0.0
    for i in range(13):
        q3 += tab.errors[0, i] * s.kq[i]
        v3 += tab.errors[0, i] * s.kv[i]
        q5 += tab.errors[1, i] * s.kq[i]
        v5 += tab.errors[1, i] * s.kv[i]
    n3 = (rate * q3) ** 2 + v3 * v3
    n5 = (rate * q5) ** 2 + v5 * v5
    if n5 == 0.0 and n3 == 0.0:
        return 0.0
    scale = max(abs(v), abs(v + dv), h * abs(s.kv[0]), 1e-3 * speed)
    allowed = max(p.tolerance * scale + 1e-15 * rate * abs(y), h * p.rounding)
    return h * n5 / math.sqrt(2 * (n5 + 0.01 * n3)) / allowed


@kernel
def first_step(p, leg):
    """Initial step size; the error estimate corrects it."""
    if leg.hertz > 0:
        # depth^n is not smooth where contact begins.
        return p.tolerance ** (1 / 3.5) / leg.rate
    return min(6 * p.tolerance**0.125 / leg.rate, p.longest)


@kernel
def stride(p, tab, f, leg, s, wish, end, y, v, a, speed):
    """One step within the tolerance, no longer than `end`.

    Returns its length (0 where no step of any length has a finite end), what position and velocity
    gain, the step to try next, and how many were tried.
    """
    if p.fixed > 0:
        h = min(p.fixed, end)
        dq, dv = take(p.fixed, tab, f, leg, s, h, y, v, a)
        return h if math.isfinite(dq) and math.isfinite(dv) else 0.0, dq, dv, p.fixed, 1
    h = wish if wish > 0 else first_step(p, leg)
    # A jump of the force costs an error of the step's length, so that shorter ones gain nothing.
    least = 1e-3 * p.tolerance / leg.rate
    grow = 6.0
    tries = 0
    while True:
        tries += 1
        step = min(h, end)
        dq, dv = take(p.fixed, tab, f, leg, s, step, y, v, a)
        s.kq[12] = v + dv
        s.kv[12] = pull(f, leg, s, step, y + dq, v + dv)
        size = error(p, leg.rate, tab, s, step, y, v, dv, speed)
        if not math.isfinite(size):
            if step <= least:
                return 0.0, dq, dv, h, tries
            h = 0.1 * step
            continue
        factor = min(grow, max(0.2, 0.9 * size**-0.125)) if size > 0 else grow
        if size <= 1 or step <= least:
            return step, dq, dv, h if step < h else min(h * factor, p.longest), tries
        h = step * min(factor, 0.9)
        grow = 1.0


@kernel
def expand(tab, h, gain, rates, out):
    """Bernstein coefficients of what one of them gains over a step, from its rates of change."""
    for n in range(DEGREE + 1):
        out[n] = 0.0
    for m in range(DEGREE):
        if m == 0:
            part = gain
        elif m == 1:
            part = h * rates[0] - gain
        elif m == 2:
            part = 2 * gain - h * (rates[12] + rates[0])
        else:
            part = 0.0
            for i in range(16):
                part += tab.d[m - 3, i] * rates[i]
            part *= h
        for n in range(DEGREE + 1):
            out[n] += tab.bernstein[n, m] * part
    out[1] = h * rates[0] / DEGREE  # without the rounding: small gaps live on it
    out[DEGREE] = gain


@kernel
def interpolate(tab, f, leg, s, h, y, v, dq, dv):
    """Bernstein coefficients of what position and velocity gain over the step just taken."""
    stages(
        f.law, f.control, leg, s.waves, s.hertz, tab.a, tab.c, s.kq, s.kv, 13, 16, h, y, v
    )  # fmt: skip
    expand(tab, h, dq, s.kq, s.q)
    expand(tab, h, dv, s.kv, s.v)
