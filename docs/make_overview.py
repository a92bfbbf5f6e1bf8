"""Draw docs/overview.svg, the picture of README, from a sample: `python docs/make_overview.py`."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

import impactsig

mpl.use("svg")
ROOT = Path(__file__).resolve().parents[1]


def main(output: Path) -> None:
    """Draw the record, one of its impacts and the return map of its intervals."""
    recording = impactsig.read(
        ROOT / "data_samples" / "loadcell_chaotic_20.1Hz.wav", unit="V", sensor="force"
    )
    impacts = impactsig.detect_impacts(recording)
    figure = Figure(figsize=(11, 3.1), layout="constrained")
    record, pulse, intervals = figure.subplots(1, 3, width_ratios=(2.2, 1, 1))
    impactsig.plot.waveform(recording, impacts, record, start=2.0, stop=2.8)
    impactsig.plot.pulse(recording, impacts, 30, pulse)
    impactsig.plot.return_map(impacts, ax=intervals)
    for ax, title in (
        (record, "a load cell's record"),
        (intervals, "intervals, each and the next"),
    ):
        ax.set_title(title, loc="left", fontsize="medium")
    # A fixed salt and no date: the same figure is the same file.
    with mpl.rc_context({"svg.hashsalt": "impactsig", "svg.fonttype": "path"}):
        figure.savefig(output, metadata={"Date": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "overview.svg")
