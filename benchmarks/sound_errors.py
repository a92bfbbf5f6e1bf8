"""Standard errors of the instants of impacts in sound, against the errors that are made.

Impacts ring in modes that are new at each ("own"), in the same modes of phases that are new at each
("shared"), or with one waveform ("alike"). Sounds are made at 88 or 96 kHz, with instants between
samples, and brought to 8, 11, 22 and 44 kHz by a linear-phase filter, or sampled as they are at 22
and 44 kHz. Levels are those of the median peak over the standard deviation of the noise, 1/f or
white. For each: how many are found within 3 ms, the standard deviation of their errors, the median
of what is stated, the standard deviation of the z-scores (error over standard error), and the share
beyond 3. The median error of a record, its delay, is taken off. Then the interval of the z-scores'
standard deviation, over records (`spread.py`): a stratum contradicts .8 to 1.25 if all of it lies
outside. The last line says how many do. Writes results/sound_errors.json.

    python -m benchmarks.sound_errors                       # about ten minutes
    python -m benchmarks.sound_errors --seeds 3:5 --kinds alike --rates 8000
"""

from __future__ import annotations

import argparse
from itertools import product

import numpy as np

import impactsig

from .recordings import Truth, coloured
from .saving import save
from .seeds import add_seeds
from .sound_timing import DECIMATORS, MODES, TIMES
from .spread import WANTED, contradicted, spread_over_records, within

KINDS = ("own", "shared", "alike")
RATES = (8000, 11_025, 22_050, 44_100)
LEVELS = (6.0, 10.0, 20.0, 30.0, 40.0)
TOLERANCE = 3e-3
DURATION = 0.06
"""Of a sound that is synthesised [s]."""


def record(
    kind: str,
    rate: int,
    level: float,
    seed: int,
    *,
    decimator: str = "sox",
    noise: str = "pink",
    count: int = 100,
    gap: float = 0.045,
) -> Truth:
    """`count` impacts of log-normal strengths (sigma 0.35), 0.6 to 1.4 gaps apart."""
    rng = np.random.default_rng([seed, rate, int(level), KINDS.index(kind)])
    times = TIMES[rate] if decimator else 1
    time = 0.2 + np.cumsum(gap * rng.uniform(0.6, 1.4, count))
    strength = 10.0 ** (level / 20.0) * np.exp(0.35 * rng.standard_normal(count))
    samples = np.zeros(round((time[-1] + 0.3) * rate) * times)
    shared = list(MODES.values())[seed % len(MODES)]
    given = rng.uniform(0.0, 2.0 * np.pi, len(shared))
    for start, peak in zip(time, strength, strict=True):
        modes, phases = shared, given
        if kind == "own":
            tones = rng.uniform(1500.0, min(6000.0, 0.45 * rate), 3)
            modes = [(tone, rng.uniform(2e-3, 6e-3), 1.0) for tone in tones]
        if kind != "alike":
            phases = rng.uniform(0.0, 2.0 * np.pi, len(modes))
        first = int(np.ceil(start * rate * times))
        since = (first + np.arange(round(DURATION * rate * times))) / (rate * times) - start
        wave = np.zeros(len(since))
        for (tone, decay, share), phase in zip(modes, phases, strict=True):
            wave += share * np.exp(-since / decay) * np.sin(2 * np.pi * tone * since + phase)
        samples[first : first + len(wave)] += peak * wave / np.abs(wave).max()
    if decimator:
        samples = DECIMATORS[decimator](samples, times)
    rng = np.random.default_rng([seed, 1])
    room = (
        coloured(rng, len(samples), rate) if noise == "pink" else rng.standard_normal(len(samples))
    )
    return Truth(samples + room, float(rate), time, np.full(count, np.nan), strength)


def errors(truth: Truth) -> np.ndarray:
    """Error and standard error [s] of each impact that is found, shape (n, 2)."""
    found = impactsig.detect_impacts(impactsig.Recording(truth.samples, truth.rate, sensor="sound"))
    if not len(found):
        return np.empty((0, 2))
    after = np.clip(np.searchsorted(truth.time, found.time), 1, len(truth.time) - 1)
    earlier = found.time - truth.time[after - 1] < truth.time[after] - found.time
    off = found.time - truth.time[after - earlier]
    off -= np.median(off)
    near = np.abs(off) < TOLERANCE
    return np.column_stack((off, found.time_error))[near]


def stratum(parts: list[np.ndarray]) -> dict:
    """What is stated of some impacts beside the errors that are made [us]."""
    off, error = np.concatenate(parts).T
    z = off / error
    return {
        "found": len(z),
        "deviation us": 1e6 * float(np.std(off)),
        "stated us": 1e6 * float(np.median(error)),
        "z": float(np.std(z)),
        "beyond 3": float(np.mean(np.abs(z) > 3.0)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "301:304")
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--rates", nargs="+", type=int, default=list(RATES), choices=RATES)
    parser.add_argument("--noises", nargs="+", default=["pink", "white"])
    parser.add_argument("--filters", nargs="+", default=["sox", ""], help='"" is none')
    asked = parser.parse_args()
    lines = []
    strata = product(asked.noises, asked.filters, asked.kinds, asked.rates, LEVELS)
    for noise, decimator, kind, rate, level in strata:
        if not decimator and rate < 20_000:
            continue  # modes above half the rate would be folded
        options = {"noise": noise, "decimator": decimator}
        parts = [errors(record(kind, rate, level, seed, **options)) for seed in asked.seeds]
        if sum(len(part) for part in parts) < 30:
            continue
        head = {"noise": noise, "filter": decimator or "none", "kind": kind}
        lines.append(head | {"rate": rate, "level": level} | stratum(parts))
        _, least, most = spread_over_records(
            [off / error for off, error in map(np.transpose, parts)]
        )
        lines[-1] |= {"z at least": least, "z at most": most}
        verdict = "" if within(lines[-1]["z"]) else "missed"
        if contradicted(least, most):
            verdict = "contradicted"
        cells = (f"{one:.3g}" if isinstance(one, float) else str(one) for one in lines[-1].values())
        print("  ".join(f"{cell:>7}" for cell in cells), verdict, flush=True)
    z = np.array([line["z"] for line in lines])
    sides = [contradicted(line["z at least"], line["z at most"]) for line in lines]
    print(
        f"z of {WANTED[0]}-{WANTED[1]}: {np.mean(within(z)):.1%} of {len(lines)} strata;"
        f" contradicted: {sides.count('above')} above, {sides.count('below')} below"
    )
    save("sound_errors", lines)


if __name__ == "__main__":
    main()
