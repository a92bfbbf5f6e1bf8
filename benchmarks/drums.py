"""Strokes of recorded drums, each recording left out of the tuning.

The hand-annotated recordings of a folder with NAME.flac and NAME_class.txt (the MDB drums of
Southall, Wu, Lerch and Hockman, 2017) are searched by impactsig and by the peers of
`sound_passage.py`. Annotated strokes less than 30 ms apart are one, as are detections; a stroke
counts within 25 ms. Three F1 are printed
for each recording: by default settings, with the setting that is best on all recordings, and with
the one that is best on the others. What is tuned of impactsig is the least probability and the
constants of the decision that were chosen with drums in sight; of the peers, their settings and a
constant latency. Where several settings are the best on the others, their mean counts.

    python -m benchmarks.drums FOLDER
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import product
from pathlib import Path
from types import ModuleType

import mir_eval
import numpy as np
import soundfile

from impactsig.detect.sound.deciding import crests, decision

from .detection import markdown
from .detectors import by_impactsig
from .saving import result_file
from .sound_passage import methods

APART, WINDOW = 0.03, 0.025
LATE = np.arange(-10, 45, 5) * 1e-3
CONSTANTS = {
    (decision, "LEAST_BANDS"): [0.27, 0.33, 0.40],
    (crests, "BORNE_OUT"): [0.025, 0.035, 0.05],
    (decision, "CLEAR"): [1.35, 1.65, 2.0],
    (decision, "OTHERS_OFFSET"): [-8.3, -7.3, -6.3],
    (decision, "OFFSET"): [2.0, 3.0, 4.0],
}
"""Values of constants, each with the module that reads it."""
LEAST = [0.3, 0.5, 0.7]


def alone(time: np.ndarray) -> np.ndarray:
    """Instants without those less than APART after the last one kept."""
    kept: list[float] = []
    for one in np.sort(time):
        if not kept or one - kept[-1] >= APART:
            kept.append(float(one))
    return np.array(kept)


def recordings(folder: Path) -> dict[str, tuple[np.ndarray, float, np.ndarray]]:
    """Samples, rate and strokes of each recording."""
    found = {}
    for path in sorted(folder.glob("*.flac")):
        samples, rate = soundfile.read(path, always_2d=True)
        lines = path.with_name(f"{path.stem}_class.txt").read_text().splitlines()
        strokes = [float(line.split()[0]) for line in lines if line.strip() and line[0] != "#"]
        found[path.stem] = samples.mean(axis=1), float(rate), alone(np.array(strokes))
    return found


@contextmanager
def constants(values: dict[tuple[ModuleType, str], float]) -> Iterator[None]:
    """The decision with other constants."""
    before = {place: getattr(*place) for place in values}
    for place, value in values.items():
        setattr(*place, value)
    try:
        yield
    finally:
        for place, value in before.items():
            setattr(*place, value)


def every(grid: dict) -> list[dict]:
    return [dict(zip(grid, values, strict=True)) for values in product(*grid.values())]


def ours(records: dict) -> tuple[list[float], np.ndarray]:
    """F1 of each record by default, and with each setting (settings, records)."""
    default = [f1(by_impactsig("sound"), one)[0] for one in records.values()]
    rows = []
    for values in every(CONSTANTS):
        with constants(values):
            rows += [
                [
                    f1(by_impactsig("sound", least_probability=least), one)[0]
                    for one in records.values()
                ]
                for least in LEAST
            ]
    return default, np.array(rows)


def theirs(make: Callable, grid: dict, records: dict) -> tuple[list[float], np.ndarray]:
    """The same of a peer, with each latency."""
    default = [f1(make(), one)[0] for one in records.values()]
    rows = []
    for options in every(grid):
        scores = np.array([f1(make(**options), one, LATE) for one in records.values()])
        rows += list(scores.T)
    return default, np.array(rows)


def f1(find: Callable, record: tuple, delays=(0.0,)) -> list[float]:
    """F1 of a detector, with each latency taken off."""
    samples, rate, strokes = record
    found = alone(np.asarray(find(samples, rate)[0]))
    return [
        mir_eval.onset.f_measure(strokes, np.sort(np.maximum(found - late, 0.0)), window=WINDOW)[0]
        for late in delays
    ]


def left_out(scores: np.ndarray) -> list[float]:
    """F1 of each record with the settings that are best on the others."""
    found = []
    for k in range(scores.shape[1]):
        others = np.delete(scores, k, axis=1).mean(axis=1)
        found.append(float(scores[others >= others.max() - 1e-9, k].mean()))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    records = recordings(parser.parse_args().folder)
    lines = []
    searches: dict[str, Callable] = {}
    for name, (make, grid) in methods().items():
        searches[name] = partial(ours, records)
        if name != "impactsig":
            searches[name] = partial(theirs, make, grid, records)
        if name == "librosa":
            hop = {"hop": [128], "delta": grid["delta"]}
            searches["librosa, hop 128"] = partial(
                theirs, partial(make, hop=128), {"delta": hop["delta"]}, records
            )
    for name, search in searches.items():
        default, scores = search()
        best = scores[np.argmax(scores.mean(axis=1))]
        for kind, values in (
            ("defaults", default),
            (f"best of {len(scores)}", best),
            ("each left out", left_out(scores)),
        ):
            row = {"method": name, "tuned": kind, "mean": float(np.mean(values))}
            lines.append(row | dict(zip(records, map(float, values), strict=True)))
            print(
                *(f"{v:.3f}" if isinstance(v, float) else v for v in lines[-1].values()), flush=True
            )
    result_file("drums.md").write_text(markdown(lines))


if __name__ == "__main__":
    main()
