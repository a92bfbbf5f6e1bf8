"""D2 and D1 of the beam's intervals at further frequencies and restitutions, for `coverage`.

D2 is the slope of the kernel sum of 2 000 000 noise-free intervals over as many whole lacunar
periods as lie below K = 0.01; a period is what an impact contracts distances by, in e-folds. At
20.1 and 20.3355 Hz it is 1.112 and 1.054, beside the 1.113 +- 0.003 and 1.0555 +- 0.002 of 10^7
intervals. The scatter printed is that of slopes that begin elsewhere. D1 is that of Kaplan and
Yorke, by the exponents of 400 000 periods.

    python -m benchmarks.beam_dimensions
"""

from __future__ import annotations

import numpy as np

from impactsig import lyapunov_spectrum, scenes

from .coverage import BEAMS, RESTITUTION, UNSEEN_BEAMS, beam, long_splines

PERIODS = 400_000
LARGEST = 0.01
STARTS = 50


def over_whole_periods(frequency: float, restitution: float, d1: float) -> tuple[float, float]:
    """Mean and scatter of slopes over the most whole lacunar periods there are."""
    x, contraction = beam(frequency, restitution)
    sums = long_splines(np.array_split(x, 10), 3)
    # The stable exponent: the contraction of areas, and what the other direction grows by.
    period = contraction / (2 - d1)
    kept = sums.x[sums(sums.x) < np.log(LARGEST)]
    span = int(np.ptp(kept) / period) * period
    starts = np.linspace(kept[0], kept[-1] - span, STARTS)
    slopes = (sums(starts + span) - sums(starts)) / span
    return float(slopes.mean()), float(slopes.std())


def main() -> None:
    """All beams of `coverage`."""
    for frequency, restitution in [*((one, RESTITUTION) for one in BEAMS), *UNSEEN_BEAMS]:
        scene = scenes.karpodinis(frequency, restitution=restitution)
        d1 = lyapunov_spectrum(scene, periods=PERIODS).kaplan_yorke_dimension
        d2, scatter = over_whole_periods(frequency, restitution, d1)
        row = f"({frequency}, {restitution}): ({d2:.4f}, {d1:.4f})"
        print(f"{row},  # +- {scatter:.4f}", flush=True)
        beam.cache_clear()


if __name__ == "__main__":
    main()
