"""How often a fit of many trains is marked as a misfit, of right machines and of wrong ones.

Beams as those of `benchmarks/machine_kinds.py`, in 4 irregular runs of 400 instants. Each has a
measuring chain of its own: a jitter of 0.2 to 1 % of the forcing period, every second time
instants in ticks of up to 1 % of it, 0 to 5 % missed and 0 to 3 % spurious. In turn a machine of
each kind fitted as what it is, whose p-values must be uniform from 0 to 1 or above, and a machine
with a soft stop, two stops, echoes or Coulomb friction fitted as one with a rigid stop. A fit that
is refused counts as marked. Writes results/machine_misfit.json and machine_misfit.md.

    python -m benchmarks.machine_misfit [turns [first seed]]
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import replace

import numpy as np
from scipy.stats import binomtest, kstest

from benchmarks import machine_kinds
from benchmarks.joint_fit import ATTEMPTS, rate
from benchmarks.machine_kinds import drawn, forced
from benchmarks.saving import save
from impactsig import Friction, Impacts, InvalidInput, fit_oscillator, measure, scenes

RUNS, COUNT = 4, 400
CASES = (
    ("rigid", "rigid"), ("soft", "soft"), ("two-sided", "two-sided"), ("echo", "echo"),
    ("soft", "rigid"), ("two-sided", "rigid"), ("echo", "rigid"), ("friction", "rigid"),
)  # fmt: skip
"""What a machine is, and what it is fitted as."""
JITTER, TICK, MISSED, SPURIOUS = (0.002, 0.01), 0.01, 0.05, 0.03
FRICTION = (0.03, 0.15)  # by the force
ASTRAY, WIDEST = 0.02, 0.1  # off the restitution: from where on a fit may, and has ended elsewhere
LEVELS = (0.01, 0.05, 0.1, 0.25, 0.5)


def machine(seed: int, kind: str) -> tuple[dict[str, float], list[tuple[float, Impacts]]] | None:
    """Parameters, and each run with its forcing frequency; None if too few are irregular."""
    rng = np.random.default_rng([26, seed])
    truth, stops = drawn(kind, rng)
    ticks = bool(rng.random() < 0.5)
    truth |= {
        "jitter": math.exp(rng.uniform(*np.log(JITTER))), "tick": ticks * rng.uniform(0, TICK),
        "missed": rng.uniform(0, MISSED), "spurious": rng.uniform(0, SPURIOUS),
    }  # fmt: skip
    if kind == "friction":
        truth["friction"] = float(rng.uniform(*FRICTION))
    runs: list[tuple[float, Impacts]] = []
    for _ in range(ATTEMPTS):
        frequency, amplitude, scene = forced(truth, stops, rng)
        if kind == "friction":
            scene = replace(scene, friction=Friction(truth["friction"] * amplitude))
        impacts = machine_kinds.irregular(scene, frequency, COUNT)
        if impacts is not None:
            runs.append((frequency, seen(impacts, truth, frequency, rng)))
        if len(runs) == RUNS:
            return truth, runs
    return None


def seen(
    impacts: Impacts, truth: dict[str, float], frequency: float, rng: np.random.Generator
) -> Impacts:
    """What the measuring chain leaves, in ticks of its clock."""
    if "share" in truth:
        impacts = measure(
            impacts, echoes=truth["share"], echo_delay=truth["delay"], seed=rng
        ).impacts
    found = measure(
        impacts, jitter=truth["jitter"] / frequency, missed=truth["missed"],
        spurious=truth["spurious"], seed=rng,
    ).impacts  # fmt: skip
    found = replace(found, approach_velocity=None)
    tick = truth["tick"] / frequency
    if not tick:
        return found
    ticks, first = np.unique(np.round(found.time / tick), return_index=True)
    stop = found.start + found.duration
    return replace(found[first], time=np.clip(ticks * tick, found.start, stop))


def fitted(seed: int, kind: str, fitted_as: str) -> dict | None:
    """One machine and what the fit says of it."""
    found = machine(seed, kind)
    if found is None:
        return None
    truth, runs = found
    row = {"seed": seed, "kind": kind, "as": fitted_as, "truth": truth}
    begun = time.process_time()
    try:
        fit = fit_oscillator(
            [impacts for _, impacts in runs], [1 / frequency for frequency, _ in runs],
            natural_frequency=scenes.NATURAL_FREQUENCY, kinds=(fitted_as,), seed=seed,
        )  # fmt: skip
    except InvalidInput as refusal:
        return row | {"p_value": 0.0, "runs": [], "refused": str(refusal)}
    return row | {
        "p_value": fit.p_value, "runs": [run.p_value for run in fit.runs],
        "found": dict(fit.values), "astray": astray(fit, truth),
        "seconds": time.process_time() - begun,
    }  # fmt: skip


def astray(fit, truth: dict[str, float]) -> bool:
    """Whether the search ended beside the truth: restitution off by far more than it says."""
    low, high = fit.intervals["restitution"]
    off = abs(fit.values["restitution"] - truth["restitution"])
    return bool(off > WIDEST or off > max(high - low, ASTRAY))


def summary(rows: list[dict]) -> list[str]:
    """A line of the table for each case."""
    head = [f"p <= {level}" for level in LEVELS]
    lines = [
        f"| machine | fitted as | tried | refused | {' | '.join(head)} |",
        "|---|---|---|---|" + len(LEVELS) * "---|",
    ]
    itself = [row for row in rows if row["kind"] == row["as"]]
    right = [row for row in itself if not row.get("astray")]
    lost = [row for row in itself if row.get("astray")]
    wrong = [row for row in rows if row["kind"] != row["as"]]
    parts = [
        (one, [row for row in right + wrong if (row["kind"], row["as"]) == one]) for one in CASES
    ]
    parts += [
        (("all", "itself"), right), (("all", "itself, but astray"), lost),
        (("all", "rigid, but other"), wrong),
    ]  # fmt: skip
    for name, own in parts:
        if not own:
            continue
        p = np.array([row["p_value"] for row in own])
        shares = " | ".join(f"{np.mean(p <= level):.0%}" for level in LEVELS)
        refused = sum("refused" in row for row in own)
        lines.append(f"| {name[0]} | {name[1]} | {len(own)} | {refused} | {shares} |")
    if right:
        p = np.array([row["p_value"] for row in right])
        runs = np.concatenate([row["runs"] for row in right])
        chance = binomtest(int(np.sum(p <= 0.01)), len(p), 0.01, "greater").pvalue
        low = kstest(p, "uniform", alternative="greater").pvalue
        lines += [
            "",
            f"Right machines: p <= 0.01 in {rate(p <= 0.01)}, at that level a chance of "
            f"{chance:.2g}; that of p-values as low as all these {low:.2g} (Kolmogorov). Of "
            f"the {len(runs)} single runs {np.mean(runs <= 4 / 41):.0%} have 4/41 (9.8 %) or less; "
            f"their mean is {runs.mean():.2f} (0.51).",
        ]
    return lines


def main(turns: int = 10, first: int = 1) -> None:
    """Fit a machine of each case in every turn, and write the table after every fit."""
    rows: list[dict] = []
    seed = first - 1
    for _ in range(turns):
        for case in CASES:
            row = None
            while row is None:
                seed += 1
                row = fitted(seed, *case)
            rows.append(row)
            told = (
                "refused" if "refused" in row else f"p {row['p_value']:.3g}, {row['seconds']:.1f} s"
            )
            print(f"{seed}: {case[0]} as {case[1]}: {told}", flush=True)
            save("machine_misfit", rows, "\n".join(summary(rows)))
    print("\n".join(summary(rows)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
