"""Fitted oscillators against the truth: errors, coverage of the intervals, time of a fit.

Impacting beams as `scenes.karpodinis` has them, at 20.1 and 20.3355 Hz, with parameters drawn from
r 0.1 to 0.6, zeta 0.02 to 0.05, A 0.2 to 0.3; those that move chaotically, but for bands so narrow
that the fit takes them for periodic. 2000 impacts of each
pass the measuring chain: a jitter of every instant of 1 % of the mean interval, 2 % missed, 1 %
spurious; strengths with a noise of 2 or 5 % of each, or instants alone. Writes results/fitting.json
and fitting.md.

    python -m benchmarks.fitting [draws [first seed]]
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np
from scipy.stats import binomtest

from impactsig import Impacts, InvalidInput, fit_oscillator, measure, scenes, simulate

from .saving import save

COUNT = 2000
STRENGTHS = (0.02, 0.05, None)
NAMES = ("restitution", "damping", "amplitude")
TOLERANCES = (0.02, 0.05, 0.05)  # of the restitution absolute, of the others relative
DISTINCT = 30  # intervals to a thousandth of a period; a periodic motion has a few


def draw(seed: int) -> tuple[float, dict[str, float], Impacts] | None:
    """A beam and its impacts; None where it does not move chaotically."""
    rng = np.random.default_rng(seed)
    frequency = float(rng.choice([20.1, 20.3355]))
    ranges = ((0.1, 0.6), (0.02, 0.05), (0.2, 0.3))
    truth = {name: rng.uniform(*pair) for name, pair in zip(NAMES, ranges, strict=True)}
    scene = scenes.karpodinis(
        frequency, damping_ratio=truth["damping"], amplitude=truth["amplitude"],
        restitution=truth["restitution"],
    )  # fmt: skip
    impacts = simulate(scene, periods=4 * COUNT, transient=300).impacts[:COUNT]
    if len(impacts) < COUNT:
        return None
    distinct = np.unique(np.round(impacts.intervals() * frequency, 3))
    if len(distinct) < DISTINCT:
        return None
    return frequency, truth, replace(impacts, duration=float(impacts.time[-1] - impacts.start))


def measured(impacts: Impacts, noise: float | None, seed: int) -> Impacts:
    """What the chain leaves of them."""
    jitter = 0.01 * impacts.intervals().mean()
    seen = measure(impacts, jitter=jitter, missed=0.02, spurious=0.01, seed=seed).impacts
    if noise is None:
        return replace(seen, approach_velocity=None)
    factor = 1 + noise * np.random.default_rng(seed).standard_normal(len(seen))
    return replace(seen, approach_velocity=None, impulse=seen.approach_velocity * factor)


def fitted(seed: int, noise: float | None) -> dict | None:
    """One fit beside the truth."""
    drawn = draw(seed)
    if drawn is None:
        return None
    frequency, truth, impacts = drawn
    begin = time.process_time()
    try:
        found = fit_oscillator(
            measured(impacts, noise, seed), 1 / frequency,
            natural_frequency=scenes.NATURAL_FREQUENCY, seed=seed,
        )  # fmt: skip
    except InvalidInput as refusal:
        print(f"{seed}: {refusal}")
        return None
    return {
        "seed": seed, "strengths": noise, "frequency": frequency, "truth": truth,
        "found": dict(found.values), "intervals": dict(found.intervals),
        "p_value": found.p_value, "explained": found.explained, "warnings": list(found.warnings),
        "evaluations": found.evaluations, "seconds": time.process_time() - begin,
    }  # fmt: skip


def summary(rows: list[dict]) -> list[str]:
    """A line of the table for each parameter and kind of strengths."""
    lines = [
        "| strengths | parameter | fits | told | median error | within tolerance | half-width "
        "| 95 % intervals hold | which is a rate of |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for noise in STRENGTHS:
        own = [row for row in rows if row["strengths"] == noise]
        for name, tolerance in zip(NAMES, TOLERANCES, strict=True):
            told = [row for row in own if np.isfinite(row["intervals"][name]).all()]
            if not told:
                continue
            true = np.array([row["truth"][name] for row in told])
            unit = 1.0 if name == "restitution" else true
            error = np.abs(np.array([row["found"][name] for row in told]) - true) / unit
            low, high = np.array([row["intervals"][name] for row in told]).T
            half = np.median((high - low) / 2 / unit)
            held = (low <= true) & (true <= high)
            rate = binomtest(int(held.sum()), len(held)).proportion_ci(method="wilson")
            lines.append(
                f"| {'none' if noise is None else f'{noise:.0%}'} | {name} | {len(own)} "
                f"| {len(told)} | {np.median(error):.4f} | {np.mean(error < tolerance):.0%} "
                f"| {half:.4f} | {held.mean():.0%} | {rate.low:.0%} to {rate.high:.0%} |"
            )
    return lines


def _seconds(rows: list[dict]) -> str:
    kinds = {"with strengths": False, "without": True}
    medians = {
        kind: [row["seconds"] for row in rows if (row["strengths"] is None) == none]
        for kind, none in kinds.items()
    }
    return ", ".join(f"{np.median(own):.1f} s {kind}" for kind, own in medians.items() if own)


def main(draws: int = 60, first: int = 1) -> None:
    """Fit, and write the table after every fit."""
    rows: list[dict] = []
    seed = first - 1
    while len(rows) < draws:
        seed += 1
        row = fitted(seed, STRENGTHS[len(rows) % len(STRENGTHS)])
        if row is None:
            continue
        rows.append(row)
        told = ", ".join(
            f"{name} {row['found'][name]:.4f} ({row['truth'][name]:.4f})" for name in NAMES
        )
        print(f"{seed}: strengths {row['strengths']}: {told}; {row['seconds']:.1f} s", flush=True)
        lines = [*summary(rows), "", f"Median processor time of a fit: {_seconds(rows)}."]
        save("fitting", rows, "\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
