"""Draw docs/overview.svg, the picture of README, from samples: `python docs/make_overview.py`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import impactsig

mpl.use("svg")
ROOT = Path(__file__).resolve().parents[1]


BETWEEN = 19.0, 21.5  # [Hz], where the sample's recordings are


def main(output: Path) -> None:
    """Draw the diagrams of an experiment, then a record, an impact and a return map."""
    figure = Figure(figsize=(11, 6.2), layout="constrained")
    above, below = figure.subfigures(2, 1)
    diagrams(above)
    one_recording(below)
    # A fixed salt and no date: the same figure is the same file.
    with mpl.rc_context({"svg.hashsalt": "impactsig", "svg.fonttype": "path"}):
        figure.savefig(output, metadata={"Date": None}, dpi=200)


def diagrams(figure: Figure) -> None:
    """Motion and peaks of the experiment's runs over the frequency, beside a simulation's."""
    scene = impactsig.scenes.karpodinis
    up = np.linspace(*BETWEEN, 51)
    simulated = [
        impactsig.bifurcation_diagram(scene, values, carry=True) for values in (up, up[::-1])
    ]
    with tempfile.TemporaryDirectory() as kept:
        runs = impactsig.Experiment.read(
            ROOT / "data_samples" / "experiment", directory=kept, workers=1, progress=False
        )
        period, peaks = figure.subplots(1, 2)
        impactsig.plot.experiment(runs, "period", period, simulated=simulated)
        impactsig.plot.experiment(runs, "peak", peaks, simulated=simulated)
    for artist in (*peaks.collections, *peaks.lines):  # thousands of points
        artist.set_rasterized(True)


def one_recording(figure: Figure) -> None:
    """The record, one of its impacts and the return map of its intervals."""
    recording = impactsig.read(
        ROOT / "data_samples" / "loadcell_chaotic_20.1Hz.wav", unit="V", sensor="force"
    )
    impacts = impactsig.detect_impacts(recording)
    record, pulse, intervals = figure.subplots(1, 3, width_ratios=(2.2, 1, 1))
    impactsig.plot.waveform(recording, impacts, record, start=2.0, stop=2.8)
    impactsig.plot.pulse(recording, impacts, 30, pulse)
    impactsig.plot.return_map(impacts, ax=intervals)
    titled(record, "a load cell's record")
    titled(intervals, "intervals, each and the next")


def titled(ax: Axes, title: str) -> None:
    """Give axes a title in the style of the others."""
    ax.set_title(title, loc="left", fontsize="medium")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "overview.svg")
