"""Speed of sound detection beside that of another version of the package.

A process with each version searches the same record by turns; CPU time, the least of the turns
(what else runs only adds to it), and F1 of both at 10 ms. Records are those of
`recordings.microphone` and `sound_disturbances`, and with the same modes at each impact those of
`sound_errors`. First calls, which compile, do not count.

    git archive a3b6d0e | tar x -C /tmp/other      # an empty folder
    python -m benchmarks.sound_speed /tmp/other
    python -m benchmarks.sound_speed /tmp/other --duration 30 --only "6 dB" room
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from . import sound_errors
from .recordings import Truth, microphone, score
from .sound_disturbances import gated, only_noise, reverberant

SEARCH = """
import json, sys, time, warnings
import numpy as np
warnings.simplefilter("ignore")
import impactsig
for line in sys.stdin:
    x, rate = np.load(line.split()[0]), float(line.split()[1])
    record = impactsig.Recording(x, rate, sensor="sound")
    start = time.process_time()
    found = impactsig.detect_impacts(record)
    print(json.dumps([time.process_time() - start, found.time.tolist()]), flush=True)
"""
TOLERANCE = 10e-3
GAP = 0.083
"""Seconds between impacts of records with the same modes at each."""


def records(duration: float, seed: int) -> dict[str, Callable[[], Truth]]:
    """What is searched, by name."""
    every: dict[str, Callable[[], Truth]] = {}
    for rate in (8000.0, 22_050.0, 44_100.0):
        tones = (1000, 3200) if rate < 1e4 else (2000, 6000)
        made = partial(microphone, duration=duration, rate=rate, tones=tones, seed=seed)
        for density in (5, 30):
            every[f"{rate / 1000:.0f} kHz, {density} a second"] = partial(made, mean_rate=density)
        for density in (12, 28):
            every[f"{rate / 1000:.0f} kHz, {density} a second, 6 dB"] = partial(
                made, mean_rate=density, noise_db=-6
            )
    for threshold in (0.3, 0.5):
        every[f"gate, {threshold}"] = partial(gated, seed, duration, threshold=threshold)
    for time in (0.1, 0.3, 1.0):
        every[f"room, {time} s"] = partial(reverberant, seed, duration, time=time)
    every["noise"] = partial(noise, duration, seed)
    for rate in (8000, 22_050):
        for kind in ("own", "shared"):
            every[f"{rate / 1000:.0f} kHz, {kind} modes"] = partial(
                sound_errors.record, kind, rate, 20.0, seed, count=int(duration / GAP), gap=GAP
            )
    return every


def noise(duration: float, seed: int) -> Truth:
    """Nothing but 1/f noise."""
    truth = only_noise(seed, exponent=1)
    return Truth(truth.samples[: round(duration * truth.rate)], truth.rate, *3 * [truth.time])


class Version:
    """A process that searches with the package in a folder."""

    def __init__(self, folder: Path) -> None:
        alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-c", SEARCH],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=folder,
            env={**os.environ, **alone, "PYTHONPATH": str(folder)},
        )

    def search(self, file: Path, rate: float) -> tuple[float, list[float]]:
        """CPU time [s], and the instants that are found."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{file} {rate}\n")
        self.process.stdin.flush()
        seconds, found = json.loads(self.process.stdout.readline())
        return seconds, found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("other", type=Path, help="folder of the other version")
    parser.add_argument("--duration", type=float, default=45.0, help="of a record [s]")
    parser.add_argument("--turns", type=int, default=9)
    parser.add_argument("--seed", type=int, default=41)
    parser.add_argument("--only", nargs="+", default=[""], help="records whose names hold one")
    given = parser.parse_args()
    versions = [Version(given.other.resolve()), Version(Path(__file__).resolve().parents[1])]
    print(f"{'record':28} {'other':>8} {'this':>8}  ratio   F1 other   this")
    with tempfile.TemporaryDirectory() as folder:
        for name, make in records(given.duration, given.seed).items():
            if not any(word in name for word in given.only):
                continue
            truth, file = make(), Path(folder) / "record.npy"
            np.save(file, truth.samples)
            search = [partial(version.search, file, truth.rate) for version in versions]
            f1 = [score(run()[1], truth.time, TOLERANCE)[0] for run in search]
            turns = [[run()[0] for run in search] for _ in range(given.turns)]
            other, this = np.min(turns, axis=0)
            print(
                f"{name:28} {1e3 * other:5.1f} ms {1e3 * this:5.1f} ms {this / other:6.2f}"
                f" {f1[0]:10.3f} {f1[1]:6.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
