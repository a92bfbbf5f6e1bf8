"""A chart of a million cells and what it costs: the beam over forcing frequency and amplitude.

Every cell is followed for 200 forcing periods, or until its orbit is known, on one thread. The
share of cells that a chart of 2000 periods tells otherwise is counted on every fortieth value of
both parameters. Writes results/large_chart.png. ``python -m benchmarks.large_chart [values]``.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from matplotlib.figure import Figure

from impactsig import Oscillator, periodicity_chart, scenes

from .saving import result_file

APART = 40


def beam(frequency: float, amplitude: float) -> Oscillator:
    """The beam, whose driven amplitude is a share of the distance to its stop."""
    return scenes.karpodinis(frequency, amplitude=amplitude)


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    frequency, amplitude = np.linspace(18, 26, n), np.linspace(0.05, 0.5, n)
    periodicity_chart(beam, frequency[:3], amplitude[:3], workers=1)  # compiles
    begun = time.process_time()
    chart = periodicity_chart(beam, frequency, amplitude, workers=1)
    spent = time.process_time() - begun
    long = periodicity_chart(
        beam, frequency[::APART], amplitude[::APART], periods=2000, skip=False, workers=1
    )
    few = chart.periods[::APART, ::APART], chart.impacts[::APART, ::APART]
    known = (few[0] > 0) & (long.periods > 0)
    other = known & ((few[0] != long.periods) | (few[1] != long.impacts))
    print(f"{n * n} cells: {spent:.1f} s of processor time, {spent / n**2 * 1e6:.1f} us a cell")
    print(f"open: {np.mean(chart.periods == 0):.3f} of the cells")
    print(
        f"of {known.size}, {known.sum()} closed in both charts, {other.sum()} of them otherwise; "
        f"{np.sum((few[0] > 0) & (long.periods == 0))} only in this, "
        f"{np.sum((few[0] == 0) & (long.periods > 0))} only in 2000 periods"
    )
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    ax = figure.subplots()
    chart.plot(ax)
    ax.set_title(f"{n} × {n} cells, 200 periods: {spent:.0f} s on one core")
    figure.savefig(result_file("large_chart.png"), dpi=110)


if __name__ == "__main__":
    main()
