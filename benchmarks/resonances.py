"""Records of one resonance with known truth, and how near to the bounds it is read from them.

Free decays with noise 20 dB below the first swings, and records under white noise, over seeds:
scatter and told errors of natural frequency and damping ratio by the bound of Cramer and Rao, the
share within 0.05 % and 5 %, the share of truths within 1.96 told errors; and the textbooks'
readings of the same records. Prints tables.

    python -m benchmarks.resonances [--seeds 200]
"""

from __future__ import annotations

import argparse
import math

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from impactsig import Recording, identify_resonance


def decay(frequency, ratio, rate, seed, *, noise=0.0, duration=10.0, second=0.0, before=0.0):
    """Swings of size 1 that begin at any phase; `second`: of a mode where a beam has its second."""
    rng = np.random.default_rng(seed)
    omega = 2 * math.pi * frequency
    time = np.arange(round(duration * rate)) / rate - before
    damped = omega * math.sqrt(1 - ratio**2)
    ring = np.exp(-ratio * omega * time) * np.cos(damped * time + rng.uniform(0, 2 * math.pi))
    ring += second * np.exp(-6.27 * ratio * omega * time) * np.cos(6.27 * omega * time + 1)
    return Recording(np.where(time >= 0, ring, 0.0) + noise * rng.standard_normal(len(time)), rate)


def shaken(frequency, ratio, rate, seed, *, duration=10.0, noise=0.1, quantity="displacement"):
    """An oscillator under white noise, exactly, of variance 1, with noise of the instrument."""
    rng = np.random.default_rng(seed)
    omega, h, count = 2 * math.pi * frequency, 1 / rate, round(duration * rate)
    matrix = np.array([[0, omega], [-omega, -2 * ratio * omega]])  # x, and x' by omega
    flow = expm(matrix * h)
    kick = np.linalg.cholesky(np.eye(2) - flow @ flow.T) @ rng.standard_normal((2, count))
    start = rng.standard_normal(2)
    # x_n = flow x_(n-1) + kick_n, written as a recursion of either coordinate alone.
    kick[:, 0] = start
    trace, det = flow.trace(), np.linalg.det(flow)
    other = [[-flow[1, 1], flow[0, 1]], [flow[1, 0], -flow[0, 0]]]
    late = np.pad(kick, ((0, 0), (1, 0)))[:, :-1]
    which = ("displacement", "velocity").index(quantity)
    drive = kick[which] + np.array(other)[which] @ late
    return Recording(
        lfilter([1.0], [1.0, -trace, det], drive) + noise * rng.standard_normal(count), rate
    )


def table(kind, frequency, ratio, rate, duration, seeds):
    """A line of scatter by bound, told by bound, shares, and the textbooks' bias and scatter."""
    omega, noise = 2 * math.pi * frequency, math.sqrt(0.005)
    if kind == "decay":
        bound = math.sqrt(16 * noise**2 * (ratio * omega) ** 3 / rate) / omega
        bounds = bound, bound / ratio
        found = [
            identify_resonance(
                decay(frequency, ratio, rate, s, noise=noise, duration=duration, second=0.5), kind
            )
            for s in range(seeds)
        ]
    else:
        bounds = math.sqrt(ratio / (omega * duration)), 1 / math.sqrt(ratio * omega * duration)
        found = [
            identify_resonance(shaken(frequency, ratio, rate, s, duration=duration), kind)
            for s in range(seeds)
        ]
    off = np.array([[r.natural_frequency / frequency - 1, r.damping_ratio / ratio - 1]
                    for r in found])  # fmt: skip
    told = np.array([[r.natural_frequency_error / frequency, r.damping_ratio_error / ratio]
                     for r in found])  # fmt: skip
    scatter, said = np.sqrt((off**2).mean(axis=0)) / bounds, told.mean(axis=0) / bounds
    near = (np.abs(off) < (5e-4, 0.05)).mean(axis=0)
    holds = (np.abs(off) < 1.96 * told).mean(axis=0)
    print(
        f"{kind:6} {frequency:5g} Hz {ratio:5g} {rate:6g} Hz {duration:4g} s |"
        f" {bounds[0]:.4%} {scatter[0]:.2f} {said[0]:.2f} {near[0]:4.0%} {holds[0]:4.0%} |"
        f" {bounds[1]:6.2%} {scatter[1]:.2f} {said[1]:.2f} {near[1]:4.0%} {holds[1]:4.0%}"
    )
    readings = {"peak": [r.peak for r in found], "half power": [r.half_power for r in found]}
    if kind == "decay":
        readings["decrement"] = [r.log_decrement for r in found]
    for name, values in readings.items():
        true = frequency if name == "peak" else ratio
        value, error = np.array(values).T / true
        print(
            f"       {name:10} bias {np.nanmean(value) - 1:+.2%} scatter {np.nanstd(value):.2%} "
            f"told {np.nanmean(error):.2%}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200)
    seeds = parser.parse_args().seeds
    print("                                  | natural frequency               | damping ratio")
    print("                                  | bound  by bound told 0.05% holds | bound by bound"
          " told 5% holds")  # fmt: skip
    for frequency, ratio, rate in (
        (22.2, 0.03, 1000.0), (22.2, 0.03, 5000.0), (22.2, 0.03, 50_000.0),
        (22.2, 0.005, 1000.0), (22.2, 0.005, 5000.0), (100.0, 0.01, 5000.0),
    ):  # fmt: skip
        table("decay", frequency, ratio, rate, 10.0, seeds if rate < 5e4 else seeds // 5)
    for ratio, duration in ((0.03, 10.0), (0.03, 100.0), (0.005, 10.0), (0.005, 100.0)):
        table("noise", 22.2, ratio, 400.0, duration, seeds)


if __name__ == "__main__":
    main()
