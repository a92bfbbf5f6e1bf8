"""How often a fitted oscillator is wrong and does not say so, on machines of three kinds.

Machines drawn at random, a third each with one rigid stop (which `fit_oscillator` assumes), with a
soft stop, and with two rigid stops, of which they may meet one only. Of each that moves
irregularly, 600 impacts pass the measuring chain (jitter of 1 % of the mean interval, 2 % missed,
1 % spurious) and are fitted, every fourth from the instants alone. The soft stop's restitution is
that of its free contact; amplitudes are in units of the gap, that of the stop that is met.

A fit is wrong where a parameter is off by more than the width of its interval, which is four
standard errors, and by more than 0.1 (restitution), 10 % (amplitude) or 40 % (damping). It is
silent where it reports no misfit; from instants alone, where it warns that they do not tell a soft
stop from a rigid one, it is "unsure" instead. A parameter without an interval is not counted.
Writes results/misfit.jsonl, one line a machine, and continues where that file ends.

    python -m benchmarks.misfit [last seed [first seed [file]]]
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np

from impactsig import (
    Force,
    Impacts,
    InvalidInput,
    Oscillator,
    Rigid,
    Stop,
    fit_oscillator,
    measure,
    simulate,
)
from impactsig.oscillators import KelvinVoigt

from .saving import result_file

COUNT = 600
NATURAL = 20.0
KINDS = ("rigid", "soft", "two-sided")
NAMES = ("restitution", "damping", "amplitude")
TOLERANCE = {"restitution": 0.1, "damping": 0.4, "amplitude": 0.1}
DISTINCT = 30


def draw(seed: int) -> tuple[str, float, dict[str, float], Impacts]:
    """The first irregular machine of a seed: kind, forcing frequency, truth and impacts."""
    rng = np.random.default_rng([seed, 19])
    kind = KINDS[seed % 3]
    while True:
        ratio = rng.uniform(0.6, 1.5)
        truth = {
            "restitution": rng.uniform(0.1, 0.8),
            "damping": math.exp(rng.uniform(math.log(0.01), math.log(0.1))),
            "amplitude": math.exp(rng.uniform(math.log(0.2), math.log(5.0))),
        }
        law: Any = Rigid(truth["restitution"])
        if kind == "soft":
            law = KelvinVoigt.equivalent(truth["restitution"], math.exp(rng.uniform(3.0, 7.6)))
        stops = [Stop(1.0, law)]
        if kind == "two-sided":
            stops.append(Stop(-rng.uniform(0.4, 1.6), law, "lower"))
        machine = Oscillator(
            damping=2 * truth["damping"],
            forces=(Force(truth["amplitude"], ratio),),
            stops=tuple(stops),
            time_unit=1 / (2 * math.pi * NATURAL),
        )
        impacts = simulate(machine, periods=4 * COUNT, transient=300).impacts[:COUNT]
        if len(impacts) < COUNT or impacts.approach_velocity is None:
            continue
        frequency = ratio * NATURAL
        distinct = np.unique(np.round(impacts.intervals() * frequency, 3))
        if len(distinct) >= DISTINCT:
            assert impacts.stop_index is not None
            met = np.unique(impacts.stop_index)
            if len(met) == 1:
                truth["amplitude"] /= abs(stops[met[0]].position)
            whole = replace(impacts, duration=float(impacts.time[-1] - impacts.start))
            return kind, frequency, truth, whole


def measured(impacts: Impacts, seed: int) -> Impacts:
    """What the measuring chain leaves, with an impulse known to 3 % or, every fourth time, none."""
    seen = measure(
        impacts, jitter=0.01 * impacts.intervals().mean(), missed=0.02, spurious=0.01, seed=seed
    ).impacts
    bare = replace(seen, approach_velocity=None, peak=None, impulse=None, contact_time=None)
    if seed % 4 == 3:
        return bare
    factor = 1 + 0.03 * np.random.default_rng(seed).standard_normal(len(seen))
    assert seen.approach_velocity is not None
    return replace(bare, impulse=seen.approach_velocity * factor)


def fitted(seed: int) -> dict[str, Any]:
    """One machine, its fit and whether that is wrong and silent."""
    kind, frequency, truth, impacts = draw(seed)
    row: dict[str, Any] = {"seed": seed, "kind": kind, "frequency": frequency, "truth": truth}
    row["strengths"] = seed % 4 != 3
    begin = time.process_time()
    try:
        found = fit_oscillator(
            measured(impacts, seed), 1 / frequency, natural_frequency=NATURAL, seed=seed
        )
    except InvalidInput as refusal:
        return row | {"outcome": "refused", "why": str(refusal)}
    except Exception as error:
        return row | {"outcome": "crash", "why": repr(error)}
    wrong = [name for name in NAMES if _off(found, truth, name)]
    warned = any("soft stop from a rigid one" in warning for warning in found.warnings)
    said = "misfit" if found.misfit else "unsure" if warned else "silent"
    outcome = ("wrong, " if wrong else "right, ") + said
    return row | {
        "outcome": outcome, "wrong": wrong, "found": dict(found.values),
        "intervals": {name: list(found.intervals[name]) for name in NAMES},
        "chain": dict(found.chain), "explained": found.explained, "distance": found.distance,
        "p_value": found.p_value, "warnings": list(found.warnings),
        "seconds": time.process_time() - begin,
    }  # fmt: skip


def _off(found: Any, truth: dict[str, float], name: str) -> bool:
    """Whether a parameter that has an interval is far outside of it, and off by what matters."""
    low, high = found.intervals[name]
    if not math.isfinite(low):
        return False
    value, true = found.values[name], truth[name]
    scale = 1.0 if name == "restitution" else true
    return abs(value - true) > max(high - low, TOLERANCE[name] * scale)


def main(last: int = 100, first: int = 1, file: str = "misfit.jsonl") -> None:
    """Fit what is not yet in the file, and print how often each outcome is."""
    path = result_file(file)
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {row["seed"] for row in rows}
    for seed in range(first, last + 1):
        if seed in done:
            continue
        rows.append(fitted(seed))
        with path.open("a") as stream:
            stream.write(json.dumps(rows[-1]) + "\n")
        print(seed, rows[-1]["kind"], rows[-1]["outcome"], rows[-1].get("wrong"), flush=True)
    for kind in KINDS:
        own = [row["outcome"] for row in rows if row["kind"] == kind]
        print(kind, {outcome: own.count(outcome) for outcome in sorted(set(own))})


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), *sys.argv[3:4])
