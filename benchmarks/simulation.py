"""The exact engine beside general integrators: error against time, and what a skip saves.

The chaotic run (zeta = 0.05, A = 9.435, omega = 2.7, r = 0.8, from rest) has a reference of forty
digits for its first 20 impacts; each tool is timed per impact on the same run. Writes
results/simulation.json and simulation.md.

    python -m benchmarks.simulation
"""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import impactsig
from impactsig import Force, Oscillator, Rigid, Stop, scenes
from tests import naive, naive_simulate

RESULTS = Path(__file__).parent / "results"
ZETA, AMPLITUDE, OMEGA, RESTITUTION = 0.05, 9.435, 2.7, 0.8
COUNT = 20
CHAOS = Oscillator(
    damping=2 * ZETA, forces=Force(AMPLITUDE, OMEGA), stops=(Stop(1, Rigid(RESTITUTION)),)
)


def timed(work: Callable, repeats: int = 3):
    """What `work` returns, and the median time of some runs after one that is not counted [s]."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        found = work()
        times.append(time.perf_counter() - start)
    return found, float(np.median(times))


def by_scipy(method: str, rtol: float) -> np.ndarray:
    """The first impacts by solve_ivp, begun again at each; events closer than 1e-12 are its own."""

    def rate(t, y):
        return y[1], AMPLITUDE * np.cos(OMEGA * t) - 2 * ZETA * y[1] - y[0]

    def stop(t, y):
        return y[0] - 1

    stop.terminal, stop.direction = True, 1
    t, y, found = 0.0, (0.0, 0.0), []
    while len(found) < COUNT:
        leg = solve_ivp(rate, (t, t + 60), y, method=method, rtol=rtol, atol=rtol, events=stop)
        if not len(leg.t_events[0]):
            break
        t = leg.t_events[0][0]
        y = (1 - 1e-15, -RESTITUTION * leg.y_events[0][0][1])
        found.append(t)
    return np.array(found)


def by_thesis(steps: int) -> np.ndarray:
    """The first impacts by the thesis' Runge-Kutta steps, halved at the stop (in Python)."""
    h = 2 * np.pi / OMEGA / steps
    t, x, v, found = 0.0, 0.0, 0.0, []
    while len(found) < COUNT:
        x_next, v_next = naive.rk4_step(t, x, v, h, OMEGA, ZETA, AMPLITUDE)
        if x_next < 1:
            t, x, v = t + h, x_next, v_next
            continue
        part = h
        while part > 1e-15:
            part /= 2
            x_next, v_next = naive.rk4_step(t, x, v, part, OMEGA, ZETA, AMPLITUDE)
            if x_next < 1:
                t, x, v = t + part, x_next, v_next
        found.append(t)
        v *= -RESTITUTION
    return np.array(found)


def work_precision() -> list[dict]:
    """Time per impact, and the error of the first 20 instants, of each tool."""
    truth = np.array([float(t) for t in naive_simulate.impacts(
        naive_simulate.one_sided(ZETA, AMPLITUDE, OMEGA, restitution=RESTITUTION), COUNT)[0]])  # fmt: skip
    long, took = timed(lambda: impactsig.simulate(CHAOS, periods=50_000))
    found = impactsig.simulate(CHAOS, periods=60).impacts.time[:COUNT]
    rows = [line("impactsig, exact", found, took / long.impact_count, truth)]
    for steps in (300, 3000):
        found, took = timed(lambda steps=steps: by_thesis(steps), 1)
        rows.append(line(f"thesis RK4, {steps} steps, Python", found, took / COUNT, truth))
    for method in ("RK45", "DOP853"):
        for rtol in (1e-6, 1e-9, 1e-12):
            found, took = timed(lambda m=method, r=rtol: by_scipy(m, r), 1)
            rows.append(line(f"scipy {method}, rtol {rtol:g}", found, took / COUNT, truth))
    for row in rows:
        row["time / ours"] = row["us per impact"] / rows[0]["us per impact"]
    return rows


def line(name: str, found: np.ndarray, seconds: float, truth: np.ndarray) -> dict:
    same = min(len(found), len(truth))
    error = np.abs(found[:same] - truth[:same])
    return {
        "tool": name,
        "us per impact": seconds * 1e6,
        "error of impact 1": float(error[0]),
        "error of the first 20": float(error.max()),
    }


def scenes_speed() -> list[dict]:
    """Impacts a second of the exact engine on several scenes, with and without keeping them."""
    cases = {
        "period-1 beam, 22.1 Hz": scenes.karpodinis(22.1),
        "chaotic beam, 20.1 Hz": scenes.karpodinis(20.1),
        "soft stop, k_s = 2e5": scenes.okolewski(3, 0.6, "soft"),
        "soft stop, k_s = 1e8": scenes.okolewski(3, 0.6, "soft", stop_stiffness=1e8),
        "chatter and stick": scenes.okolewski(3, 0.6),
    }
    rows = []
    for name, scene in cases.items():
        row: dict = {"scene": name}
        for keep in ("counts", "all"):
            motion, took = timed(
                lambda s=scene, k=keep: impactsig.simulate(s, periods=20_000, transient=10, keep=k)
            )
            row[f"impacts / s, {keep}"] = motion.impact_count / took
        rows.append(row)
    return rows


def skip_speed() -> dict:
    """A motion that cannot reach its stop, with the skip and without; the answers compared."""
    quiet = Oscillator(damping=0.1, forces=Force(0.1, 0.5), stops=(Stop(1, Rigid(0.5)),))
    ends, times = [], []
    for skip in (True, False):
        motion, took = timed(
            lambda s=skip: impactsig.simulate(
                quiet, periods=100_000, keep="counts", skip_unreachable=s
            )
        )
        ends.append(motion.final)
        times.append(took)
    return {
        "skip": "unreachable stop, 1e5 periods",
        "s with": times[0],
        "s without": times[1],
        "greatest difference of the final state": float(np.max(np.abs(np.subtract(*ends)))),
    }


def table(rows: list[dict]) -> str:
    heads = list(rows[0])
    lines = [heads, ["---"] * len(heads)]
    for row in rows:
        lines.append([f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()])
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def main() -> None:
    results = {
        "machine": platform.processor() or platform.machine(),
        "versions": {name: version(name) for name in ("numpy", "scipy", "numba")},
        "work precision": work_precision(),
        "scenes": scenes_speed(),
        "skips": [skip_speed()],
    }
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "simulation.json").write_text(json.dumps(results, indent=1))
    text = "\n\n".join(table(results[key]) for key in ("work precision", "scenes", "skips"))
    (RESULTS / "simulation.md").write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
