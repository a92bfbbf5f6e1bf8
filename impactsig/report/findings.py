"""Findings on the dynamics: a verdict, then each part in words with its figure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .. import plot
from ..reconstruct.recognition.kinds import is_certain
from ..reconstruct.testing.surrogate_testing import LEVEL
from .analysing.dynamics import REPAIRED, ROUGH_BELOW, TESTED, short_time
from .contents import counted, printable
from .figures import Picture, draw_figure
from .fitted import Finding, dimension, exponent, of_first, surrogates, with_doubts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..impacts import Impacts
    from ..reconstruct.testing.determinism import ReturnMapDeterminism
    from .analysing.analysis import Analysis
    from .analysing.dynamics import Dynamics

LAGS = (1, 2, 3)
SLIGHT, LARGELY = 0.1, 0.8
"""Shares of the variance: below the first scatter about a period is not called a motion, above the
second an interval is said to predict the next."""


def verdict(analysis: Analysis) -> str:
    """The answer in a sentence; empty if the dynamics were not asked for."""
    words = "" if analysis.dynamics.left_out else f"{analysis.dynamics}."
    return words[:1].upper() + words[1:]


def care(analysis: Analysis) -> list[str]:
    """Caveats for the numbers: missed or spurious impacts, gaps."""
    dynamics, texts = analysis.dynamics, []
    repair, fitted = dynamics.repair, dynamics.asked and not dynamics.periodic
    if repair is not None and (repair.splits or repair.joins):
        flaws = [f"lack {counted(len(repair.splits), 'impact')}"] if repair.splits else []
        flaws += [f"contain {counted(len(repair.joins), 'spurious one')}"] if repair.joins else []
        texts.append(
            f"The detected train seems to {' and '.join(flaws)}, which impactsig.repair_intervals "
            "would correct; nothing was changed here."
        )
        if fitted:
            texts.append(
                "Missed or spurious impacts cause wrong intervals: 2 % of "
                "them increase the dimension and the exponent of a chaotic beam by about a tenth."
            )
    elif not fitted:
        pass
    elif repair is not None:
        texts.append(
            "No impact is clearly missed or spurious (impactsig.repair_intervals); in an aperiodic "
            "train not all of them can be recognised."
        )
    elif analysis.forcing_period is None:
        texts.append(
            "Whether impacts were missed or are spurious was not examined: this requires the "
            "forcing frequency (--forcing-frequency)."
        )
    else:
        why = dynamics.without.get("repair", f"there are more than {REPAIRED} impacts")
        texts.append(f"Whether impacts were missed or are spurious was not examined: {why}.")
    if fitted and len(analysis.impacts.gaps):
        texts.append("The run has gaps, and successive intervals may be separated by one.")
    return [printable(text) for text in texts]


def findings(analysis: Analysis) -> Iterator[Finding]:
    """All parts that have a finding."""
    dynamics = analysis.dynamics
    if dynamics.intervals >= 2:
        yield _delay_plot(analysis)
    if dynamics.periodic:
        yield _periodic(analysis)
    elif dynamics.asked:
        yield dimension(dynamics)
        yield exponent(dynamics)
        yield surrogates(dynamics)
    elif dynamics.intervals >= 2:
        yield _left_out(dynamics)


def _delay_plot(analysis: Analysis) -> Finding:
    impacts, dynamics = analysis.impacts, analysis.dynamics
    period = analysis.periodicity
    found = None if dynamics.periodic else dynamics.determinism
    lags = LAGS if dynamics.asked and not dynamics.periodic else LAGS[:1]
    if found is not None:
        words = _decided(found, dynamics.intervals)
    elif dynamics.periodic and period.impacts is not None and period.jitter is not None:
        number, jitter = period.impacts, short_time(period.jitter)
        words = (
            f"A motion that recurs after {counted(number, 'impact')} appears as "
            f"{counted(number, 'point')}, spread by the jitter of {jitter}."
        )
    else:
        words = (
            "A curve, or a structured cloud, indicates deterministic dynamics; "
            "a cloud without structure indicates random intervals."
        )
    width = 4.4 if len(lags) == 1 else 3.7 * len(lags)
    before = "the one before it" if len(lags) == 1 else "the one, two and three before it"
    picture = Picture(
        draw_figure(lambda figure: _return_maps(impacts, lags, figure), width, 3.3),
        f"Delay plot of {dynamics.intervals} interspike intervals, each against {before}",
        f"Each interval against {before} (return map).",
    )
    return Finding("Delay plot", (words,), picture, "half" if len(lags) == 1 else "wide")


def _return_maps(impacts: Impacts, lags: tuple[int, ...], figure: Figure) -> None:
    panels = figure.subplots(1, len(lags), squeeze=False)[0]
    for ax, lag in zip(panels, lags, strict=True):
        plot.return_map(impacts, lag, ax)


def _decided(found: ReturnMapDeterminism, count: int) -> str:
    chance = max(float(found.surrogates.max()), 0.0)
    words = (
        f"An interval explains {100 * found.explained:.0f} % of the variance of the next one "
        f"(in random order at most {100 * chance:.0f} %)"
    )
    if found.p_value > LEVEL:
        words = "An interval explains no more of the variance of the next one than in random order"
    else:
        part = "" if found.explained > LARGELY else " in part"
        words += f": the next impact can{part} be predicted from the last interval"
    return with_doubts(words + of_first(TESTED, count), found.warnings) + "."


def _periodic(analysis: Analysis) -> Finding:
    period = analysis.periodicity
    if not is_certain(period) or not period.jitter:
        return Finding("Dimension", ("The intervals recur: dimension 0; nothing was fitted.",))
    within = short_time(period.jitter)
    words = f"The motion recurs ({period}) to within {within}: its dimension is 0, "
    if not period.recurs:
        words = f"The motion is {period}; it recurs to within {within}, so its dimension is 0, "
    words += "at any scale coarser than that. Nothing was fitted."
    return Finding("Dimension", (printable(words), _left_over(analysis, period.jitter)))


def _left_over(analysis: Analysis, jitter: float) -> str:
    """Whether the scatter about a period contains a motion."""
    found = analysis.dynamics.determinism
    if jitter * analysis.rates[0] < 1:
        return "The remaining scatter is less than the time between two samples."
    if found is None:
        return "The remaining scatter is timing noise, or a small motion" + (
            "." if analysis.dynamics.asked else "; use impactsig report --dynamics to examine it."
        )
    if found.p_value > LEVEL or found.explained < SLIGHT:
        return (
            "The remaining scatter is timing noise: deviations of successive impacts are unrelated."
        )
    return (
        with_doubts(
            "The remaining scatter is more than timing noise: the deviation of an impact explains "
            f"{100 * found.explained:.0f} % of the variance of the next deviation. A narrow "
            "band of chaos, a slow modulation or a drift can cause this; see impactsig dimension",
            found.warnings,
        )
        + "."
    )


def _left_out(dynamics: Dynamics) -> Finding:
    texts = [
        "Correlation dimension, Lyapunov exponent and the test against noise take seconds and were "
        "not requested: impactsig report --dynamics adds them (in Python, dynamics=True)."
    ]
    if dynamics.intervals < ROUGH_BELOW:
        texts.append(f"They require some hundreds of intervals; there are {dynamics.intervals}.")
    return Finding("Left out", tuple(texts))
