"""Which kind of machine many trains come from: how often the evidence names the right one.

Beams with r 0.1 to 0.7 and zeta 0.01 to 0.06, measured in 8 irregular runs at frequencies of 40 to
80 Hz (two to four times the natural one, where a soft stop too leads to chaos): 500 instants of
each, 2 % missed, 1 % spurious, a jitter of 0.5 % of the forcing period. In turn with a rigid stop,
with a soft one of 10 to 200 times the spring's stiffness, with a second rigid stop 0.6 to 1.4 gaps
away on the other side, and with echoes of 30 to 90 % of the impacts after 1 to 4 ms. Writes
results/machine_kinds.json and machine_kinds.md.

    python -m benchmarks.machine_kinds [machines [first seed]]
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import replace

import numpy as np

from benchmarks.joint_fit import ATTEMPTS, COUNT, DISTINCT, JITTER, RUNS, rate
from benchmarks.saving import save
from impactsig import (
    Impacts,
    KelvinVoigt,
    Rigid,
    Stop,
    fit_oscillator,
    measure,
    scenes,
    simulate,
)

KINDS = ("rigid", "soft", "two-sided", "echo")
FREQUENCY, REACH = (40.0, 80.0), (0.8, 4.0)  # of the amplitude, by that which just touches
STIFFNESS, FAR = (10.0, 200.0), (0.6, 1.4)
SHARE, DELAY = (0.3, 0.9), (1e-3, 4e-3)  # of echoes, and seconds
LEAST_SIDE = 0.1  # of the impacts on either of two sides


def drawn(kind: str, rng: np.random.Generator) -> tuple[dict[str, float], tuple[Stop, ...]]:
    """Parameters of a machine of a kind, and its stops."""
    truth = {"restitution": float(rng.uniform(0.1, 0.7)), "damping": float(rng.uniform(0.01, 0.06))}
    if kind == "soft":
        truth["stiffness"] = math.exp(rng.uniform(*np.log(STIFFNESS)))
        stops = (Stop(1.0, KelvinVoigt.equivalent(truth["restitution"], truth["stiffness"])),)
    else:
        stops = (Stop(1.0, Rigid(truth["restitution"])),)
    if kind == "two-sided":
        truth["far"] = float(rng.uniform(*FAR))
        stops += (Stop(-truth["far"], Rigid(truth["restitution"]), "lower"),)
    if kind == "echo":
        truth |= {"share": float(rng.uniform(*SHARE)), "delay": float(rng.uniform(*DELAY))}
    return truth, stops


def forced(truth: dict[str, float], stops: tuple[Stop, ...], rng: np.random.Generator):
    """Frequency and amplitude of a run, and the beam there."""
    frequency = float(rng.uniform(*FREQUENCY))
    omega = frequency / scenes.NATURAL_FREQUENCY
    amplitude = abs(1 - omega**2) * math.exp(rng.uniform(*np.log(REACH)))
    scene = scenes.karpodinis(frequency, damping_ratio=truth["damping"], amplitude=amplitude)
    return frequency, amplitude, replace(scene, stops=stops)


def machine(seed: int) -> tuple[str, dict[str, float], list[tuple[float, float, Impacts]]] | None:
    """Kind, parameters and runs; None where too few runs are irregular."""
    rng = np.random.default_rng([25, seed])
    kind = KINDS[seed % len(KINDS)]
    truth, stops = drawn(kind, rng)
    runs: list = []
    for _ in range(ATTEMPTS):
        frequency, amplitude, scene = forced(truth, stops, rng)
        impacts = irregular(scene, frequency)
        if impacts is not None:
            chain = {"jitter": JITTER / frequency, "missed": 0.02, "spurious": 0.01}
            if kind == "echo":
                impacts = measure(
                    impacts, echoes=truth["share"], echo_delay=truth["delay"],
                    seed=int(rng.integers(2**31)),
                ).impacts  # fmt: skip
            seen = measure(impacts, **chain, seed=int(rng.integers(2**31))).impacts
            runs.append((frequency, amplitude, replace(seen, approach_velocity=None)))
        if len(runs) == RUNS:
            return kind, truth, runs
    return None


def irregular(scene, frequency: float, count: int = COUNT) -> Impacts | None:
    """Impacts of a motion that is not periodic, and hits all of its stops; else None."""
    impacts = simulate(scene, periods=60, transient=200).impacts
    if not 15 <= len(impacts) <= 180:
        return None
    impacts = simulate(scene, periods=6 * count, transient=300).impacts[:count]
    distinct = np.unique(np.round(impacts.intervals() * frequency, 3))
    if len(impacts) < count or len(distinct) < DISTINCT:
        return None
    if len(scene.stops) > 1:
        first = np.mean(impacts.stop_index == 0)
        if not LEAST_SIDE <= first <= 1 - LEAST_SIDE:
            return None
    return replace(impacts, duration=float(impacts.time[-1] - impacts.start))


def fitted(seed: int) -> dict | None:
    """The kind that the evidence names, beside the true one."""
    drawn = machine(seed)
    if drawn is None:
        return None
    kind, truth, runs = drawn
    begin = time.process_time()
    found = fit_oscillator(
        [impacts for *_, impacts in runs], [1 / frequency for frequency, *_ in runs],
        natural_frequency=scenes.NATURAL_FREQUENCY, kinds=KINDS, seed=seed,
    )  # fmt: skip
    seconds = time.process_time() - begin
    return {
        "seed": seed, "kind": kind, "truth": truth, "told": found.kind, "decided": found.decided,
        "log_odds": dict(found.log_odds), "found": dict(found.values),
        "intervals": dict(found.intervals), "echoes": dict(found.echoes),
        "p_value": found.p_value, "seconds": seconds,
    }  # fmt: skip


def summary(rows: list[dict]) -> list[str]:
    """A line of the table for each kind of machine."""
    lines = [
        "| machine | tried | kind right | undecided | median error of r | intervals hold r "
        "| least log odds | time |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind in (*KINDS, "all"):
        own = [row for row in rows if kind in (row["kind"], "all")]
        if not own:
            continue
        right = np.array([row["decided"] and row["told"] == row["kind"] for row in own])
        true = np.array([row["truth"]["restitution"] for row in own])
        error = np.abs(np.array([row["found"]["restitution"] for row in own]) - true)
        low, high = np.array([row["intervals"]["restitution"] for row in own]).T
        margin = min(
            -odds for row in own for name, odds in row["log_odds"].items() if name != row["told"]
        )
        lines.append(
            f"| {kind} | {len(own)} | {rate(right)} | {sum(not row['decided'] for row in own)} "
            f"| {np.median(error):.4f} | {rate((low <= true) & (true <= high))} | {margin:.0f} "
            f"| {np.median([row['seconds'] for row in own]):.0f} s |"
        )
    return lines


def main(machines: int = 40, first: int = 1000) -> None:
    """Fit as many of each kind, and write the table after every fit."""
    rows: list[dict] = []
    seed = first - 1
    while len(rows) < machines:
        seed += 1
        if sum(row["kind"] == KINDS[seed % 4] for row in rows) >= -(-machines // 4):
            continue
        row = fitted(seed)
        if row is None:
            continue
        rows.append(row)
        odds = ", ".join(f"{name} {value:.0f}" for name, value in row["log_odds"].items())
        found = ", ".join(f"{k} {v:.4g}" for k, v in row["found"].items())
        true = ", ".join(f"{k} {v:.4g}" for k, v in row["truth"].items())
        print(
            f"{seed}: {row['kind']} told {row['told']}{'' if row['decided'] else ' (undecided)'}; "
            f"{odds}; {found} ({true}); p {row['p_value']:.2g}, {row['seconds']:.0f} s"
        )
        save("machine_kinds", rows, "\n".join(summary(rows)))
        sys.stdout.flush()
    print("\n".join(summary(rows)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
