"""Key figures of a report: those that are certain."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..impacts import CLIPPED
from ..intervals.periodicity import SURE
from ..plot.stops import by_stop, several_stops
from .analysing.analysis import Analysis, mean_and_spread
from .contents import level, printable

if TYPE_CHECKING:
    from ..impacts import Impacts
    from ..intervals import Periodicity

TOLD = 0.95
"""Probability of its stop, below which that of an impact is in doubt."""


def tiles(analysis: Analysis) -> list[tuple[str, str, str]]:
    """The key figures: name, value, and a remark."""
    from ..intervals import coefficient_of_variation

    impacts = analysis.impacts
    if not analysis.searched:
        return []
    rate = f"{len(impacts) / impacts.duration:.4g} per second" if impacts.duration else ""
    shown = [("impacts", f"{len(impacts):,}", rate)]
    if several_stops(impacts):
        shown.append(_of_stops(impacts))
    shown += _motion(analysis.periodicity)
    intervals = 1e3 * impacts.intervals()
    if len(intervals):
        low, median, high = np.percentile(intervals, (5, 50, 95))
        # One over an interval is the frequency of something only if every interval is as long.
        once = analysis.periodicity.recurs and analysis.periodicity.impacts == 1
        word = f"{1e3 / median:.5g} Hz" if once else f"{low:.3g} to {high:.3g} ms (5 to 95 %)"
        shown.append(("median interval", f"{median:.5g} ms", word))
    if len(intervals) > 1:
        variation = coefficient_of_variation(impacts)
        shown.append(("interval CV", f"{variation:.3g}", "coefficient of variation"))
    if impacts.contact_time is not None and len(impacts):
        mean, spread = mean_and_spread(impacts.contact_time * 1e3)
        shown.append(("contact time", f"{mean} ms", f"± {spread} ms, {level(impacts)}"))
        if impacts.duration:
            share = 100 * impacts.time_in_contact()
            shown.append(("time in contact", f"{share:.3g} %", "of the run"))
    if impacts.peak is not None and len(impacts):
        shown.append(_peaks(impacts))
    shown += _of_dynamics(analysis)
    return [(a, printable(b), printable(c)) for a, b, c in shown]


def _of_stops(impacts: Impacts) -> tuple[str, str, str]:
    """How many impacts each stop has, and of how many that is in doubt."""
    stops = list(by_stop(impacts, np.arange(len(impacts))))
    counts = " and ".join(f"{int(of_stop.sum()):,}" for _, _, of_stop in stops)
    names = ", ".join(name for name, _, _ in stops)
    if impacts.stop_probability is not None:
        names += f"; {int(np.sum(impacts.stop_probability < TOLD)):,} in doubt"
    return "impacts by stop", counts, names


def _motion(found: Periodicity) -> Iterator[tuple[str, str, str]]:
    """Period or kind of motion if it is certain; the summary gives what is probable."""
    if found.recurs and found.confidence >= SURE:
        named = found.periods is not None
        word = f"({found.impacts}, {found.periods})" if named else found.kind
        how = _probability(found.confidence)
        yield "period", word, f"drifting, {how}" if found.kind == "drifting" else how
    elif found.aperiodic and found.confidence >= SURE:
        yield "motion", found.kind, _probability(found.confidence)
    elif found.kind in ("chaotic", "irregular"):
        either = found.probability["chaotic"] + found.probability["irregular"]
        if either >= SURE:
            yield "motion", "chaotic or irregular", _probability(either)


def _probability(value: float) -> str:
    return f"probability {'over ' if value > 0.99 else ''}{min(value, 0.99):.2f}"


def _peaks(impacts: Impacts) -> tuple[str, str, str]:
    """Median peak; a lower bound if clipped pulses reach it."""
    assert impacts.peak is not None
    low, middle, high = np.percentile(impacts.peak, (5, 50, 95))
    bound = impacts.peak[(impacts.flags & CLIPPED) != 0].min(initial=np.inf)
    spread = f"{low:.3g} to {'over ' if high >= bound else ''}{high:.3g} (5 to 95 %)"
    value = f"{middle:.4g} {impacts.unit}".rstrip()
    return "median peak", f"over {value}" if middle >= bound else value, spread


def _of_dynamics(analysis: Analysis) -> Iterator[tuple[str, str, str]]:
    dimension, exponent = analysis.dynamics.dimension, analysis.dynamics.exponent
    if analysis.dynamics.periodic:
        yield "dimension", "0", "the intervals recur"
        return
    # a number that noise would have as well is no key figure
    if not analysis.dynamics.significant:
        return
    if dimension is not None and dimension.dimension is not None:
        assert dimension.interval is not None
        low, high = dimension.interval
        sure = f"{low:.2f} to {high:.2f} (95 %)" if high > low else "quasi-periodic"
        yield "dimension", f"{dimension.dimension:.2f}", sure
    elif dimension is not None and dimension.slope is not None:
        low, high = dimension.slope.interval
        slope = f"{dimension.slope.value:.2f}"
        yield "slope between two scales", slope, f"{low:.2f} to {high:.2f} (95 %)"
    if exponent is not None and exponent.exponent is not None:
        rate = "" if exponent.per_second is None else f"{exponent.per_second:.3g} per second"
        yield "Lyapunov exponent", f"{exponent.exponent:.3g} per impact", rate
