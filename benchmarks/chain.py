"""Dimension of the beam through load cell and detector, beside known timing of the same impacts.

Impacts of the thesis beam are recorded by a load cell whose noise, 2.5 % of the median peak, makes
instants uncertain by about 2 microseconds, and detected again. Of as many records as asked for:
in how many the 95 % interval of D2 holds that of the attractor, the mean D2 and half-width; the
same for the true instants with independent errors of 2 microseconds, stated as such. And of the
intervals of all records the errors over their standard errors (median, over .6745), and over those
that `time_error` alone would give.

    python -m benchmarks.chain              # 16 records of 500 and of 2000 impacts, two beams
    python -m benchmarks.chain 12 20        # 12 records from seed 20 on
"""

from __future__ import annotations

import argparse

import numpy as np

import impactsig
from impactsig import Impacts, LoadCell, scenes

TRUE = {20.1: 1.113, 20.3355: 1.0555}
COUNTS = (500, 2000)
NOISE, TIMING, RATE, RESTITUTION = 0.025, 2e-6, 50_000.0, 0.2
APART = 10
"""Impacts between two records of one run."""


class Held:
    """How often an interval holds the truth."""

    def __init__(self, true: float) -> None:
        self.true = true
        self.held, self.values, self.widths = 0, [], []

    def add(self, found) -> None:
        if found.dimension is not None:
            low, high = found.interval
            self.held += low <= self.true <= high
            self.values.append(found.dimension)
            self.widths.append(0.5 * (high - low))

    def __str__(self) -> str:
        return (
            f"{self.held}/{len(self.values)}, {np.mean(self.values):.3f} ± "
            f"{np.mean(self.widths):.3f}"
        )


def z_of(found: Impacts, true: Impacts) -> tuple[np.ndarray, np.ndarray]:
    """Errors of intervals over their standard errors, and over those of independent instants."""
    i, j = impactsig.match_impacts(found, true, 1e-3).pairs.T
    next_too = (np.diff(i) == 1) & (np.diff(j) == 1)
    off = np.diff(found.time[i] - true.time[j])[next_too]
    first = i[:-1][next_too]
    known = found.intervals(errors=True)[1].diagonal()[first]
    alone = found.time_error[first] ** 2 + found.time_error[first + 1] ** 2
    return off / np.sqrt(known), off / np.sqrt(alone)


def one(frequency: float, count: int, records: int, seed: int) -> str:
    scene = scenes.karpodinis(frequency, restitution=RESTITUTION)
    clean = impactsig.simulate(scene, periods=200, transient=500).impacts
    peak = np.median(impactsig.detect_impacts(impactsig.synthesize(clean, "force", rate=RATE)).peak)
    last = seed + records
    run = impactsig.simulate(scene, periods=int(2.6 * count * last) + 300, transient=500).impacts
    chain, known = Held(TRUE[frequency]), Held(TRUE[frequency])
    z, alone = [], []
    for k in range(seed, last):
        time = run.time[k * (count + APART) :][: count + 1]
        start, stop = float(time[0] - 0.2), float(time[-1] + 0.05)
        true = run.between(start, stop)
        record = impactsig.synthesize(
            true, LoadCell(noise=NOISE * peak), rate=RATE, start=start,
            duration=stop + 0.15 - start, seed=k,
        )  # fmt: skip
        found = impactsig.detect_impacts(record)
        chain.add(impactsig.correlation_dimension(found))
        noisy = time + TIMING * np.random.default_rng(k).standard_normal(count + 1)
        known.add(impactsig.correlation_dimension(np.diff(noisy), timing_error=TIMING))
        for values, more in zip((z, alone), z_of(found, true), strict=True):
            values.append(more)
    spread = [np.median(np.abs(np.concatenate(values))) / 0.6745 for values in (z, alone)]
    return f"{chain} | {known} | {spread[0]:.2f} {spread[1]:.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("records", nargs="?", type=int, default=16)
    parser.add_argument("seed", nargs="?", type=int, default=0)
    given = parser.parse_args()
    print("Hz, impacts: held, D2 through the chain | known timing | z of intervals, alone")
    for frequency in TRUE:
        for count in COUNTS:
            line = one(frequency, count, given.records, given.seed)
            print(f"{frequency:7g} {count:5d}: {line}", flush=True)


if __name__ == "__main__":
    main()
