"""One oscillator fitted to many trains of instants: errors, coverage of intervals, time of a fit.

Impacting beams as `scenes.karpodinis` has them, r 0.1 to 0.7, zeta 0.01 to 0.06, each measured in
8 irregular runs at frequencies from 17.5 to 23.5 Hz and amplitudes from 0.15 to 0.4: 500 impacts
of each, 2 % missed, 1 % spurious, and a jitter of every instant of 0.5 % of the mean interval or of
the forcing period, in turn. Strengths are not used. Beside the errors stands the linear bound on
them: what the orbits through all instants tell at the true parameters (Cramér and Rao), which no
estimate comes below, the share of estimates as good as that within the tolerance, the root mean
square of the errors by their bounds, and the estimate of the same instants that begins at the true
parameters with the courses there: where that is off too, it is the noise of the instants and not
the search that misses. What that noise is worth is told without any search: the step of r by which
the true parameters, orbits and courses are left, by its standard error. It is normal if the
information is right; where it is wide on the machines drawn, so are the errors of every estimate.
Writes results/joint_fit.json and joint_fit.md.

    python -m benchmarks.joint_fit [machines [first seed [unit]]]

With a unit, "interval" or "period", all machines have a jitter of that kind.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np
from scipy.special import ndtr
from scipy.stats import binomtest

from impactsig import Impacts, InvalidInput, fit_oscillator, measure, scenes, simulate
from impactsig.fitting._machine import as_train
from impactsig.fitting.orbits._path_kernels import Chain
from impactsig.fitting.orbits.followed import Followed, Seen, _hard
from impactsig.fitting.together._steps import Layout, covariance_of, gathered, stepped

from .saving import save

RUNS, COUNT, JITTER = 8, 500, 0.005
TURN = 2 * np.pi
UNITS = ("interval", "period")  # what the jitter is a share of
TOLERANCE = 0.02  # of the restitution
NEAR = 6  # standard deviations of the jitter, within which an instant is an impact's own
DISTINCT = 30  # intervals to a thousandth of a period; a periodic motion has a few
ATTEMPTS = 400


def run(
    rng: np.random.Generator, restitution: float, damping: float, unit: str
) -> tuple[float, float, Impacts, Impacts] | None:
    """Frequency, amplitude, impacts and what is measured of them; None if it is not irregular."""
    frequency, amplitude = float(rng.uniform(17.5, 23.5)), float(rng.uniform(0.15, 0.4))
    scene = scenes.karpodinis(
        frequency, damping_ratio=damping, amplitude=amplitude, restitution=restitution
    )
    impacts = simulate(scene, periods=60, transient=200).impacts
    if not 15 <= len(impacts) <= 180:  # rests between them, or hardly any
        return None
    impacts = simulate(scene, periods=6 * COUNT, transient=300).impacts[:COUNT]
    distinct = np.unique(np.round(impacts.intervals() * frequency, 3))
    if len(impacts) < COUNT or len(distinct) < DISTINCT:
        return None
    impacts = replace(impacts, duration=float(impacts.time[-1] - impacts.start))
    jitter = JITTER * (impacts.intervals().mean() if unit == "interval" else 1 / frequency)
    seed = int(rng.integers(2**31))
    seen = measure(impacts, jitter=jitter, missed=0.02, spurious=0.01, seed=seed).impacts
    return frequency, amplitude, impacts, replace(seen, approach_velocity=None)


def machine(seed: int, unit: str) -> tuple[dict[str, float], list] | None:
    """What its runs share, and the runs; None where too few are irregular."""
    rng = np.random.default_rng([24, seed])
    truth = {"restitution": rng.uniform(0.1, 0.7), "damping": rng.uniform(0.01, 0.06)}
    runs: list = []
    for _ in range(ATTEMPTS):
        found = run(rng, *truth.values(), unit)
        runs += [] if found is None else [found]
        if len(runs) == RUNS:
            return truth, runs
    return None


def fitted(seed: int, unit: str) -> dict | None:
    """One fit beside the truth."""
    drawn = machine(seed, unit)
    if drawn is None:
        return None
    truth, runs = drawn
    begin = time.process_time()
    try:
        found = fit_oscillator(
            [impacts for *_, impacts in runs], [1 / frequency for frequency, *_ in runs],
            natural_frequency=scenes.NATURAL_FREQUENCY, seed=seed,
        )  # fmt: skip
    except InvalidInput as refusal:
        print(f"{seed}: {refusal}")
        return None
    seconds = time.process_time() - begin
    least, beside, noise = told_at_truth(truth, runs, unit)
    own = [
        bool(low <= amplitude <= high)
        for (_, amplitude, *_), (low, high) in zip(
            [one for k, one in enumerate(runs) if k not in found.periodic],
            [one.intervals["amplitude"] for one in found.runs], strict=True,
        )
    ]  # fmt: skip
    return {
        "seed": seed, "unit": unit, "truth": truth, "found": dict(found.values),
        "intervals": dict(found.intervals), "amplitudes": own, "p_value": found.p_value,
        "seconds": seconds, "bound": least, "beside": beside,
        "noise": noise,
    }  # fmt: skip


def told_at_truth(truth: dict[str, float], runs: list, unit: str) -> tuple[float, float, float]:
    """The least standard error of the restitution that the instants allow, and the estimate there.

    Both with the likeliest courses at the true parameters; and the step from there, by its standard
    error, with the true courses.
    """
    layout, orbits, thetas, true = Layout((0, 1), (2, 4), len(runs)), [], [], []
    for frequency, amplitude, motion, impacts in runs:
        train = as_train(impacts, frequency, None)
        jitter = JITTER * (np.diff(train.x).mean() if unit == "interval" else 1.0)
        thetas.append([
            truth["restitution"], np.log(truth["damping"]), np.log(amplitude),
            np.log(scenes.NATURAL_FREQUENCY / frequency), TURN * (impacts.start * frequency), 0.0,
        ])  # fmt: skip
        chain = Chain(jitter, missed=0.02, spurious=0.01)
        seen = Seen(frequency, train.x, train.joined, "rigid", chain)
        orbits.append(Followed.of(seen, np.array(thetas[-1]), 1))
        true.append(as_it_was(seen, (motion.time - impacts.start) * frequency, motion))
    theta = np.array(thetas)
    laid = [orbit.laid(own) for orbit, own in zip(true, theta, strict=True)]
    gradient, information = gathered(layout, laid)
    spread = np.linalg.inv(information)
    noise = -(spread @ gradient)[0] / np.sqrt(spread[0, 0])
    laid = [
        None if orbit is None else orbit.laid(own) for orbit, own in zip(orbits, theta, strict=True)
    ]
    anywhere = np.full(theta.shape, -np.inf), np.full(theta.shape, np.inf)
    moved = stepped(layout, theta, orbits, anywhere)[0]
    return float(np.sqrt(covariance_of(layout, laid)[0, 0])), float(moved[0, 0]), float(noise)


def as_it_was(seen: Seen, x: np.ndarray, motion: Impacts) -> Followed:
    """A measured train and the orbit that it was measured of, whose instants are `x`."""
    after = np.clip(np.searchsorted(x, seen.x), 1, len(x) - 1)
    which = after - (np.abs(x[after - 1] - seen.x) < np.abs(x[after] - seen.x))
    off = np.abs(x[which] - seen.x)
    real = off < NEAR * seen.chain.jitter
    for k in np.flatnonzero(real[1:] & real[:-1] & (which[1:] == which[:-1])):
        real[k + int(off[k] < off[k + 1])] = False  # the farther one is false
    which = which[real]
    node = np.column_stack((x[which], motion.approach_velocity[which]))
    led = (np.diff(which) == 1) & _hard(node)
    return Followed(seen, real, np.ones(len(node)), led, node, 0, 0)


def rate(held: np.ndarray) -> str:
    """A share, and a 95 % interval of it."""
    told = binomtest(int(held.sum()), len(held)).proportion_ci(method="wilson")
    return f"{held.mean():.0%} ({told.low:.0%} to {told.high:.0%})"


def summary(rows: list[dict]) -> list[str]:
    """A line of the table for each kind of jitter."""
    lines = [
        "| jitter, 0.5 % of the | machines | median error of r | within 0.02 | from the truth "
        "| at the bound | standard error at the bound | errors by it | noise by it "
        "| half-width "
        "| intervals hold r | zeta | amplitudes | misfits | time of a fit |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for unit in UNITS:
        own = [row for row in rows if row["unit"] == unit]
        if not own:
            continue
        held = {}
        for name in ("restitution", "damping"):
            true = np.array([row["truth"][name] for row in own])
            low, high = np.array([row["intervals"][name] for row in own]).T
            held[name] = (low <= true) & (true <= high)
            if name == "restitution":
                error = np.abs(np.array([row["found"][name] for row in own]) - true)
                ratio = error / np.array([row["bound"] for row in own])
                half = float(np.median((high - low) / 2))
                beside = np.abs(np.array([row["beside"] for row in own]) - true)
        amplitudes = np.concatenate([row["amplitudes"] for row in own])
        least = np.array([row["bound"] for row in own])
        within = np.mean(2 * ndtr(TOLERANCE / least) - 1)
        misfits = sum(row["p_value"] <= 0.1 for row in own)
        lines.append(
            f"| {unit} | {len(own)} | {np.median(error):.4f} | {np.mean(error < TOLERANCE):.0%} "
            f"| {np.mean(beside < TOLERANCE):.0%} | {within:.0%} "
            f"| {least.min():.4f} to {least.max():.4f} "
            f"| {np.sqrt(np.mean(ratio**2)):.2f} "
            f"| {np.sqrt(np.mean([row['noise'] ** 2 for row in own])):.2f} | {half:.4f} "
            f"| {rate(held['restitution'])} | {rate(held['damping'])} | {rate(amplitudes)} "
            f"| {misfits} | {np.median([row['seconds'] for row in own]):.1f} s |"
        )
    return lines


def main(machines: str = "40", first: str = "1000", unit: str = "") -> None:
    """Fit, and write the table after every fit."""
    rows: list[dict] = []
    seed = int(first) - 1
    while len(rows) < int(machines):
        seed += 1
        row = fitted(seed, unit or UNITS[seed % 2])
        if row is None:
            continue
        rows.append(row)
        told = ", ".join(
            f"{name} {row['found'][name]:.4f} ({row['truth'][name]:.4f}) in "
            f"{row['intervals'][name][0]:.4f} to {row['intervals'][name][1]:.4f}"
            for name in row["truth"]
        )
        print(
            f"{seed}, {row['unit']}: {told}; bound of r {row['bound']:.4f}, "
            f"from the truth {row['beside']:.4f}, noise {row['noise']:+.2f}; "
            f"p {row['p_value']:.2g}, {row['seconds']:.1f} s"
        )
        save("joint_fit", rows, "\n".join(summary(rows)))
        sys.stdout.flush()
    print("\n".join(summary(rows)))


if __name__ == "__main__":
    main(*sys.argv[1:4])
