"""Time per machine against how many there are: one compiled call beside what one would write.

The beam of `scenes.karpodinis` at forcing frequencies from 20 to 24 Hz, 20 periods from rest, by

- ours: the scene of arrays, tables and all, moved by `simulate`;
- a loop of `simulate`;
- a hand-written kernel: the closed form of this one machine, stops found by conservative steps;
- RK4 (numba) with 400 steps a period and bisection at the stop;
- heyoka, where it is installed (``pip install heyoka``): one integrator, compiled once, whose
  frequency is a parameter and whose stop is a terminal event; up to 256 machines, one after the
  other, and all of them as batches of 4 or 8, as the processor's vectors are, in its lanes.

All on one thread, in turns, the least processor time of three. The error is the greatest difference
of the displacement at the end from that of a loop of `simulate`, of machines that move periodically
(the error in others grows e-fold in a few periods). Writes results/batches.png, time per machine
against the number of machines. ``python -m benchmarks.batches [most]``.
"""

from __future__ import annotations

import importlib.util
import math
import sys
import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit

import impactsig as im

from .saving import result_file

PERIODS, STEPS = 20, 400
FEW = 256  # machines, of ways that take long
DAMPING, AMPLITUDE, RESTITUTION, NATURAL = 0.03, 0.25, 0.2, 22.2


@njit(error_model="numpy")
def closed_form(ratio: Any, periods: int, out: Any) -> None:
    """Displacement and velocity at the end, and impacts, of each machine."""
    wd = math.sqrt(1 - DAMPING * DAMPING)
    for k in range(len(ratio)):
        w = ratio[k]
        real, imaginary = 1 - w * w, 2 * DAMPING * w
        size = real * real + imaginary * imaginary
        a, b = AMPLITUDE * real / size, AMPLITUDE * imaginary / size
        third = w * w * w * math.hypot(a, b)
        t, x, v, count = 0.0, 0.0, 0.0, 0
        end = periods * 2 * math.pi / w
        while True:
            c0, s0 = math.cos(w * t), math.sin(w * t)
            z, u = x - a * c0 - b * s0, v - w * (b * c0 - a * s0)
            e = math.sqrt(z * z + (u + DAMPING * z) ** 2 / (wd * wd))  # the free motion's envelope
            most = e + w * w * math.hypot(a, b)
            jolt = e + third
            tau, gap, speed = 0.0, 1.0 - x, -v
            left = end - t
            hit = False
            while True:
                # Until then |x''| keeps the gap open; near it, Newton's step from the open side.
                step = (speed + math.sqrt(speed * speed + 2 * most * max(gap, 0.0))) / most
                if speed < 0 and 2 * jolt * gap < speed * speed:
                    step = min(-gap / speed, left)
                    step = max(step * 0.999, step - jolt * step * step)
                tau += max(step, 1e-14)
                if tau >= left:
                    tau = left
                decay = math.exp(-DAMPING * tau)
                c, s = math.cos(wd * tau), math.sin(wd * tau)
                free = decay * (z * c + (u + DAMPING * z) / wd * s)
                rate = decay * (u * c - (z + DAMPING * u) / wd * s)
                cw, sw = math.cos(w * (t + tau)), math.sin(w * (t + tau))
                gap = 1.0 - (free + a * cw + b * sw)
                speed = -(rate + w * (b * cw - a * sw))
                if tau >= left:
                    break
                if gap <= 1e-14:
                    hit = True
                    break
            t += tau
            x, v = 1.0 - gap, -speed
            if not hit:
                break
            x, v = 1.0, -RESTITUTION * abs(v)
            count += 1
        out[k, 0], out[k, 1], out[k, 2] = x, v, count


@njit(error_model="numpy")
def rk4(ratio: Any, periods: int, steps: int, out: Any) -> None:
    """The same, step by step; a step that ends beyond the stop is halved to where it does not."""
    for k in range(len(ratio)):
        w = ratio[k]
        full = 2 * math.pi / w / steps
        t, x, v, count = 0.0, 0.0, 0.0, 0
        for n in range(periods * steps):
            end = (n + 1) * full
            while t < end:
                low = high = end - t
                y, u = _step(w, t, x, v, low)
                if y > 1.0:
                    low = 0.0
                    while high - low > 1e-15 * max(t, 1.0):
                        middle = (low + high) / 2
                        if _step(w, t, x, v, middle)[0] <= 1.0:
                            low = middle
                        else:
                            high = middle
                    y, u = _step(w, t, x, v, low)
                beyond = low < end - t
                t = t + low if beyond else end
                x, v = y, u
                if beyond:
                    x, v = 1.0, -RESTITUTION * abs(u)
                    count += 1
                    t += 1e-16
        out[k, 0], out[k, 1], out[k, 2] = x, v, count


@njit(error_model="numpy")
def _step(w: float, t: float, x: float, v: float, h: float) -> tuple[float, float]:
    a1 = AMPLITUDE * math.cos(w * t) - 2 * DAMPING * v - x
    x2, v2 = x + h / 2 * v, v + h / 2 * a1
    middle = AMPLITUDE * math.cos(w * (t + h / 2))
    a2 = middle - 2 * DAMPING * v2 - x2
    x3, v3 = x + h / 2 * v2, v + h / 2 * a2
    a3 = middle - 2 * DAMPING * v3 - x3
    x4, v4 = x + h * v3, v + h * a3
    a4 = AMPLITUDE * math.cos(w * (t + h)) - 2 * DAMPING * v4 - x4
    return x + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def ours(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    scene = im.scenes.karpodinis(frequency)
    found = im.simulate_many(scene, periods=PERIODS, keep="counts", workers=1)
    return found.displacement, found.impact_count


def with_impacts(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = im.simulate_many(im.scenes.karpodinis(frequency), periods=PERIODS, workers=1)
    return found.displacement, found.impact_count


def loop(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    scenes = (im.scenes.karpodinis(own) for own in frequency.tolist())
    found = [im.simulate(scene, periods=PERIODS, keep="counts") for scene in scenes]
    return (
        np.array([motion.final[0] for motion in found]),
        np.array([motion.impact_count for motion in found]),
    )


def by_hand(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    out = np.empty((len(frequency), 3))
    closed_form(frequency / NATURAL, PERIODS, out)
    return out[:, 0], out[:, 2]


def by_steps(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    out = np.empty((len(frequency), 3))
    rk4(frequency / NATURAL, PERIODS, STEPS, out)
    return out[:, 0], out[:, 2]


@cache
def integrator() -> tuple[Any, list[int]]:
    """Heyoka's for this machine, and the counter of its impacts."""
    import heyoka as hy

    x, v = hy.make_vars("x", "v")
    count = [0]

    def bounce(one: Any, sign: int) -> bool:
        one.state[:] = 1.0, -RESTITUTION * one.state[1]
        count[0] += 1
        return True

    rate = AMPLITUDE * hy.cos(hy.par[0] * hy.time) - 2 * DAMPING * v - x
    stop = hy.t_event(x - 1.0, callback=bounce, direction=hy.event_direction.positive)
    return hy.taylor_adaptive([(x, v), (v, rate)], [0.0, 0.0], pars=[1.0], t_events=[stop]), count


def by_heyoka(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    one, count = integrator()
    out = np.empty((len(frequency), 2))
    for k, ratio in enumerate((frequency / NATURAL).tolist()):
        one.time, one.pars[0], one.state[:], count[0] = 0.0, ratio, 0.0, 0
        one.reset_cooldowns()
        one.propagate_until(PERIODS * 2 * math.pi / ratio)
        out[k] = one.state[0], count[0]
    return out[:, 0], out[:, 1]


@cache
def lanes() -> tuple[Any, np.ndarray]:
    """Heyoka's for as many of this machine as fit the processor's vectors, and their impacts."""
    import heyoka as hy

    size = hy.recommended_simd_size()
    size = max(4, size)
    x, v = hy.make_vars("x", "v")
    count = np.zeros(size, int)

    def bounce(many: Any, sign: int, k: int) -> bool:
        many.state[0, k], many.state[1, k] = 1.0, -RESTITUTION * many.state[1, k]
        count[k] += 1
        return True

    rate = AMPLITUDE * hy.cos(hy.par[0] * hy.time) - 2 * DAMPING * v - x
    stop = hy.t_event_batch(x - 1.0, callback=bounce, direction=hy.event_direction.positive)
    equations = [(x, v), (v, rate)]
    many = hy.taylor_adaptive_batch(
        equations, np.zeros((2, size)), pars=np.ones((1, size)), t_events=[stop]
    )
    return many, count


def by_batches(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    many, count = lanes()
    size = len(count)
    ratio = frequency / NATURAL
    out = np.empty((len(frequency), 2))
    for first in range(0, len(frequency), size):
        own = np.resize(ratio[first : first + size], size)  # the last is filled up
        many.set_time(0.0)
        many.pars[0], many.state[:], count[:] = own, 0.0, 0
        many.reset_cooldowns()
        many.propagate_until(PERIODS * 2 * math.pi / own)
        used = min(size, len(frequency) - first)
        out[first : first + used, 0], out[first : first + used, 1] = (
            many.state[0, :used],
            count[:used],
        )
    return out[:, 0], out[:, 1]


WAYS: dict[str, Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]] = {
    "one call": ours,
    "one call, impacts kept": with_impacts,
    "loop of simulate": loop,
    "hand-written kernel": by_hand,
    f"RK4, {STEPS} steps": by_steps,
}
if importlib.util.find_spec("heyoka"):
    WAYS["heyoka, one by one"] = by_heyoka
    WAYS["heyoka, in batches"] = by_batches


def draw(taken: dict[str, dict[int, float]]) -> None:
    """Time per machine [us] of each way against the number of machines."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 5), layout="constrained")
    ax = figure.subplots()
    for name, own in taken.items():
        ax.loglog(list(own), list(own.values()), "o-", label=name)
    ax.set_yticks([10, 20, 50, 100, 200, 500], ["10", "20", "50", "100", "200", "500"], minor=False)
    ax.minorticks_off()
    ax.set_xlabel("machines")
    ax.set_ylabel(f"processor time a machine, {PERIODS} periods (us)")
    figure.legend(loc="outside lower center", ncols=2)
    figure.savefig(result_file("batches.png"), dpi=110)


def main() -> None:
    if by_heyoka not in WAYS.values():
        print("heyoka is not installed (pip install heyoka): left out")
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    print(f"{'way':24} {'machines':>8} {'us each':>9} {'error':>9} {'impacts':>8}")
    taken: dict[str, dict[int, float]] = {name: {} for name in WAYS}
    for n in (1, 16, FEW, 4096, 10_000):
        if n > most:
            break
        frequency = np.linspace(20.0, 24.0, n) if n > 1 else np.array([22.1])
        best = dict.fromkeys(WAYS, math.inf)
        found: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for _ in range(3):
            for name, way in WAYS.items():
                if n > FEW and (way is by_heyoka or (way is loop and name in found)):
                    continue
                begun = time.process_time()
                found[name] = way(frequency)
                best[name] = min(best[name], time.process_time() - begun)
        truth, hits = found["loop of simulate"]
        calm = frequency > 21.8
        for name, (place, impacts) in found.items():
            same = calm & (impacts == hits)
            error = float(np.abs(place - truth)[same].max(initial=0.0))
            taken[name][n] = best[name] / n * 1e6
            print(
                f"{name:24} {n:8} {best[name] / n * 1e6:9.1f} {error:9.1e} {int(impacts.sum()):8}"
            )
    draw(taken)


if __name__ == "__main__":
    main()
