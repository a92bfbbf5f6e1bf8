"""What a cell of a diagram costs: beside other integrators, with each skip, and in the large.

1. One cell, 200 forcing periods from rest, half of them the transient: by the diagram, by scipy's
   solve_ivp begun again at every event, and by a plain compiled RK4 with bisection. The error is
   that of the last approach velocity: of the hard beam against the closed form of Shaw and Holmes,
   of the soft stop against our orbit. Compared at equal error.
2. What ending a motion early saves: at closed orbits, near a known attractor, at a stop that is out
   of reach, and by starting on the neighbour's orbit. With and without, in turns.
3. One and two threads.
4. The diagrams of the papers at full size, with the memory they take; and from the chart what one
   of 1e8 cells would cost.

CPU time is that of all threads; on a machine that does other things too, it is what to compare.
Writes results/diagrams.json and diagrams.md. `--small` leaves out the full size.

    python -m benchmarks.diagrams
"""

from __future__ import annotations

import math
import resource
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from impactsig import (
    KelvinVoigt,
    basins_of_attraction,
    bifurcation_diagram,
    periodicity_chart,
    scenes,
    simulate,
)

from .detection import markdown
from .saving import save, versions

PERIODS = 200
SHAW_HOLMES = 0.5810258993557
REPEATS = 5


class Gap(NamedTuple):
    """A mass and one stop by the gap y: y'' = load + C cos + S sin - c y' - y, contact at y < 0."""

    damping: float
    load: float
    cosine: float
    sine: float
    omega: float
    restitution: float  # negative for a soft stop
    stiffness: float
    drag: float
    start: tuple[float, float]


def hard_beam() -> tuple[Callable, float, Gap, float]:
    ratio = 22.1 / scenes.NATURAL_FREQUENCY
    gap = Gap(0.06, 1.0, -0.25, 0.0, ratio, 0.2, 0.0, 0.0, (1.0, 0.0))
    return scenes.karpodinis, 22.1, gap, SHAW_HOLMES


def soft_base() -> tuple[Callable, float, Gap, float]:
    eta, swing, law = 4.0, 0.0025, KelvinVoigt.equivalent(0.6, 2e5)

    def machine(eta: float) -> Any:
        return scenes.okolewski(eta, 0.6, "soft")

    gap = Gap(
        0.23, 0.0, -0.23 * eta * swing, eta**2 * swing, eta, -1.0, law.stiffness, law.damping,
        (0.0, -eta * swing),
    )  # fmt: skip
    impacts = simulate(machine(eta), periods=20, transient=2000).impacts
    assert impacts is not None
    assert impacts.approach_velocity is not None
    return machine, eta, gap, float(impacts.approach_velocity[-1])


def by_diagram(scene: Callable, value: float, skip: bool) -> float:
    half = PERIODS // 2
    found = bifurcation_diagram(
        scene, [value], periods=half, transient=half, skip=skip, closed=1e-9, workers=1
    )
    return float(found.velocity[0][-1])


def by_scipy(gap: Gap, tolerance: float) -> float:
    """DOP853, begun again at each event."""
    end = PERIODS * 2 * math.pi / gap.omega
    t, (y, v), touching, last = 0.0, gap.start, gap.start[0] == 0 and gap.restitution < 0, 0.0

    def touch(t: float, state: np.ndarray) -> float:
        return float(state[0])

    touch.terminal = True  # type: ignore[attr-defined]
    while t < end:
        k = 1.0 + (gap.stiffness if touching else 0.0)
        c = gap.damping + (gap.drag if touching else 0.0)

        def rates(t: float, state: np.ndarray, k: float = k, c: float = c) -> list[float]:
            push = gap.cosine * math.cos(gap.omega * t) + gap.sine * math.sin(gap.omega * t)
            return [state[1], gap.load + push - c * state[1] - k * state[0]]

        touch.direction = 1 if touching else -1  # type: ignore[attr-defined]
        run = solve_ivp(
            rates, (t, end), [y, v], "DOP853", events=touch, rtol=tolerance, atol=tolerance * 1e-3
        )
        t, y, v = run.t[-1], 0.0, run.y[1, -1]
        if run.status == 1:
            if not touching:
                last = -v
            if gap.restitution >= 0:
                v = -gap.restitution * v
            else:
                touching = not touching
    return last


@njit(cache=True)
def _rate(gap, touching, t, y, v):
    k = 1.0 + gap.stiffness if touching else 1.0
    c = gap.damping + gap.drag if touching else gap.damping
    push = gap.cosine * math.cos(gap.omega * t) + gap.sine * math.sin(gap.omega * t)
    return gap.load + push - c * v - k * y


@njit(cache=True)
def _step(gap, touching, t, y, v, h):
    a = _rate(gap, touching, t, y, v)
    y2, v2 = y + h / 2 * v, v + h / 2 * a
    b = _rate(gap, touching, t + h / 2, y2, v2)
    y3, v3 = y + h / 2 * v2, v + h / 2 * b
    c = _rate(gap, touching, t + h / 2, y3, v3)
    y4, v4 = y + h * v3, v + h * c
    d = _rate(gap, touching, t + h, y4, v4)
    return y + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a + 2 * b + 2 * c + d)


@njit(cache=True)
def by_rk4(gap, periods, steps):
    """A fixed step, halved sixty times to land on the stop."""
    period = 2 * math.pi / gap.omega
    h = period / steps
    y, v = gap.start
    touching = y == 0 and gap.restitution < 0
    last, t = 0.0, 0.0
    end = periods * period
    while t < end:
        after, speed = _step(gap, touching, t, y, v, h)
        done = h
        if (after > 0) if touching else (after < 0):
            low, high = 0.0, h
            for _ in range(60):
                middle = (low + high) / 2
                at, speed = _step(gap, touching, t, y, v, middle)
                if (at > 0) if touching else (at < 0):
                    high = middle
                else:
                    low = middle
            done = high
            after, speed = _step(gap, touching, t, y, v, done)
            after = 0.0
            if not touching:
                last = -speed
            if gap.restitution >= 0:
                speed = -gap.restitution * speed
            else:
                touching = not touching
        t += done
        y, v = after, speed
    return last


def spent(work: Callable[[], Any]) -> tuple[Any, float, float]:
    """What work gives, its CPU and its wall time [s]."""
    wall, cpu = time.perf_counter(), time.process_time()
    found = work()
    return found, time.process_time() - cpu, time.perf_counter() - wall


def least(work: Callable[[], Any], repeats: int = REPEATS) -> float:
    """The least CPU time of some runs [s]."""
    return min(spent(work)[1] for _ in range(repeats))


def tools() -> list[dict]:
    rows = []
    for name, (scene, value, gap, truth) in (
        ("hard beam, 22.1 Hz", hard_beam()),
        ("soft stop, 2e5, eta = 4", soft_base()),
    ):
        coarse = (
            (64, 256, 1024, 4096, 16384) if gap.restitution >= 0 else (1024, 4096, 16384, 65536)
        )
        runs: list[tuple[str, Callable[[], float], int]] = [
            ("diagram", lambda s=scene, x=value: by_diagram(s, x, True), 20),
            ("diagram, no skip", lambda s=scene, x=value: by_diagram(s, x, False), 20),
            *((f"RK4, {n} steps a period", lambda g=gap, n=n: by_rk4(g, PERIODS, n), 3)
              for n in coarse),
            *((f"scipy DOP853, {tolerance:g}", lambda g=gap, e=tolerance: by_scipy(g, e), 1)
              for tolerance in (1e-6, 1e-9, 1e-12)),
        ]  # fmt: skip
        own = 0.0
        for tool, run, repeats in runs:
            found = run()
            cost = least(run, repeats)
            own = own or cost
            rows.append({
                "cell": name, "tool": tool, "relative error": abs(found / truth - 1),
                "ms of CPU": 1e3 * cost, "diagram = 1": cost / own,
            })  # fmt: skip
    return rows


def walls(gamma: float, friction: float) -> Any:
    return scenes.begley_virgin(gamma, 1.5, friction)


def skips() -> list[dict]:
    x, y = np.linspace(0.3, 2.0, 40), np.linspace(0.01, 0.6, 25)
    four, grid = scenes.begley_virgin(1.338, 1.6, 0.05), np.linspace(-2, 2, 60)
    eta = np.linspace(2, 10, 200)
    weak = np.linspace(0.005, 0.02, 50)

    def hard(eta: float) -> Any:
        return scenes.okolewski(eta, 0.6, "hard")

    def reach(skip: bool) -> np.ndarray:
        runs = (
            simulate(
                scenes.karpodinis(20.1, amplitude=a), periods=200, keep="counts",
                skip_unreachable=skip,
            )
            for a in weak
        )  # fmt: skip
        return np.array([run.final[:2] for run in runs])

    def chart(skip: bool) -> np.ndarray:
        return periodicity_chart(walls, x, y, skip=skip, workers=1).classes

    def basin(skip: bool) -> np.ndarray:
        return basins_of_attraction(four, grid, grid, catch=skip, workers=1).labels

    def neighbour(skip: bool) -> np.ndarray:
        # From rest 400 periods of transient at most, from the neighbour's orbit 100.
        return bifurcation_diagram(
            hard, eta, carry=skip, transient=100 if skip else 400, workers=1
        ).periods

    rows = []
    for name, cells, run in (
        ("closed orbit: chart", len(x) * len(y), chart),
        ("caught start: basins", len(grid) ** 2, basin),
        ("unreachable stop: beam below grazing", len(weak), reach),
        ("neighbour's orbit: hard over eta", len(eta), neighbour),
    ):
        with_skip, without = run(True), run(False)
        times = np.array(
            [(spent(lambda r=run: r(True))[1], spent(lambda r=run: r(False))[1]) for _ in range(3)]
        )
        less, more = times.min(axis=0)
        same = np.isclose(with_skip, without, rtol=0, atol=1e-12)
        rows.append({
            "skip": name, "cells": cells, "ms a cell with": 1e3 * less / cells,
            "without": 1e3 * more / cells, "share saved": 1 - less / more,
            "cells that differ": int(np.count_nonzero(~same.reshape(cells, -1).all(axis=1))),
        })  # fmt: skip
    return rows


def threads() -> list[dict]:
    x, y = np.linspace(0.3, 2.0, 60), np.linspace(0.01, 0.6, 60)
    four, grid = scenes.begley_virgin(1.338, 1.6, 0.05), np.linspace(-2, 2, 100)
    eta = np.linspace(2, 10, 400)

    def hard(eta: float) -> Any:
        return scenes.okolewski(eta, 0.6, "hard")

    rows = []
    for name, run in (
        ("hard over eta, exponents", lambda n: bifurcation_diagram(
            hard, eta, exponents=True, workers=n)),
        ("chart", lambda n: periodicity_chart(walls, x, y, workers=n)),
        ("basins", lambda n: basins_of_attraction(four, grid, grid, workers=n)),
    ):  # fmt: skip
        times = np.array(
            [[spent(lambda r=run, n=n: r(n))[1:] for n in (1, 2)] for _ in range(3)]
        ).min(axis=0)
        rows.append({
            "study": name, "CPU s, 1 thread": times[0, 0], "2 threads": times[1, 0],
            "wall s, 1 thread": times[0, 1], "wall s, 2 threads": times[1, 1],
            "wall ratio": times[0, 1] / times[1, 1],
        })  # fmt: skip
    return rows


def full_size() -> list[dict]:
    studies: list[tuple[str, int, float, Callable[[], Any]]] = [
        ("hard, r = 0.6, eta 2 to 10, exponents", 2000, 20, lambda: bifurcation_diagram(
            lambda eta: scenes.okolewski(eta, 0.6, "hard"), np.linspace(2, 10, 2000),
            exponents=True, workers=2)),
        ("basins of the four attractors", 500**2, 60, lambda: basins_of_attraction(
            scenes.begley_virgin(1.338, 1.6, 0.05), np.linspace(-2, 2, 500),
            np.linspace(-3, 3, 500), workers=2)),
        ("chart, 200 cycles a cell", 400**2, 60, lambda: periodicity_chart(
            walls, np.linspace(0.3, 2.0, 400), np.linspace(0.01, 0.6, 400), workers=2)),
    ]  # fmt: skip
    rows = []
    for name, cells, limit, run in studies:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        _, cpu, wall = spent(run)
        more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        rows.append({
            "study": name, "cells": cells, "CPU s": cpu, "wall s": wall, "limit s": limit,
            "ms of CPU a cell": 1e3 * cpu / cells, "MB more": more / 1024,
        })  # fmt: skip
    return rows


def main() -> None:
    tables = {
        "One cell, 200 forcing periods": tools(),
        "What ending early saves": skips(),
        "Threads": threads(),
    }
    if "--small" not in sys.argv:
        tables["Full size, 2 threads"] = full_size()
    text = ""
    for name, rows in tables.items():
        text += f"## {name}\n\n{markdown(rows)}\n"
    if "Full size, 2 threads" in tables:
        chart = tables["Full size, 2 threads"][-1]["ms of CPU a cell"]
        hours = chart * 1e8 / 1e3 / 3600
        text += f"A chart of 1e8 cells would take {hours:.0f} hours of CPU, "
        text += f"{hours / 2:.0f} on two cores.\n"
    print(text)
    save("diagrams", {"about": versions("numpy"), **tables}, text)


if __name__ == "__main__":
    main()
