"""Detection under disturbances: force beside filters before find_peaks, sound beside onset pickers.

Every record of `disturbances.py`, or of `sound_disturbances.py`, is searched by impactsig and by
the peers, each with its defaults and tuned on the truth of that very record. Where a record has no
impacts, the false ones are counted. Peers that are not installed are left out. Writes
results/robustness.json, robustness.md and robustness.png, or those of robustness_sound.

    python -m benchmarks.robustness                                  # needs obspy for STA/LTA
    python -m benchmarks.robustness --only hum "ADC gain" --seeds 3:6 --ours

    python -m benchmarks.robustness --untuned --figure robustness.png
    python -m benchmarks.robustness --sound --seeds 601:603     # needs librosa for its methods

`--only` takes beginnings of names; `--ours` leaves out all but impactsig with its defaults, and
writes nothing; `--figure` draws, and writes nothing else.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

import impactsig

from . import recordings
from .detection import markdown
from .detectors import by_impactsig, find_peaks_passed, sta_lta, timed, tuned
from .disturbances import DURATION, Case, records, stationary
from .recordings import Truth
from .robustness_figures import heat_map, three_records
from .saving import result_file, save
from .seeds import add_seeds
from .sound_disturbances import clear, sound_records
from .sound_passage import LATE
from .sound_passage import methods as sound_methods

TOLERANCE = 1e-3


class Score(NamedTuple):
    """F1, standard deviation of the timing errors [s], mean error of contact times [s]."""

    f1: float
    timing: float
    contact: float


def score(
    found_starts, found_contacts, truth: Truth, tolerance: float = TOLERANCE, delays=(0.0,)
) -> Score:
    """How well impacts are found and measured, a constant latency apart."""
    f1, timing, pairs = recordings.score(found_starts, truth.time, tolerance, delays)
    if found_contacts is None or not len(pairs):
        return Score(f1, timing, np.nan)
    error = np.asarray(found_contacts)[pairs[:, 0]] - truth.contact_time[pairs[:, 1]]
    return Score(f1, timing, float(error.mean()))


@dataclass(frozen=True)
class Method:
    """A family of detectors: `make(**options)` is one, `make()` that with the defaults.

    `aims` is the part of the contact at which its instants lie: 0 for the start, 0.5 for the crest.
    """

    name: str
    make: Callable
    grid: dict = field(default_factory=dict)
    aims: float = 0.0

    def target(self, truth: Truth) -> Truth:
        if not self.aims:
            return truth
        return replace(truth, time=truth.time + self.aims * truth.contact_time)


OURS = "impactsig"


@dataclass(frozen=True)
class Part:
    """What is compared: records of a sensor, the detectors in the order of the columns."""

    sensor: str
    results: str  # name of the files
    tolerance: float  # [s], of a pair
    delays: tuple[float, ...]  # [s], about which a detector's latency is looked for
    records: Callable[[float], list[Case]]
    methods: Callable[[], list[Method]]
    stationary: Callable[[int, float], Truth]  # by which speed is measured


def of_sound() -> list[Method]:
    """Those of `sound_passage.py`, and librosa at its default threshold and frames of 128."""
    every = [Method(name, make, grid) for name, (make, grid) in sound_methods().items()]
    at = [method.name for method in every].index("librosa") + 1 if find_spec("librosa") else None
    if at is not None:
        every.insert(at, Method("librosa, hop 128", partial(every[at - 1].make, hop=128)))
    return every


def of_force() -> list[Method]:
    """Filters before find_peaks, and STA/LTA."""

    def impacts(**options) -> Callable:
        def find(x, rate):
            try:
                return by_impactsig("force", **options)(x, rate)
            except impactsig.InvalidInput:  # a multiple of the noise where there is none
                if not options:
                    raise
                return np.empty(0), np.empty(0)

        return find

    def band_pass(contact=300e-6, level=5.0) -> Callable:
        band = {"low": 0.09 / contact, "high": 1.8 / contact}
        band["distance"] = min(2 * contact, 1.8e-3)  # a tenth of the impacts follow after 2 ms
        return partial(find_peaks_passed, level=level, **band)

    high_pass = partial(partial, find_peaks_passed, low=100.0, high=None)
    levels = [3.0, 5.0, 8.0, 12.0]
    every = [
        Method(
            OURS,
            impacts,
            {"threshold": [None, *(f"{k} sigma" for k in (4, 5, 6, 8, 12, 20))]},
        ),
        Method(
            "band-pass", band_pass, {"contact": [300e-6, 1e-3, 2e-3, 3e-3], "level": levels}, 0.5
        ),
        Method("high-pass", high_pass, {"distance": [6e-4, 1.8e-3, 3e-3], "level": levels}, 0.5),
    ]
    if find_spec("obspy"):
        grid = {"sta": [1e-4, 3e-4, 1e-3], "lta": [0.01, 0.03, 0.1], "on": [3, 5, 8, 12]}
        every.append(Method("STA/LTA", sta_lta("classic"), grid))
    else:
        print("STA/LTA is left out: obspy is not installed")
    return every


PARTS = {
    False: Part("force", "robustness", TOLERANCE, (0.0,), records, of_force, stationary),
    True: Part("sound", "robustness_sound", 10e-3, LATE, sound_records, of_sound, clear),
}
"""By whether sound is asked for."""


def searched(part: Part, case: Case, seed: int, truth: Truth, method: Method, tune: bool) -> dict:
    """One detector on one record."""
    target = method.target(truth)
    row = {"record": case.name, "seed": seed, "method": method.name + ", tuned" * tune}
    row["impacts"] = len(truth.time)
    if method.name == OURS and not tune:
        rec = impactsig.Recording(truth.samples, truth.rate, sensor=part.sensor)
        impacts = impactsig.detect_impacts(rec)
        found, contacts = impacts.time, impacts.contact_time
        row["notes"] = len(getattr(impacts, "notes", ()))
    else:
        best = (
            tuned(method.make, method.grid, target, part.tolerance, part.delays)[0]
            if tune
            else None
        )
        found, contacts = (best or method.make())(truth.samples, truth.rate)
    measured = score(found, contacts, target, part.tolerance, part.delays)
    return row | {"found": len(found)} | measured._asdict()


def together(case: Case, rows: list[dict]) -> dict:
    """Means over the seeds of one detector on one record; of false impacts, the most."""
    if case.allowed is not None:
        return {"false": max(row["found"] for row in rows)}
    with warnings.catch_warnings():  # no impact found with any seed: nothing to average
        warnings.simplefilter("ignore", RuntimeWarning)
        return {key: float(np.nanmean([row[key] for row in rows])) for key in Score._fields}


def cell(mean: dict | None) -> str:
    if mean is None:
        return "–"
    if "false" in mean:
        return str(mean["false"])
    contact = f" {mean['contact'] * 1e6:+6.1f}" if np.isfinite(mean["contact"]) else ""
    return f"{mean['f1']:.3f} {mean['timing'] * 1e6:5.1f}{contact}"


def compare(
    part: Part, cases: list[Case], seeds, every: list[Method], tune: bool
) -> tuple[list, dict]:
    """All rows, and their means by record and method; prints each record when it is done."""
    rows: list[dict] = []
    table: dict[str, dict[str, dict]] = {}
    columns = [(m, t) for m in every for t in ((False, True) if tune and m.grid else (False,))]
    print(" " * 34 + "".join(f"{m.name + ', tuned' * t:>24}" for m, t in columns))
    for case in cases:
        here = []
        for seed in seeds:
            truth = case.make(seed)
            for method, tune_it in columns:
                if not (tune_it and case.allowed is not None):  # no truth to tune on
                    here.append(searched(part, case, seed, truth, method, tune_it))
        names = dict.fromkeys(row["method"] for row in here)
        table[case.name] = {
            name: together(case, [row for row in here if row["method"] == name]) for name in names
        }
        rows += here
        cells = (cell(table[case.name].get(m.name + ", tuned" * t)) for m, t in columns)
        print(f"{case.name:34}" + "".join(f"{text:>24}" for text in cells), flush=True)
    return rows, table


def noted(rows: list[dict]) -> list[dict]:
    """How many of our results carry a note, where they are bad and where they are good."""
    ours = [row for row in rows if "notes" in row and row["impacts"]]
    lines = []
    for name, holds in (("F1 < 0.9", lambda f1: f1 < 0.9), ("F1 > 0.98", lambda f1: f1 > 0.98)):
        such = [row["notes"] > 0 for row in ours if holds(row["f1"])]
        share = float(np.mean(such)) if such else "–"
        lines.append({"results": name, "number": len(such), "share with a note": share})
    return lines


def speeds(part: Part, every: list[Method]) -> list[dict]:
    """Each detector with its defaults on a minute of the stationary record."""
    truth = part.stationary(0, 60.0)
    lines = []
    for method in every:
        _, seconds = timed(method.make(), truth.samples, truth.rate)
        lines.append({"method": method.name, "MS/s": len(truth.samples) / seconds / 1e6})
    for line in lines:
        line["ours to it"] = lines[0]["MS/s"] / line["MS/s"]
    return lines


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sound", action="store_true", help="sound instead of force")
    parser.add_argument("--only", nargs="+", default=[""], help="beginnings of records' names")
    add_seeds(parser, "101:105")
    parser.add_argument("--duration", type=float, default=DURATION, help="of a record [s]")
    parser.add_argument("--ours", action="store_true", help="impactsig with its defaults only")
    parser.add_argument("--untuned", action="store_true", help="defaults only")
    parser.add_argument(
        "--figure", type=Path, help="PNG of F1; of force, beside it FILE_records of three"
    )
    return parser.parse_args()


def main() -> None:
    asked = arguments()
    part = PARTS[asked.sound]
    every = part.methods()[: 1 if asked.ours else None]
    cases = [
        case for case in part.records(asked.duration) if case.name.startswith(tuple(asked.only))
    ]
    rows, table = compare(part, cases, asked.seeds, every, not (asked.ours or asked.untuned))
    tables = {"notes": noted(rows)}
    if not asked.ours:
        tables["speed"] = speeds(part, every)
    text = "".join(f"\n## {name}\n\n{markdown(lines)}" for name, lines in tables.items())
    print(text)
    if asked.figure:
        heat_map(cases, table, asked.figure, part.tolerance)
        if not asked.sound:
            beside = asked.figure.with_name(f"{asked.figure.stem}_records{asked.figure.suffix}")
            three_records(every, asked.seeds[0], beside)
    if asked.ours or asked.figure:
        return
    lines = [
        {"record": name} | {method: cell(mean) for method, mean in line.items()}
        for name, line in table.items()
    ]
    head = f"F1 at ±{part.tolerance * 1e3:g} ms, timing RMS [µs], contact time bias [µs] of force; "
    head += "or false impacts\n\n"
    save(part.results, {"rows": rows, **tables}, head + markdown(lines) + text)
    heat_map(cases, table, result_file(f"{part.results}.png"), part.tolerance)


if __name__ == "__main__":
    main()
