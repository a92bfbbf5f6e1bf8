"""Figures of `robustness.py`: F1 by disturbance and strength, and three records with what is found.

    python -m benchmarks.robustness --untuned --seeds 401:403 --figure robustness.png

draws robustness.png and robustness_records.png.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .disturbances import Case, records

SHOWN = ("step, 5", "hum, 3 ms, 0.5", "touching 2 ms, 1.5 ms")
"""Records of the second figure, each around its disturbance."""
SPAN = 0.25  # s of each


def families(cases: list[Case]) -> dict[str, list[str]]:
    """Names of records with impacts, by what stands before the strength."""
    found: dict[str, list[str]] = {}
    for case in cases:
        if case.allowed is None:
            found.setdefault(case.name.rpartition(", ")[0], []).append(case.name)
    return found


def strengths(of: list[str]) -> str:
    """Strengths in a row; a word that all begin with is said once."""
    word, _, _ = of[0].rpartition(" ")
    if word and all(one.startswith(f"{word} ") for one in of):
        return f"{word} {', '.join(one.removeprefix(f'{word} ') for one in of)}"
    return ", ".join(of)


def heat_map(cases: list[Case], table: dict, path: Path, tolerance: float) -> None:
    """F1 of each method by disturbance (rows) and strength (columns)."""
    rows = families(cases)
    names = list(dict.fromkeys(name for line in table.values() for name in line))
    most = max(len(row) for row in rows.values())
    picture = Figure(
        figsize=(3.6 + 0.52 * most * len(names), 1.0 + 0.25 * len(rows)), layout="constrained"
    )
    panels = picture.subplots(1, len(names), sharey=True, squeeze=False)[0]
    for ax, name in zip(panels, names, strict=True):
        f1 = np.full((len(rows), most), np.nan)
        for i, row in enumerate(rows.values()):
            for j, record in enumerate(row):
                f1[i, j] = table[record][name]["f1"]
                ink = "black" if 0.6 < f1[i, j] < 0.9 else "white"
                ax.text(j, i, f"{f1[i, j]:.3f}", ha="center", va="center", fontsize=6.5, color=ink)
        image = ax.imshow(f1, cmap="RdYlBu", vmin=0.5, vmax=1, aspect="auto")
        ax.set_title(name, fontsize=9)
        ax.set_xticks([])
        for edge in ax.spines.values():
            edge.set_visible(False)
    labels = [
        f"{family}:  {strengths([record.rpartition(', ')[2] for record in row])}"
        for family, row in rows.items()
    ]
    panels[0].set_yticks(range(len(rows)), labels, fontsize=7)
    picture.supxlabel("strength, in the order of the label on the left", fontsize=8)
    picture.colorbar(
        image, ax=panels, label=f"F1 at ±{tolerance * 1e3:g} ms", extend="min", shrink=0.6, pad=0.01
    )
    picture.savefig(path, dpi=120)


def three_records(every: list, seed: int, path: Path) -> None:
    """Three disturbed records; below each, the impacts in it and those that each method finds."""
    cases = {case.name: case for case in records()}
    picture = Figure(figsize=(9, 7.5), layout="constrained")
    for ax, name in zip(picture.subplots(3), SHOWN, strict=True):
        truth = cases[name].make(seed)
        x, rate = truth.samples, truth.rate
        if name.startswith("step"):
            middle = 0.01 * np.argmax(np.abs(np.diff(x[:: round(0.01 * rate)])))
            first = middle - 0.5 * SPAN
        else:  # where most impacts are
            ends = np.searchsorted(truth.time, truth.time + 0.9 * SPAN)
            first = truth.time[np.argmax(ends - np.arange(len(ends)))] - 0.05 * SPAN
        part = slice(round(first * rate), round((first + SPAN) * rate))
        t = np.arange(len(x))[part] / rate
        ax.plot(t, x[part], color="0.35", linewidth=0.6)
        low, high = x[part].min(), x[part].max()
        marks = [("impacts in the record", "black", truth.time)]
        for method, colour in zip(
            every, ("tab:green", "tab:red", "tab:orange", "tab:blue"), strict=False
        ):
            found, _ = method.make()(x, rate)
            marks.append((method.name, colour, found))
        for k, (label, colour, times) in enumerate(marks):
            height = low - (0.12 + 0.11 * k) * (high - low)
            inside = times[(times >= t[0]) & (times < t[-1])]
            ax.plot(
                inside, np.full(len(inside), height), "|", color=colour, ms=8, mew=1.6,
                label=f"{label}: {len(inside)}",
            )  # fmt: skip
        ax.set_title(name, fontsize=9, loc="left")
        ax.set_xlim(t[0], t[-1])
        ax.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        ax.set_ylabel("force / median pulse", fontsize=8)
        ax.tick_params(labelsize=7)
    ax.set_xlabel("time [s]", fontsize=8)
    picture.savefig(path, dpi=110)
