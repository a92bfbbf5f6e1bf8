"""What the intervals say of the dynamics: a verdict, then each part in words with its figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from .. import plot
from ..reconstruct.surrogate_testing import LEVEL
from ..reconstruct.surrogates import LABEL
from .contents import counted, printable
from .dynamics import (
    DIMENSIONS,
    READ,
    REPAIRED,
    ROUGH_BELOW,
    TESTED,
    grows,
    is_certain,
    pace,
)
from .figures import Picture, draw, draw_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..impacts import Impacts
    from ..reconstruct import (
        LyapunovExponent,
        ReturnMapDeterminism,
        SurrogateTest,
    )
    from .analysis import Analysis
    from .dynamics import Dynamics

LAGS = (1, 2, 3)
MANY_FALSE = 0.1
"""Share of false neighbours from which on an embedding hides the exponent."""


@dataclass(frozen=True)
class Finding:
    """One part: what it says in sentences, and the figure that shows it."""

    title: str
    words: tuple[str, ...]
    picture: Picture | None = None
    size: Literal["half", "wide"] = "half"


def verdict(analysis: Analysis) -> str:
    """The answer in a sentence; empty where it was not asked for."""
    words = "" if analysis.dynamics.left_out else f"{analysis.dynamics}."
    return words[:1].upper() + words[1:]


def care(analysis: Analysis) -> list[str]:
    """What to mind before the numbers are believed: impacts missed or spurious, gaps."""
    dynamics, told = analysis.dynamics, []
    repair, fitted = dynamics.repair, dynamics.asked and not dynamics.periodic
    if repair is not None and (repair.splits or repair.joins):
        told.append(
            f"The train as found seems to lack {counted(len(repair.splits), 'impact')} and to hold "
            f"{counted(len(repair.joins), 'spurious one')}: impactsig.repair_intervals would put "
            "in and take out these, where the evidence is clear. Nothing was changed here."
        )
        if fitted:
            told.append(
                "Impacts missed or spurious make intervals that the motion does not have: 2 % of "
                "them raise the dimension and the exponent of a chaotic beam by about a tenth."
            )
    elif not fitted:
        pass
    elif repair is not None:
        told.append(
            "No impact is clearly missed or spurious (impactsig.repair_intervals); in an aperiodic "
            "train not every one can be told."
        )
    elif analysis.forcing_frequency is None:
        told.append(
            "Whether impacts were missed or are spurious was not looked into: that takes the "
            "forcing frequency (--forcing-frequency)."
        )
    else:
        why = dynamics.without.get("repair", f"there are more than {REPAIRED} impacts")
        told.append(f"Whether impacts were missed or are spurious was not looked into: {why}.")
    if fitted and len(analysis.impacts.gaps):
        told.append("The run has gaps; what is compared here may reach across one.")
    return [printable(text) for text in told]


def findings(analysis: Analysis) -> Iterator[Finding]:
    """Every part that there is something to say of."""
    dynamics = analysis.dynamics
    if dynamics.intervals >= 2:
        yield _delay_plot(analysis)
    if dynamics.periodic:
        yield _periodic(analysis)
    elif dynamics.asked:
        yield _dimension(dynamics)
        yield _exponent(dynamics)
        yield _surrogates(dynamics)
    elif dynamics.intervals >= 2:
        yield _left_out(dynamics)


def _delay_plot(analysis: Analysis) -> Finding:
    impacts, dynamics = analysis.impacts, analysis.dynamics
    period, found = analysis.periodicity, dynamics.determinism
    lags = LAGS if dynamics.asked and not dynamics.periodic else LAGS[:1]
    if found is not None:
        words = _decided(found, dynamics.intervals)
    elif dynamics.periodic and period.impacts is not None and period.jitter is not None:
        words = (
            f"A motion that recurs after {counted(period.impacts, 'impact')} shows as "
            f"{counted(period.impacts, 'point')}, spread by timing noise of {_time(period.jitter)}."
        )
    else:
        words = (
            "A curve, or a cloud with structure, speaks of a motion that decides its next impact; "
            "a cloud without structure of chance."
        )
    before = "the one before it" if len(lags) == 1 else "the one, two and three before it"
    picture = Picture(
        draw_figure(lambda figure: _return_maps(impacts, lags, figure), 3.7 * len(lags), 3.3),
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
        f"An interval decides {100 * found.explained:.0f} % of the variance of the next one "
        f"(in random order at most {100 * chance:.0f} %)"
    )
    if found.p_value > LEVEL:
        words = "An interval decides no more of the next one than it would in random order"
    elif found.explained > 0.5:
        words += ": the next impact can be foretold from the last interval"
    else:
        words += ": there is order, but the last interval alone does not foretell the next impact"
    return _with_doubts(words + _of_first(TESTED, count), found.warnings) + "."


def _periodic(analysis: Analysis) -> Finding:
    period = analysis.periodicity
    told = ["The intervals recur, so their dimension is 0; nothing was fitted."]
    if analysis.dynamics.intervals and is_certain(period):
        told = [f"The motion recurs ({period}), so its dimension is 0; nothing was fitted."]
    if period.jitter:
        told.append(
            f"What is left, {_time(period.jitter)} about the instants due, is timing noise or a "
            "small motion beside the period; impactsig dimension reads its dimension."
        )
    return Finding("Dimension", tuple(printable(text) for text in told))


def _dimension(dynamics: Dynamics) -> Finding:
    found = dynamics.dimension
    if found is None:
        return _missing("Dimension", "No dimension", "dimension", dynamics)
    read = [one for one in found.by_dimension if one.value is not None]
    listed = ", ".join(f"{one.value:.2f}" for one in read)
    span = _span([one.embedding for one in read])
    if found.value is not None and found.interval is not None and found.region is not None:
        low, high = found.interval
        words = [
            f"Correlation dimension {found.value:.2f}, 95 % interval {low:.2f} to {high:.2f}"
            f"{_of_first(READ, dynamics.intervals)}, read at radii from {_time(found.region[0])} to"
            f" {_time(found.region[1])}, where embedding dimensions {_span(found.plateau)} agree.",
            f"By each estimator alone: {_each(found.estimates)}.",
        ]
        if dynamics.chaotic:
            words.append(
                "Impacts are a section of the motion: the attractor of the machine, with the time "
                "between them, has about one dimension more."
            )
    else:
        words = [
            f"No dimension: as the embedding dimension goes from {span}, the estimate does not "
            f"settle ({listed}). Noise does that, and so does a motion of more dimensions than "
            f"{counted(dynamics.intervals, 'interval')} can show."
            if read
            else "No dimension: at no radius above the noise are there enough pairs of intervals."
        ]
    if found.warnings:
        words.append(f"Mind (times in seconds): {'; '.join(found.warnings)}.")
    picture = Picture(
        draw_figure(found.plot, 11.0, 3.7),
        f"Correlation sums of embedding dimensions {_span(DIMENSIONS)}, their local slopes, and "
        f"the estimate over the embedding dimension: {listed or 'none'}",
        "Correlation sums with the scaling region shaded; their local slopes; the estimate over "
        "the embedding dimension, which levels off for a motion and climbs the dotted line for "
        "noise. Radii are in seconds.",
    )
    return Finding("Dimension", tuple(words), picture, "wide")


def _exponent(dynamics: Dynamics) -> Finding:
    found = dynamics.exponent
    if found is None:
        return _missing("Lyapunov exponent", "No exponent", "exponent", dynamics)
    return Finding(
        "Lyapunov exponent",
        (_with_doubts(_separation(found), found.warnings) + ".", *_false(dynamics)),
        Picture(
            draw(found.plot, 5.0, 3.6),
            f"Logarithm of the gap between neighbours against time: {found.verdict}",
            "How far apart trajectories are that began as neighbours. A straight rise is "
            "exponential growth; it ends where they are as far apart as any two.",
        ),
    )


def _separation(found: LyapunovExponent) -> str:
    if found.verdict == "periodic":
        return "The intervals recur exactly: exponent 0"
    if found.exponent is None:
        return (
            "No exponent: neighbouring trajectories separate at once, or not exponentially over "
            "any stretch, as in noise or where there are too few intervals"
        )
    words = f"{found.exponent:.3g} per impact"
    if found.interval is not None:
        words += f", 95 % interval {found.interval[0]:.3g} to {found.interval[1]:.3g}"
    if found.per_second is not None:
        words += f"; {found.per_second:.3g} per second"
    if found.verdict == "no divergence":
        return (
            f"Neighbouring trajectories stay together ({words}): the motion is periodic or "
            "quasi-periodic rather than chaotic"
        )
    if grows(found):
        return (
            f"Largest Lyapunov exponent {words}. Neighbouring trajectories separate {pace(found)}; "
            "an impact can be foretold a few times as far ahead, and no further"
        )
    return f"Largest Lyapunov exponent {words}, which is not told apart from 0"


def _false(dynamics: Dynamics) -> Iterator[str]:
    share = dynamics.false_share
    if share is not None and share > MANY_FALSE:
        yield (
            f"In no embedding are there fewer than {share:.0%} of false neighbours: noise, or "
            "impacts missed and spurious, hide whatever the exponent is."
        )


def _surrogates(dynamics: Dynamics) -> Finding:
    test = dynamics.surrogates
    if test is None:
        return _missing("More than noise?", "Not told", "surrogates", dynamics)
    return Finding(
        "More than noise?",
        (_with_doubts(_noise(test, dynamics), test.warnings) + ".",),
        Picture(
            draw(test.plot, 5.0, 3.6),
            f"Prediction error of the intervals among those of their surrogates, p = "
            f"{test.p_value:.2g}",
            f"The error of the intervals (line) among those of {len(test.surrogates)} "
            f"{LABEL[test.method]} surrogates (bars): series of the same values and spectrum that "
            "are linear noise.",
        ),
    )


def _noise(test: SurrogateTest, dynamics: Dynamics) -> str:
    errors = (
        f"from those before it an interval is foretold to within {test.statistic:.2f} standard "
        f"deviations, in linear noise of the same values and spectrum to within "
        f"{test.surrogates.mean():.2f} (p = {test.p_value:.2g})"
    )
    errors += _of_first(TESTED, dynamics.intervals)
    if test.rejected:
        return f"Yes: {errors}. That rules linear noise out; it does not prove chaos"
    if dynamics.dimension is dynamics.exponent is None:
        return f"No sign of it: {errors}"
    return f"No sign of it: {errors}. Do not take the numbers beside for those of the machine"


def _left_out(dynamics: Dynamics) -> Finding:
    told = [
        "Correlation dimension, Lyapunov exponent and the test against noise take seconds and were "
        "not asked for: impactsig report --dynamics adds them (in Python, dynamics=True)."
    ]
    if dynamics.intervals < ROUGH_BELOW:
        told.append(f"They want some hundreds of intervals; there are {dynamics.intervals}.")
    return Finding("Left out", tuple(told))


def _missing(title: str, lead: str, part: str, dynamics: Dynamics) -> Finding:
    return Finding(title, (printable(f"{lead}: {dynamics.without[part]}."),))


def _of_first(most: int, count: int) -> str:
    return f" (of the first {most} of {count} intervals)" if count > most else ""


def _with_doubts(words: str, warnings: tuple[str, ...]) -> str:
    return "; but ".join((words, *warnings))


def _span(numbers: tuple[int, ...] | list[int]) -> str:
    return f"{numbers[0]} to {numbers[-1]}" if numbers else "none"


def _time(seconds: float) -> str:
    factor, unit = (1e3, "ms") if seconds >= 1e-3 else (1e6, "µs")
    return f"{factor * seconds:.3g} {unit}"


def _each(estimates: Mapping[str, float | None] | None) -> str:
    known = {name: value for name, value in (estimates or {}).items() if value is not None}
    return ", ".join(f"{name} {value:.2f}" for name, value in known.items())
