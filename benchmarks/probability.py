"""Whether the probability of an impact holds: what detection states against what is so.

Fresh synthetic records of load cell and microphone (`benchmarks.recordings`), the noise 6, 10 and
20 dB below an impact of the middle strength. All that is found down to a probability of
1 in 20 is held against the truth: the shares that are impacts in five equal bins, and the Brier
score beside that of a constant. A bin of fewer than 100 events is shown but does not count, for
chance alone puts it off by 0.05. `--events 200` goes on with further seeds until every bin has so
many, which quiet records need: of what is found at 20 dB one in a hundred is in doubt. Writes
results/probability.json and probability.png.

An event is an impact if one of the machine lies within 1 ms (load cell) or 10 ms (microphone),
one to one, once the constant delay is taken off. The probability says that the machine hit, and
`time_error` how exactly when: a faint sound that narrow bands alone tell of is known to some 10 ms,
and is no less of an impact for that.

    python -m benchmarks.probability                    # about five minutes
    python -m benchmarks.probability --seeds 5:7 --sensors sound --levels 10
    python -m benchmarks.probability --seeds 5:405 --sensors sound --levels 20 --events 200
    python -m benchmarks.probability --sensors sound --density 20 --room 0.3 --rate 44100
"""

from __future__ import annotations

import argparse

import numpy as np

import impactsig
from impactsig import plot
from impactsig.plot.records._calibration_bins import CalibrationBins, calibration_bins

from .recordings import load_cell, microphone
from .saving import result_file, save
from .seeds import add_seeds
from .sound_disturbances import in_room

LEVELS = (6, 10, 20)
LEAST = 0.05
CONSTANT = 0.5
"""Brier score, at most, over that of a constant."""
WITHIN = {"force": 1e-3, "sound": 1e-2}
"""Of an event [s], an impact of the machine."""
OFF = 0.05
"""Of each bin, at most: predicted less observed."""
SLOW = 15_000.0
"""Rate below which impacts ring lower [Hz]."""
FEWEST = 100
"""Events of a bin that counts."""


def record(
    sensor: str, level: float, seed: int, duration: float, rate=None, density=None, room=0.0
):
    """A recording of either sensor, and the truth."""
    options = {"duration": duration, "seed": seed}
    options |= {} if rate is None else {"rate": rate}
    options |= {} if density is None else {"mean_rate": density}
    if sensor == "force":
        truth = load_cell(noise=10 ** (-level / 20), **options)
    else:
        if rate is not None and rate < SLOW:
            options["tones"] = 0.125 * rate, 0.4 * rate
        truth = microphone(noise_db=-level, **options)
        truth = in_room(truth, room, seed) if room else truth
    return impactsig.Recording(truth.samples, truth.rate, sensor=sensor), truth.time


def outcomes(sensor: str, level: float, seed: int, duration: float, **options):
    """Stated probabilities, and whether each is of an impact."""
    recording, time = record(sensor, level, seed, duration, **options)
    found = impactsig.detect_impacts(recording, least_probability=LEAST)
    matched = impactsig.match_impacts(found, impactsig.Impacts(time), WITHIN[sensor], delay=None)
    return found.probability, np.isin(np.arange(len(found)), matched.pairs[:, 0])


def enough(parts: list, events: int) -> bool:
    """Whether each of the five bins has so many events."""
    bins = calibration_bins(*map(np.concatenate, zip(*parts, strict=True)))
    return bool(bins.size.min() >= events)


def standard_error(bins: CalibrationBins) -> np.ndarray:
    """Standard error of each observed share, as if one more were an impact and one more not."""
    share = (bins.observed * bins.size + 1.0) / (bins.size + 2.0)
    return np.sqrt(share * (1.0 - share) / (bins.size + 2.0))


def row(sensor: str, level: float, probability: np.ndarray, outcome: np.ndarray) -> dict:
    """One line of the table."""
    bins = calibration_bins(probability, outcome)
    off = np.abs(bins.predicted - bins.observed)[bins.size >= FEWEST]
    return {
        "sensor": sensor,
        "level": level,
        "found": len(outcome),
        "count": bins.size.tolist(),
        "predicted": bins.predicted.round(3).tolist(),
        "observed": bins.observed.round(3).tolist(),
        "error": standard_error(bins).round(3).tolist(),
        "low": bins.low.round(3).tolist(),
        "high": bins.high.round(3).tolist(),
        "greatest off": float(off.max(initial=0.0)),
        "brier": bins.brier,
        "constant": bins.constant,
        "ratio": bins.brier / bins.constant,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "201:205")
    parser.add_argument(
        "--events", type=int, default=0, help="of each bin, from which on no seed is added"
    )
    parser.add_argument("--duration", type=float, default=60.0, help="of each record [s]")
    parser.add_argument("--sensors", nargs="+", default=["force", "sound"])
    parser.add_argument("--levels", nargs="+", type=float, default=list(LEVELS))
    parser.add_argument("--rate", type=float, help="sampling rate [Hz]")
    parser.add_argument("--density", type=float, help="impacts a second")
    parser.add_argument("--room", type=float, default=0.0, help="reverberation time of sound [s]")
    asked = parser.parse_args()
    options = {"rate": asked.rate, "density": asked.density, "room": asked.room}
    from matplotlib.figure import Figure

    wide = 3.6 * len(asked.levels), 3.9 * len(asked.sensors)
    figure = Figure(figsize=wide, layout="constrained")
    panels = figure.subplots(len(asked.sensors), len(asked.levels), squeeze=False)
    lines = []
    print(
        "sensor   dB  found | stated:observed+-standard error (how many) of each bin"
        " | Brier/constant's | records"
    )
    for sensor, axes in zip(asked.sensors, panels, strict=True):
        for level, ax in zip(asked.levels, axes, strict=True):
            ax.set_title(f"{sensor}, {level:g} dB", loc="left", fontsize="medium")
            parts = []
            for seed in asked.seeds:
                parts.append(outcomes(sensor, level, seed, asked.duration, **options))
                if asked.events and enough(parts, asked.events):
                    break
            probability, outcome = map(np.concatenate, zip(*parts, strict=True))
            plot.calibration_curve(probability, outcome, ax)
            line = row(sensor, level, probability, outcome) | {"records": len(parts)}
            lines.append(line)
            cells = "  ".join(
                f"{a:.2f}:{b:.2f}+-{e:.2f} ({n})"
                for a, b, e, n in zip(
                    *(line[k] for k in ("predicted", "observed", "error", "count")), strict=True
                )
            )
            held = line["greatest off"] <= OFF and line["ratio"] <= CONSTANT
            print(
                f"{sensor:6} {level:4g} {line['found']:6d} | {cells} | {line['ratio']:.2f}"
                f" | {len(parts)} records"
                f"{'' if held else '  (missed)'}",
                flush=True,
            )
    save("probability", lines)
    figure.savefig(result_file("probability.png"), dpi=130)


if __name__ == "__main__":
    main()
