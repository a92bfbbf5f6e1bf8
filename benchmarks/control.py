"""Delayed feedback: time against error, beside the ways it is done elsewhere.

The beam at 20.3355 Hz under K = 0.15, F0 = 0.1, switched on after 2 forcing periods: `control` by
power series and at several tolerances, and the thesis' way, the classical Runge-Kutta method with
steps of one length that are halved to land on an impact and a history that is interpolated,
compiled as well. Errors are the greatest of displacement and velocity over 8 periods, against
Taylor series in 25 digits (tests/naive_control.py). Then Rössler's flow, beside jitcdde where that
is installed; errors are those at the end, against the classical method with 32 768 steps a delay.
Times are processor times of one thread, the best of five, compilation excluded. Last, what OGY and
the linearised motion cost. Writes results/control.json and control.md; a minute or two.

    python -m benchmarks.control
"""

from __future__ import annotations

import contextlib
import importlib.util
import math
import tempfile
import time
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from numba import njit

from impactsig import (
    OGY,
    Controlled,
    DelayedFeedback,
    RungeKutta,
    find_periodic_orbit,
    flows,
    orbit_stability,
    scenes,
    simulate,
)
from tests import naive_control

from .saving import save, versions

BEAM = scenes.karpodinis(20.3355)
OMEGA = BEAM.angular_forcing_frequency
PERIODS, START, LONG = 8, 2, 1000
GAIN, LIMIT = 0.15, 0.1
FEEDBACK = DelayedFeedback(GAIN, 1, LIMIT)
INITIAL = (0.3, 0.1)
DELAY, LENGTH = 5.881, 60.0  # of Rössler's flow


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """What it gives, and the least processor time of five [s]."""
    result, best = work(), math.inf
    for _ in range(5):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return result, best


# -- the thesis' way -------------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def late(v, slope, h, n, share, cubic):
    """The velocity a share of a step after that n, by a line or by Hermite's cubic."""
    if not cubic:
        return v[n] + share * (v[n + 1] - v[n])
    s = 1 - share
    return (
        v[n] * s * s * (1 + 2 * share) + v[n + 1] * share * share * (1 + 2 * s)
        + h * share * s * (slope[n] * s - slope[n + 1] * share)
    )  # fmt: skip


@njit(cache=True, nogil=True)
def classical(steps, periods, start, gain, limit, x, u, omega, cubic):
    """The beam by the classical method: states at the steps; impacts break the history's smoothness
    within a step, which it takes no notice of."""
    h = 2 * math.pi / omega / steps
    total = steps * periods
    out = np.empty((total + 1, 2))
    v, slope = np.empty(total + 1), np.empty(total + 1)
    out[0, 0], out[0, 1], v[0] = x, u, u
    for n in range(total):
        on = n >= start * steps
        t, part, left = n * h, h, h
        while left > 1e-15:
            part = min(part, left)
            share = (h - left) / h
            k = np.empty((4, 2))
            for i in range(4):
                c = 0.0 if i == 0 else (1.0 if i == 3 else 0.5)
                a = x + (c * part * k[i - 1, 0] if i else 0.0)
                b = u + (c * part * k[i - 1, 1] if i else 0.0)
                push = 0.25 * math.cos(omega * (t + h - left + c * part))
                if on:
                    at = share + c * part / h
                    force = gain * (late(v, slope, h, n - steps, min(at, 1.0), cubic) - b)
                    push += min(max(force, -limit), limit)
                k[i, 0], k[i, 1] = b, push - 0.06 * b - a
            if n < total and left == h:
                slope[n] = k[0, 1]
            new = x + part / 6 * (k[0, 0] + 2 * k[1, 0] + 2 * k[2, 0] + k[3, 0])
            if new > 1 and part > 1e-15:
                part /= 2
                continue
            u += part / 6 * (k[0, 1] + 2 * k[1, 1] + 2 * k[2, 1] + k[3, 1])
            left -= part
            x = new
            if x >= 1 - 1e-14 and u > 0:
                u = -0.2 * u
                part = left
        out[n + 1, 0], out[n + 1, 1], v[n + 1] = x, u, u
        slope[n + 1] = 0.25 * math.cos(omega * (t + h)) - 0.06 * u - x
    return out


def beam() -> list[dict]:
    with mpmath.workdps(25):
        omega = mpmath.mpf(OMEGA)
        period = 2 * mpmath.pi / omega
        known = (mpmath.mpf(0.03), omega, mpmath.mpf(0.25), mpmath.mpf(0.2), mpmath.mpf(GAIN))
        pieces, _ = naive_control.controlled(
            *known, period, START * period, PERIODS * period, limit=mpmath.mpf(LIMIT),
            initial=tuple(map(mpmath.mpf, INITIAL)),
        )  # fmt: skip
        shares = (np.arange(16 * PERIODS) + 0.5) / 16
        exact = np.array(
            [[float(c) for c in naive_control.state(pieces, own * period)[:2]] for own in shares]
        )
    rows = []
    for tolerance in (None, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
        method = None if tolerance is None else RungeKutta(tolerance)
        options = {"initial": INITIAL, "method": method}
        motion = simulate(Controlled(BEAM, FEEDBACK, start=START), periods=PERIODS, **options)
        found = np.stack(motion.sample(shares * BEAM.forcing_period), axis=1)
        _, spent = timed(
            lambda options=options: simulate(
                Controlled(BEAM, FEEDBACK, start=START), periods=LONG, **options
            )
        )
        name = "control, power series" if method is None else f"control, RungeKutta({tolerance:g})"
        rows.append(row(name, found - exact, spent / LONG))
    for cubic in (False, True):
        for steps in (32, 320, 3200, 32_000):
            given = (START, GAIN, LIMIT, *INITIAL, OMEGA, cubic)
            found = classical(steps, PERIODS, *given)[steps // 32 :: steps // 16]
            long = min(LONG, 100_000_000 // steps // LONG * 10)
            _, spent = timed(lambda g=given, s=steps, n=long: classical(s, n, *g))
            name = f"classical, {steps} steps a period, {'cubic' if cubic else 'linear'} history"
            rows.append(row(name, found - exact, spent / long))
    return rows


def row(name: str, off: np.ndarray, seconds: float) -> dict:
    return {"method": name, "error": float(np.abs(off).max()), "us": 1e6 * seconds}


# -- Rössler ---------------------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def roessler(steps, turns, gain, y0):
    """Rössler's flow by the classical method, controlled from the first delay on."""
    h = 5.881 / steps
    total = steps * turns
    y, slope = np.empty((total + 1, 3)), np.empty((total + 1, 3))
    y[0] = y0
    k = np.empty((4, 3))
    for n in range(total):
        for i in range(4):
            c = 0.0 if i == 0 else (1.0 if i == 3 else 0.5)
            a = y[n] + c * h * k[i - 1] if i else y[n].copy()
            k[i, 0], k[i, 1], k[i, 2] = -a[1] - a[2], a[0] + 0.2 * a[1], 0.2 + a[2] * (a[0] - 5.7)
            if n >= steps:
                m = n - steps
                back = late(y[:, 1], slope[:, 1], h, m, c, True)
                k[i, 1] += gain * (back - a[1])
        slope[n] = k[0]
        y[n + 1] = y[n] + h / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
        if n + 1 == steps:  # the last of the uncontrolled slopes, for the history
            a = y[n + 1]
            slope[n + 1, 1] = a[0] + 0.2 * a[1]
    return y


def flow() -> list[dict]:
    turns = 10
    end = turns * DELAY
    initial = np.array(flows.rossler().initial)
    exact = roessler(32_768, turns, 0.2, initial)[-1]
    feedback = DelayedFeedback(0.2, DELAY, signal="y")
    course, spent = timed(lambda: simulate(Controlled(flows.rossler(), feedback), duration=end))
    rows = [row("control", course.final - exact, spent / turns)]
    for steps in (256, 2048):
        found, spent = timed(lambda s=steps: roessler(s, turns, 0.2, initial))
        rows.append(row(f"classical, {steps} steps a delay", found[-1] - exact, spent / turns))
    if importlib.util.find_spec("jitcdde"):
        rows += [by_jitcdde(rtol, turns, initial, exact) for rtol in (1e-5, 1e-8, 1e-11)]
    return rows


def by_jitcdde(rtol: float, turns: int, initial: np.ndarray, exact: np.ndarray) -> dict:
    import symengine
    from jitcdde import jitcdde, t, y

    gain = symengine.Symbol("gain")
    rates = [
        -y(1) - y(2),
        y(0) + 0.2 * y(1) + gain * (y(1, t - DELAY) - y(1)),
        0.2 + y(2) * (y(0) - 5.7),
    ]
    solver = jitcdde(rates, control_pars=[gain], max_delay=DELAY, verbose=False)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        solver.compile_C(verbose=False)  # its build looks for a project where it is called
    best = math.inf
    for _ in range(3):
        solver.purge_past()
        solver.constant_past(initial, time=0.0)
        solver.set_parameters(0.0)
        solver.set_integration_parameters(
            rtol=rtol, atol=rtol, first_step=1e-3, max_step=1.0, min_step=1e-12
        )
        start = time.process_time()
        solver.adjust_diff()
        solver.integrate(DELAY)
        solver.set_parameters(0.2)
        solver.adjust_diff()
        found = solver.integrate(turns * DELAY)
        best = min(best, time.process_time() - start)
    return row(f"jitcdde, rtol {rtol:g}", found - exact, best / turns)


# -- the rest --------------------------------------------------------------------------------------


def others() -> list[dict]:
    orbit = find_periodic_orbit(BEAM, 1, impacts=1)
    how = OGY(orbit, 0.03)
    _, nudged = timed(lambda: simulate(Controlled(BEAM, how), periods=LONG))
    _, linear = timed(lambda: orbit_stability(orbit, FEEDBACK))
    cycle, search = timed(lambda: find_periodic_orbit(flows.rossler(), period=DELAY))
    own = DelayedFeedback(0.2, cycle.period, signal="y")
    _, multipliers = timed(lambda: orbit_stability(cycle, own))
    return [
        {"what": "OGY, a forcing period, on average [us]", "value": 1e6 * nudged / LONG},
        {"what": "orbit_stability, 1200 periods [ms]", "value": 1e3 * linear},
        {"what": "find_periodic_orbit, Rössler, one turn [ms]", "value": 1e3 * search},
        {"what": "orbit_stability of it [ms]", "value": 1e3 * multipliers},
    ]


def table(rows: list[dict], unit: str) -> str:
    head = f"| method | error | µs {unit} |\n|---|---|---|\n"
    return head + "".join(f"| {r['method']} | {r['error']:.1e} | {r['us']:.3g} |\n" for r in rows)


def main() -> None:
    tables = {"beam": beam(), "rossler": flow(), "others": others()}
    text = f"Beam, {PERIODS} periods\n\n{table(tables['beam'], 'a forcing period')}\n"
    text += f"Rössler, ten delays\n\n{table(tables['rossler'], 'a delay')}\n"
    text += "".join(f"{r['what']}: {r['value']:.3g}\n" for r in tables["others"])
    print(text)
    save("control", {"about": versions("numpy"), **tables}, text)


if __name__ == "__main__":
    main()
