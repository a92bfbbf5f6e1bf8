"""Confusion matrix of `identify_period`: motions given by construction against the answers.

Eight kinds of trains (`verdict_trains`), 300 and 1000 impacts, under two levels of noise. A train
of an orbit is right only with the right (m, n); a band hidden by the jitter is right where the
answer is "periodic" with `banded_below` at least as wide as the band. Counted as well: wrong
answers at odds above 20:1. Answers are kept as they come, so a run that was ended goes on where it
stopped.

    python -m benchmarks.verdicts                        # seeds 1000:1040 of all cells
    python -m benchmarks.verdicts --kinds banded echo --counts 300 --noises worst --seeds 1000:1200
    python -m benchmarks.verdicts --figure verdicts.png  # and draw the matrices
    python -m benchmarks.verdicts --along along.png      # the verdict along one drifting record
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from impactsig import Impacts, identify_period, track_period
from impactsig.results import Periodicity

from .seeds import add_seeds
from .verdict_trains import KINDS, PERIOD, Train, chaotic_beam, jittered, noise_of, spoilt, train

RESULTS = Path(__file__).parent / "results" / "verdicts.jsonl"
COUNTS, NOISES = (300, 1000), ("worst", "mild")
ANSWERS = (
    "periodic", "or hidden band", "drifting", "quasi-periodic", "banded", "chaotic", "irregular",
    "other (m, n)",
)  # fmt: skip
SURE = 20 / 21  # odds of 20:1
Cell = tuple[str, int, str]


def answered(given: Train, found: Periodicity) -> str:
    """The column of the matrix that an answer belongs to."""
    if given.orbit is not None and found.impacts is not None:
        if (found.impacts, found.periods) != given.orbit:
            return "other (m, n)"
        hidden = found.kind == "periodic" and given.kind == "banded"
        if hidden and found.banded_below >= given.spread * PERIOD:
            return "or hidden band"
    return "other (m, n)" if found.kind == "unlocked" else found.kind


def right(kind: str, answer: str) -> bool:
    """Whether an answer is right; of echoes, any motion about the right orbit."""
    if kind == "echo":
        return answer in ("periodic", "drifting", "quasi-periodic", "banded")
    if kind == "skipping":
        return answer == "periodic"
    return answer == kind or (kind == "banded" and answer == "or hidden band")


def judged(cell: Cell, seed: int) -> dict:
    """The answer for one train."""
    given = train(*cell, [seed, cell[1]])
    begun = time.process_time()
    found = identify_period(given.impacts, PERIOD)
    took = time.process_time() - begun
    answer = answered(given, found)
    return {
        "cell": list(cell),
        "seed": seed,
        "answer": answer,
        "right": right(cell[0], answer),
        # of the answer in words, with the hidden band if it is named
        "sure": found.confidence > SURE,
        "odds": float(found.probability.get(found.kind, found.confidence)),
        "seconds": took,
    }


def run(cells: Iterable[Cell], seeds: range, keep: Path) -> list[dict]:
    """Judge what was not judged before, and return all that was asked for."""
    keep.parent.mkdir(exist_ok=True)
    kept = [json.loads(line) for line in keep.read_text().splitlines()] if keep.exists() else []
    done = {(tuple(one["cell"]), one["seed"]): one for one in kept}
    wanted = list(itertools.product(cells, seeds))
    with keep.open("a") as file:
        for cell, seed in wanted:
            if (cell, seed) not in done:
                done[cell, seed] = judged(cell, seed)
                print(json.dumps(done[cell, seed]), file=file, flush=True)
    return [done[one] for one in wanted]


def report(results: list[dict]) -> None:
    """Print a line a cell."""
    cells = sorted({tuple(one["cell"]) for one in results}, key=_order)
    for cell in cells:
        here = [one for one in results if tuple(one["cell"]) == cell]
        good, n = sum(one["right"] for one in here), len(here)
        wrong = sum(one["sure"] and not one["right"] for one in here)
        else_ = Counter(one["answer"] for one in here if not one["right"])
        said = ", ".join(f"{count} {answer}" for answer, count in else_.most_common())
        seconds = np.median([one["seconds"] for one in here])
        name, count, noise = cell
        print(
            f"{name:15} n = {count:4} {noise:5}  {good:4} of {n:4} right, {wrong} wrong above "
            f"20:1, {seconds:.3f} s" + (f"  ({said})" if said else "")
        )


def figure(results: list[dict], path: Path) -> None:
    """Draw the matrices: a panel for each length and noise, shares of a row in per cent."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    panels = sorted({tuple(one["cell"][1:]) for one in results}, key=lambda one: (one[1], one[0]))
    rows = [kind for kind in KINDS if any(one["cell"][0] == kind for one in results)]
    wide = 5.4 * len(panels)
    fig, axes = plt.subplots(1, len(panels), figsize=(wide, 4.8), squeeze=False, sharey=True)
    for ax, (count, noise) in zip(axes[0], panels, strict=True):
        share = np.zeros((len(rows), len(ANSWERS)))
        for i, kind in enumerate(rows):
            here = [one["answer"] for one in results if one["cell"] == [kind, count, noise]]
            if here:
                share[i] = [100 * here.count(answer) / len(here) for answer in ANSWERS]
        ax.imshow(share, cmap="Blues", vmin=0, vmax=100, aspect="auto")
        for i, j in np.argwhere(share > 0):
            color = "white" if share[i, j] > 55 else "black"
            ax.text(j, i, f"{share[i, j]:.0f}", ha="center", va="center", color=color)
        ax.set_xticks(range(len(ANSWERS)), ANSWERS, rotation=40, ha="right")
        ax.set_yticks(range(len(rows)), rows)
        ax.set_title(f"{count} impacts, {noise} noise")
        ax.set_xlabel("answer")
    axes[0, 0].set_ylabel("motion")
    fig.suptitle("Answers of identify_period in per cent of the trains of a motion")
    fig.tight_layout()
    fig.savefig(path, dpi=110)


def drifting_record(seed: int = 19) -> Impacts:
    """A record whose speed rises by 1 %: period(1,1), then period(2,2), then the chaotic beam."""
    rng = np.random.default_rng(seed)
    doubled = 200 + (2 * np.arange(100)[:, None] + np.array([0, 1.15])).ravel()
    chaos = chaotic_beam()[:200]
    cycles = np.concatenate((np.arange(200.0), doubled, 401 + chaos - chaos[0]))
    noise = noise_of("mild", rng)
    cycles = spoilt(jittered(cycles, noise, rng), noise, rng)
    time = PERIOD * (cycles - 0.005 * cycles**2 / cycles[-1])
    return Impacts.from_times(time - time[0])


def along(path: Path) -> None:
    """Draw the posterior and the speed along `drifting_record`, and print its stretches."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    found = track_period(drifting_record(), PERIOD)
    print(found.describe())
    fig, (kinds, speed) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
    found.plot(ax=kinds)
    kinds.set_xlabel("")
    for stretch in found.stretches:
        drift = stretch.period.drift
        if drift is not None:
            period = stretch.period.forcing_period
            speed.plot(drift.time, (1 + drift.speed) / period, label=stretch.period.name)
    end = found.stretches[-1].stop
    speed.plot([0, end], [1 / PERIOD, 1.01 / PERIOD], "k--", label="as made")
    speed.set_xlabel("time [s]")
    speed.set_ylabel("forcing frequency [Hz]")
    speed.legend()
    fig.savefig(path, dpi=110)


def _order(cell: Cell) -> tuple[int, int, str]:
    return KINDS.index(cell[0]), cell[1], cell[2]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--counts", nargs="+", type=int, default=COUNTS)
    parser.add_argument("--noises", nargs="+", choices=NOISES, default=NOISES)
    add_seeds(parser, "1000:1040")
    parser.add_argument("--keep", type=Path, default=RESULTS, help="file of answers")
    parser.add_argument("--figure", type=Path, help="file for the matrices")
    parser.add_argument("--along", type=Path, help="draw this file, and count nothing")
    chosen = parser.parse_args()
    if chosen.along is not None:
        along(chosen.along)
        return
    cells = [
        (kind, count, noise)
        for kind in KINDS if kind in chosen.kinds
        for count in chosen.counts
        for noise in chosen.noises
    ]  # fmt: skip
    results = run(cells, chosen.seeds, chosen.keep)
    report(results)
    if chosen.figure is not None:
        figure(results, chosen.figure)


if __name__ == "__main__":
    main()
