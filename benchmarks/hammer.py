"""Calibration of a load cell by an impact hammer: what is stated of the scale against what is made.

A hammer of 0.32 kg that carries an accelerometer hits a cell of 0.2 mV/N, whose converter has steps
of 50 uV, with 21 blows of 50 to 400 N and 0.8 to 1.5 ms. Both are detected, matched and calibrated,
by peaks and by impulses. For each distance of the blows [s] and noise (that of the sensors, 8 m/s^2
and 0.1 mV, is 1): the root mean square of the z-scores of the scale, how many of its 95 % intervals
hold, and the median of what is stated [%]. Writes results/hammer.json.

    python -m benchmarks.hammer                 # about five minutes
    python -m benchmarks.hammer --seeds 5:7 --gaps 0.7
"""

from __future__ import annotations

import argparse
from itertools import product

import numpy as np

from impactsig import Recording, detect_impacts, fit_calibration, match_impacts

from .saving import save
from .seeds import add_seeds

MASS, GAIN, STEP = 0.32, 2e-4, 5e-5  # [kg], [V/N], [V]
NOISES = 8.0, 1e-4  # of acceleration [m/s^2] and of the cell [V]
BLOWS = 21
RATES = (20_000, 50_000)
POWERS = {"half-sine": 1.0, "sine^1.25": 1.25, "raised cosine": 2.0}
"""Shapes of a blow: a sine to this power."""


def sensors(gap: float, rate: int, power: float, noise: float, seed: int) -> list[Recording]:
    """Acceleration of the hammer and voltage of the cell."""
    rng = np.random.default_rng([seed, rate, *(round(1000 * one) for one in (gap, power, noise))])
    count = round((BLOWS * gap + 0.2) * rate)
    force = np.zeros(count)
    length = 1e-3 * rng.uniform(0.8, 1.5)
    for touch in 0.05 + gap * (np.arange(BLOWS) + 0.1 * rng.random(BLOWS)):
        first = int(np.ceil(touch * rate))
        u = (np.arange(first, int((touch + length) * rate) + 1) / rate - touch) / length
        force[first : first + len(u)] += rng.uniform(50.0, 400.0) * np.sin(np.pi * u) ** power
    made = [noise * size * rng.standard_normal(count) for size in NOISES]
    cell = STEP * np.round((GAIN * force + made[1]) / STEP)
    return [Recording(force / MASS + made[0], rate), Recording(cell, rate)]


def z_score(what: str, recordings: list[Recording]) -> tuple[float, float]:
    """Error of the scale over its standard error, and that over the scale."""
    hammer, cell = (detect_impacts(one) for one in recordings)
    cells, blows = match_impacts(cell, hammer).pairs.T
    trains = cell[cells], hammer[blows]
    sizes = 1.0, MASS
    known = np.all([np.isfinite(getattr(one, f"{what}_error")) for one in trains], axis=0)

    def column(name: str) -> list[np.ndarray]:
        return [size * getattr(one, name)[known] for one, size in zip(trains, sizes, strict=True)]

    reading, load = column(what)
    of_reading, of_load = column(f"{what}_error")
    shared = column("shared_peak_error") if what == "peak" else (None, None)
    found = fit_calibration(
        reading,
        load,
        reading_error=of_reading,
        load_error=of_load,
        shared_reading_error=shared[0],
        shared_load_error=shared[1],
        through_zero=True,
    )
    error = float(np.sqrt(found.covariance[0, 0]))
    return (found.scale - 1.0 / GAIN) / error, error * GAIN


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "1:11")
    parser.add_argument("--gaps", nargs="+", type=float, default=[0.09, 0.3, 0.7])
    parser.add_argument("--noises", nargs="+", type=float, default=[0.5, 1.0, 3.0])
    asked = parser.parse_args()
    lines = []
    for what, gap, noise in product(("peak", "impulse"), asked.gaps, asked.noises):
        cases = product(RATES, POWERS.values(), asked.seeds)
        z, error = np.transpose(
            [z_score(what, sensors(gap, rate, power, noise, seed)) for rate, power, seed in cases]
        )
        line = {
            "by": what,
            "gap": gap,
            "noise": noise,
            "calibrations": len(z),
            "z": float(np.sqrt(np.mean(z**2))),
            "held": float(np.mean(np.abs(z) < 1.96)),
            "stated %": 100.0 * float(np.median(error)),
        }
        lines.append(line)
        cells = (f"{one:.3g}" if isinstance(one, float) else str(one) for one in line.values())
        print("  ".join(f"{cell:>7}" for cell in cells), flush=True)
    save("hammer", lines)


if __name__ == "__main__":
    main()
