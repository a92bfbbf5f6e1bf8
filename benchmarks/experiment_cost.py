"""What an experiment costs beside detection, and how its time and memory grow with its files.

    python -m benchmarks.experiment_cost [--recordings N] [--turns N]
    python -m benchmarks.experiment_cost --files N [--folder FOLDER]

The first reads recordings of the thesis beam (10 s at 50 kHz, 20 dB, 18 to 26 Hz) by `detect_many`
and by `Experiment.read` in turn, on as many processes as there are cores, and prints the ratios of
the time and of the processor time, the best turn of each. The second writes N files of 0.2 s at
2 kHz, reads them as an experiment, then once more, when all runs are kept, and prints what a file
takes and the memory of the process at its height as it goes on. The files are removed.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

import impactsig as im
from benchmarks.experiments import RIG, noise_of, record, simulated

SHORT, SLOW, CONTACT = 0.2, 2000, 4e-3  # [s], [Hz], [s]
MANY = im.Rig(
    channel=[{"number": 0, "sensor": "force", "unit": "V"}],
    parameter={
        "name": "frequency", "unit": "Hz", "from": "file name", "pattern": "(?P<value>[0-9.]+)Hz",
    },
    forcing={"frequency": "parameter"},
)  # fmt: skip
EVERY = 1000  # files of a folder, and runs between two lines of the table


def spent() -> tuple[float, float]:
    """Time, and processor time of this process and those that have ended [s]."""
    both = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    used = [resource.getrusage(who) for who in both]
    return time.perf_counter(), sum(one.ru_utime + one.ru_stime for one in used)


def overhead(folder: Path, recordings: int, turns: int) -> None:
    """Print the ratios of an experiment to the detection alone."""
    truth = simulated(np.round(np.linspace(18.0, 26.0, recordings), 3), "up", 10.0)
    record(truth, folder, noise_of(truth.trains))
    files = sorted(folder.glob("*/*.wav"))

    def detected() -> None:
        found = im.detect_many(files, progress=False, **RIG.reading_options())
        assert not found.errors

    def experiment(turn: int) -> None:
        found = im.Experiment.read(folder, RIG, directory=folder / f".{turn}", progress=False)
        assert not found.errors

    ratios = []
    for turn in range(turns):
        marks = [spent()]
        for work in (detected, lambda turn=turn: experiment(turn)):
            work()
            marks.append(spent())
        alone, whole = np.diff(marks, axis=0)
        ratios.append((*alone, *whole))
        print(
            f"turn {turn}: detection {1e3 * alone[0] / recordings:.1f} ms a recording "
            f"({1e3 * alone[1] / recordings:.1f} ms of processors), experiment "
            f"{1e3 * whole[0] / recordings:.1f} ({1e3 * whole[1] / recordings:.1f}), "
            f"ratio {whole[0] / alone[0]:.2f} ({whole[1] / alone[1]:.2f})",
            flush=True,
        )
    best = np.min(ratios, axis=0)
    print(f"best of {turns}: {best[2] / best[0]:.2f} of the time, {best[3] / best[1]:.2f} of it")


def write_many(folder: Path, count: int) -> None:
    """Files with three or four half-sine pulses, no two alike."""
    import soundfile

    rng = np.random.default_rng(5)
    t = np.arange(int(SHORT * SLOW)) / SLOW
    for number in range(count):
        place = folder / f"{number // EVERY:03d}"
        place.mkdir(exist_ok=True)
        frequency = 18 + 8 * number / count
        since = (t - rng.uniform(0, 0.02)) % (1 / frequency)
        pulse = np.where(since < CONTACT, np.sin(np.pi * since / CONTACT), 0.0)
        samples = 0.5 * pulse + 0.01 * rng.standard_normal(len(t))
        soundfile.write(place / f"{number:06d}_{frequency:.5f}Hz.wav", samples, SLOW, "PCM_16")


def memory() -> float:
    """Of this process now [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def many(folder: Path, count: int) -> None:
    """Print time and memory of an experiment of so many files."""
    write_many(folder, count)
    kept, ended = folder / ".kept", threading.Event()
    print(f"{count} files written; {memory():.0f} MB before")

    def watch() -> None:
        begun = time.perf_counter()
        while not ended.wait(20.0):
            log = sum(1 for _ in kept.glob("*/*.run")) if kept.is_dir() else 0
            print(f"{time.perf_counter() - begun:.0f} s, {log} runs, {memory():.0f} MB", flush=True)

    threading.Thread(target=watch, daemon=True).start()
    for name in ("all files", "all again, kept"):
        begun = spent()
        found = im.Experiment.read(folder, MANY, directory=kept, progress=False)
        wall, cpu = np.subtract(spent(), begun)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        print(
            f"{name}: {len(found)} runs, {len(found.errors)} errors; {1e3 * wall / count:.2f} ms a "
            f"file ({1e3 * cpu / count:.2f} ms of processors), {peak:.0f} MB at its height",
            flush=True,
        )
    begun = spent()
    frame = found.to_frame()
    print(f"table of {len(frame)} runs: {1e3 * (spent()[0] - begun[0]) / count:.2f} ms a run")
    ended.set()


def main() -> None:
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--recordings", type=int, default=161)
    given.add_argument("--turns", type=int, default=5)
    given.add_argument("--files", type=int)
    given.add_argument("--folder", type=Path)
    chosen = given.parse_args()
    with tempfile.TemporaryDirectory(dir=chosen.folder) as folder:
        if chosen.files:
            many(Path(folder), chosen.files)
        else:
            overhead(Path(folder), chosen.recordings, chosen.turns)


if __name__ == "__main__":
    main()
