"""A report's size, and the time to write and to draw it; and what a second process brings a batch.

The page is of 3 million samples and 1326 impacts; it is drawn by headless Chromium, where that is
installed, told from the start of its loading until the waveform stands. The batch is of 200 records
of ten seconds, on one process and on two: reports, and tables of impacts. Wall time tells the truth
on idle cores only. Told beside it is what processor time allows: that of one process over that of
the caller and half of that of the two, their starts included. Ratios to the limits are under 1
where these are kept. Writes results/reports.json and reports.md.

    python -m benchmarks.reports              # needs: pip install -e ".[test]"
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import soundfile

from impactsig import LoadCell, scenes, simulate, synthesize
from impactsig.report import analyse, detect_many, write_page, write_reports

from .detection import markdown
from .saving import save, versions

RATE = 50_000
HERTZ = 22.1
PAGE, DRAWN = 3e6, 1.0
"""Greatest size of a page [byte], and time to draw it [s]."""
GAIN = 1.7
"""Least gain of a second process."""
FILES = 200
ROUNDS = {"reports": 1, "impacts": 5}  # a report takes a second


def record(path: Path, periods: int, seed: int) -> Path:
    """A load cell beside a machine that hits its stop once a period, nearly."""
    motion = simulate(scenes.karpodinis(HERTZ), periods=periods, transient=100)
    cell = LoadCell(gain=0.6, noise=2e-3, unit="V")
    samples = synthesize(motion.impacts, cell, rate=RATE, seed=seed).samples
    soundfile.write(path, np.asarray(samples, np.float32), RATE, "FLOAT")
    return path


# -- one page ----------------------------------------------------------------------------------


def page_table(folder: Path) -> list[dict]:
    path, page = record(folder / "long.wav", 1326, 1), folder / "long.html"
    analysis = analyse(path, forcing_period=1 / HERTZ)  # compiles, and imports what it needs
    write_page(analysis, page)
    seconds: dict[str, list[float]] = {"analyse": [], "write": []}
    for _ in range(5):
        start = time.perf_counter()
        analysis = analyse(path, forcing_period=1 / HERTZ)
        seconds["analyse"].append(time.perf_counter() - start)
        start = time.perf_counter()
        write_page(analysis, page)
        seconds["write"].append(time.perf_counter() - start)
    lines: list[dict] = [
        {"of the page": "size [MB]", "median": page.stat().st_size / 1e6, "limit": PAGE / 1e6}
    ]
    lines += [{"of the page": f"{what} [s]", **spread(found)} for what, found in seconds.items()]
    lines.append({"of the page": "drawn [s]", "limit": DRAWN, **drawn(page)})
    for line in lines:
        if "limit" in line and "median" in line:
            line["of the limit"] = line["median"] / line["limit"]
    return lines


def drawn(page: Path) -> dict[str, float]:
    """How long Chromium takes; nothing, where there is none."""
    from tests.browser import MISSING, Browser

    if MISSING:
        print(f"not drawn: no {', no '.join(MISSING)} here", file=sys.stderr)
        return {}
    found = []
    browser = Browser()
    try:
        for _ in range(10):
            browser.open(page)
            found.append(browser.drawn / 1e3)
    finally:
        browser.driver.quit()
    return {"the first": found[0], **spread(found[1:])}


def spread(seconds: list[float]) -> dict[str, float]:
    error = statistics.stdev(seconds) / np.sqrt(len(seconds))
    return {"median": statistics.median(seconds), "±": 1.25 * error}


# -- many --------------------------------------------------------------------------------------


def batch_table(folder: Path) -> list[dict]:
    files = [record(folder / f"{k:03}.wav", 221, k) for k in range(FILES)]
    ways: dict[str, Callable[[list[Path], int], object]] = {
        "reports": lambda some, workers: write_reports(
            some, folder / f"pages{workers}", workers=workers, forcing_period=1 / HERTZ
        ),
        "impacts": lambda some, workers: detect_many(some, workers=workers),
    }
    lines = []
    for name, way in ways.items():
        way(files[:2], 2), way(files[:1], 1)  # compiles
        one, two = [], []
        for _ in range(ROUNDS[name]):  # in turn, for the machine may be busy
            one.append(timed(partial(way, files, 1)))
            two.append(timed(partial(way, files, 2)))
        walls = [a.wall / b.wall for a, b in zip(one, two, strict=True)]
        own = [(a.caller, b.caller + b.others / 2) for a, b in zip(one, two, strict=True)]
        allowed = statistics.median(alone / both for alone, both in own)
        lines.append(
            {
                f"{FILES} files": name,
                "1 process [s]": statistics.median(a.wall for a in one),
                "2 processes [s]": statistics.median(b.wall for b in two),
                "gain": statistics.median(walls),
                "limit": GAIN,
                "limit/gain": GAIN / statistics.median(walls),
                "CPU of 1 [s]": statistics.median(a.caller for a in one),
                "CPU of 2 [s]": statistics.median(b.caller + b.others for b in two),
                "gain by CPU": allowed,
                "same impacts": same(files),
            }
        )
        print(lines[-1], file=sys.stderr)
    return lines


class Taken(NamedTuple):
    """Wall time, and processor time of this process and of those it started and saw end [s]."""

    wall: float
    caller: float
    others: float


def timed(call: Callable[[], object]) -> Taken:
    before = os.times()
    call()
    after = os.times()
    user, system, others, their_system, wall = (b - a for a, b in zip(before, after, strict=True))
    return Taken(wall, user + system, others + their_system)


def same(files: list[Path]) -> bool:
    """Whether impacts do not depend on the number of processes."""
    one, two = (detect_many(files, workers=workers).impacts for workers in (1, 2))
    return all(np.array_equal(one[path].time, two[path].time) for path in files)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        tables = {"one page": page_table(Path(folder)), "many files": batch_table(Path(folder))}
    about = {"cores": os.cpu_count(), **versions("numpy", "matplotlib")}
    text = "".join(f"## {name}\n\n{markdown(lines)}\n" for name, lines in tables.items())
    save("reports", {"about": about, **tables}, text)
    print(text)


if __name__ == "__main__":
    main()
