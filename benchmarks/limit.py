"""How near the exact engine's long runs come to what its mathematics must cost.

Between two impacts the engine evaluates the flow some times: position, velocity and two further
derivatives in closed form, which takes sines, cosines and an exponential. Counted is how often, by
the engine itself run as Python (NUMBA_DISABLE_JIT, in a process of its own); timed is what one
evaluation takes, each waiting for the one before as the engine's do (scalar), the same without
waiting (independent), and many side by side as a processor's vector lanes could for many machines
(the same closed form with sines, cosines and exponential by polynomials, whose greatest error is
told). Count times scalar cost is the scalar limit: an engine that did nothing else. The ratio is
that of a long run's time per impact to it. Short legs, which the engine evaluates by a Taylor
series, are counted apart, with their own cost.

Times are processor times of one thread, the least of five, compilation excluded. Writes
results/limit.json.

    python -m benchmarks.limit
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

import impactsig as im
from impactsig.simulation.exact.exact import ExactEngine
from impactsig.simulation.exact.flow import Leg, locate

from .saving import save

COUNTED, LONG, EVALUATIONS = 200, 20_000, 200_000
SCENES: dict[str, Callable[[], im.Oscillator]] = {
    "beam, 22.1 Hz (one impact a period)": lambda: im.scenes.karpodinis(22.1),
    "beam, 20.1 Hz (chaos)": lambda: im.scenes.karpodinis(20.1),
    "soft stop": lambda: im.scenes.okolewski(1.0, 0.6, "soft"),
    "friction": lambda: im.scenes.begley_virgin(0.5, 0.2, 0.1),
}


def count() -> None:
    """Evaluations of either kind, impacts and legs of each scene, as JSON; run as Python."""
    from impactsig.simulation.exact import engine, gap

    found = {}
    number = [0, 0]
    located = engine.locate

    def counting(leg: Any, tau: float) -> Any:
        number[int(tau * leg.rate < 0.25)] += 1
        return located(leg, tau)

    vars(engine)["locate"] = vars(gap)["locate"] = counting
    for name, scene in SCENES.items():
        number[:] = 0, 0
        motion = im.simulate(scene(), periods=COUNTED)
        found[name] = [*number, motion.impact_count]
    print(json.dumps(found))


@njit(error_model="numpy")
def one_by_one(leg: Any, taus: Any, waits: float) -> float:
    """Sum of what evaluations give; with 1e-300 each waits for the one before, with 0 not."""
    last = total = 0.0
    for tau in taus:
        x, v, a, jerk, _, _ = locate(leg, tau + waits * last)
        total += x + v + a + jerk
        last = total if waits != 0.0 else 0.0
    return total


@njit(fastmath=True, error_model="numpy")
def side_by_side(numbers: Any, taus: Any, out: Any) -> None:
    """The flow of an underdamped mode under one force, branch-free, for vector lanes."""
    ratio, cosine, sine, delta, root, z, w, kappa = numbers
    for k in range(len(taus)):
        tau = taus[k]
        c, s = _turned(ratio * tau)
        value, speed = cosine * c + sine * s, ratio * (sine * c - cosine * s)
        c, s = _turned(root * tau)
        decay = _decayed(delta * tau)
        c, s = decay * c, decay * s / root
        free, rate = z * c + (w + delta * z) * s, w * c - (kappa * z + delta * w) * s
        b = -2 * delta * rate - kappa * free
        out[0, k] = value + free
        out[1, k] = speed + rate
        out[2, k] = b - ratio * ratio * value
        out[3, k] = -2 * delta * b - kappa * rate - ratio * ratio * speed


@njit(fastmath=True, inline="always")
def _turned(x: float) -> tuple[float, float]:
    """Cosine and sine of an angle of up to some turns, by Taylor series in an eighth of a turn."""
    quarter = math.floor(x * (2 / math.pi) + 0.5)
    y = (x - quarter * 1.5707963267948966) - quarter * 6.123233995736766e-17
    y2 = y * y
    s = y * (
        1
        + y2
        * (
            -1 / 6
            + y2
            * (
                1 / 120
                + y2
                * (
                    -1 / 5040
                    + y2
                    * (
                        1 / 362880
                        + y2 * (-1 / 39916800 + y2 * (1 / 6227020800 - y2 / 1307674368000))
                    )
                )
            )
        )
    )
    c = 1 + y2 * (
        -1 / 2
        + y2
        * (
            1 / 24
            + y2
            * (
                -1 / 720
                + y2
                * (
                    1 / 40320
                    + y2
                    * (
                        -1 / 3628800
                        + y2 * (1 / 479001600 + y2 * (-1 / 87178291200 + y2 / 20922789888000))
                    )
                )
            )
        )
    )
    half = math.floor(quarter * 0.5)
    odd = quarter - 2 * half
    sign = 1 - 2 * (half - 2 * math.floor(half * 0.5))
    return sign * (c + odd * (-s - c)), sign * (s + odd * (c - s))


@njit(fastmath=True, inline="always")
def _decayed(x: float) -> float:
    """exp(-x) of a small x, as the 16th power of a series."""
    y = -x / 16
    e = 1 + y * (
        1
        + y
        * (
            1 / 2
            + y
            * (
                1 / 6
                + y
                * (
                    1 / 24
                    + y * (1 / 120 + y * (1 / 720 + y * (1 / 5040 + y * (1 / 40320 + y / 362880))))
                )
            )
        )
    )
    e = e * e
    e = e * e
    e = e * e
    return e * e


def least(work: Callable[[], Any]) -> float:
    """The least processor time of five [s], after a first call."""
    work()
    best = math.inf
    for _ in range(5):
        begun = time.process_time()
        work()
        best = min(best, time.process_time() - begun)
    return best


def per(work: Callable[[], Any]) -> float:
    """What one of many evaluations takes [ns]."""
    return least(work) / EVALUATIONS * 1e9


def costs() -> dict[str, float]:
    """What one evaluation takes [ns], in closed form, by the series and side by side."""
    problem = ExactEngine(im.scenes.karpodinis(22.1), 1e-6, True).problem
    ratio, cosine, sine = 1.0, problem.cosine[0, 0], problem.sine[0, 0]
    delta, root, kappa = problem.delta[0], problem.root[0], problem.kappa[0]
    series = np.zeros(14)
    series[:4] = 0.5, 0.2, -0.3, 0.1
    waves = np.array([[ratio, cosine, sine, 0.25, 0.0]])
    leg = Leg(
        kappa, delta, root, problem.damping_kind[0], 0.0, 0.0, problem.rate[0], 0.0, 0.0, 0.3, -0.2,
        waves, series,
    )  # fmt: skip
    far = np.linspace(0.5, 5.0, EVALUATIONS)
    near = np.linspace(0.01, 0.2, EVALUATIONS) / problem.rate[0]
    numbers = (ratio, cosine, sine, delta, root, 0.3, -0.2, kappa)
    lanes = np.linspace(0.5, 5.0, 4096)
    out = np.empty((4, len(lanes)))
    side_by_side(numbers, lanes, out)
    c, s, decay = np.cos(root * lanes), np.sin(root * lanes), np.exp(-delta * lanes)
    exact = 0.3 * decay * c + (-0.2 + delta * 0.3) * decay * s / root
    exact += cosine * np.cos(lanes) + sine * np.sin(lanes)
    repeats = EVALUATIONS // len(lanes)

    def many() -> None:
        for _ in range(repeats):
            side_by_side(numbers, lanes, out)

    return {
        "closed form, scalar": per(lambda: one_by_one(leg, far, 1e-300)),
        "closed form, independent": per(lambda: one_by_one(leg, far, 0.0)),
        "series, scalar": per(lambda: one_by_one(leg, near, 1e-300)),
        "closed form, in vector lanes": least(many) / (repeats * len(lanes)) * 1e9,
        "error in vector lanes": float(np.abs(out[0] - exact).max()),
    }


def main() -> None:
    if sys.argv[1:] == ["count"]:
        return count()
    python = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    told = subprocess.run(
        [sys.executable, "-m", "benchmarks.limit", "count"], env=python, check=True,
        capture_output=True, text=True,
    ).stdout  # fmt: skip
    counted, cost = json.loads(told), costs()
    for name, value in cost.items():
        print(f"{name:30} {value:.3g}" + ("" if "error" in name else " ns"))
    head = "closed form", "series", "engine ns", "limit ns", "ratio", "lanes ns", "ratio to them"
    print(f"\n{'an impact':36}" + "".join(f"{one:>14}" for one in head))
    rows = {}
    for name, scene in SCENES.items():
        far, near, impacts = counted[name]
        machine = scene()
        hits = im.simulate(machine, periods=LONG).impact_count
        spent = least(lambda m=machine: im.simulate(m, periods=LONG, keep="counts")) / hits * 1e9
        far, near = far / impacts, near / impacts
        limit = far * cost["closed form, scalar"] + near * cost["series, scalar"]
        lanes = (far + near) * cost["closed form, in vector lanes"]
        numbers = far, near, spent, limit, spent / limit, lanes, spent / lanes
        rows[name] = dict(zip(head, numbers, strict=True))
        print(f"{name:36}" + "".join(f"{one:14.3g}" for one in numbers))
    save("limit", {"ns": cost, "an impact": rows})


if __name__ == "__main__":
    main()
