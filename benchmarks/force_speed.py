"""Speed of force detection beside scipy's chain (band-pass, find_peaks, peak_widths).

CPU time, in turns in one process, of records of `recordings.load_cell` at several rates of impacts,
with and without drift and hum; the median ratio over the turns, beside F1 of both.

    python -m benchmarks.force_speed
"""

from __future__ import annotations

import argparse
import time
from functools import partial

import numpy as np

from .detectors import by_impactsig, find_peaks_passed
from .recordings import load_cell, score

STILL = {"drift": False, "doubles": False}
RECORDS = {
    "8 impacts a second": {"mean_rate": 8.0, **STILL},
    "20": {"mean_rate": 20.0, **STILL},
    "20, drift and hum": {"mean_rate": 20.0},
    "100": {"mean_rate": 100.0, **STILL},
}


def seconds(run) -> float:
    """CPU time of one run [s]."""
    start = time.process_time()
    run()
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=30.0, help="of a record [s]")
    parser.add_argument("--turns", type=int, default=9)
    parser.add_argument("--seed", type=int, default=5)
    given = parser.parse_args()
    ours = by_impactsig("force")
    print(f"{'record':20} scipy/ours   F1 ours  scipy")
    for name, options in RECORDS.items():
        truth = load_cell(duration=given.duration, seed=given.seed, **options)
        runs = [partial(find, truth.samples, truth.rate) for find in (find_peaks_passed, ours)]
        f1 = [score(run()[0], truth.time)[0] for run in runs]
        ratios = [seconds(runs[0]) / seconds(runs[1]) for _ in range(given.turns)]
        print(f"{name:20} {np.median(ratios):10.2f} {f1[1]:9.3f} {f1[0]:6.3f}", flush=True)


if __name__ == "__main__":
    main()
