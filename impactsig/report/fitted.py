"""Findings from dimension, exponent and surrogate test, in words with their figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from .analysing.dynamics import READ, TESTED, grows, pace, short_time
from .contents import printable
from .figures import Picture, draw, draw_figure

if TYPE_CHECKING:
    from ..reconstruct.divergence.exponents import LyapunovExponent
    from ..reconstruct.testing.surrogate_testing import SurrogateTest
    from .analysing.dynamics import Dynamics

MANY_FALSE = 0.1
"""Share of false neighbours from which on an embedding hides the exponent."""


@dataclass(frozen=True)
class Finding:
    """One part of the findings: sentences, and a figure."""

    title: str
    words: tuple[str, ...]
    picture: Picture | None = None
    size: Literal["half", "wide"] = "half"


def dimension(dynamics: Dynamics) -> Finding:
    """Slope of the correlation sum and dimension, or the reason for none."""
    found = dynamics.dimension
    if found is None:
        return _missing("Dimension", "No dimension", "dimension", dynamics)
    of = of_first(READ, dynamics.intervals)
    one = found.slope
    if one is None:
        text = f"{found.describe()}{of}."
        return Finding("Dimension", (printable(text[:1].upper() + text[1:]),))
    least, most = map(short_time, one.scales)
    low, high = one.interval
    words = [
        f"The correlation sum grows with a slope of {one.value:.2f}, 95 % interval {low:.2f} to "
        f"{high:.2f}{of}, between scales of {least} and {most} (embedding dimension "
        f"{one.embedding}). Timing errors of {short_time(found.timing_error)} are allowed for "
        f"({found.noise_source}); the interval covers {', '.join(one.errors)}."
    ]
    if found.dimension is not None and found.interval is not None:
        low, high = found.interval
        words.insert(
            0,
            f"Correlation dimension {found.dimension:.2f}, 95 % interval {low:.2f} to {high:.2f}, "
            "which also covers the choice of scales.",
        )
        if dynamics.chaotic:
            words.append(
                "Impacts are a section of the motion: the attractor of the machine, with the time "
                "between them, has about one dimension more."
            )
    else:
        needed = f" Needed: {found.needed}." if found.needed else ""
        words.append(
            f"That need not be the dimension of the attractor: {found.reason} (times in seconds)."
            f"{needed}"
        )
    if found.warnings:
        words.append(f"Mind (times in seconds): {'; '.join(found.warnings)}.")
    picture = Picture(
        draw_figure(found.plot, 9.0, 3.7),
        f"Correlation sum and its local slopes: slope {one.value:.2f}",
        "The correlation sum of a Gaussian kernel, freed of timing noise, and its local slopes "
        "with their 95 % band. Scales are in seconds.",
    )
    return Finding("Dimension", tuple(printable(text) for text in words), picture, "wide")


def exponent(dynamics: Dynamics) -> Finding:
    """The largest Lyapunov exponent, or the reason for none."""
    found = dynamics.exponent
    if found is None:
        return _missing("Lyapunov exponent", "No exponent", "exponent", dynamics)
    return Finding(
        "Lyapunov exponent",
        (with_doubts(_separation(found, dynamics), found.warnings) + ".", *_false(dynamics)),
        Picture(
            draw(found.plot, 5.0, 3.6),
            f"Logarithm of the gap between neighbours against time: {found.verdict}",
            "How far apart trajectories are that began as neighbours. A straight rise is "
            "exponential growth; it ends where they are as far apart as any two.",
        ),
    )


def _separation(found: LyapunovExponent, dynamics: Dynamics) -> str:
    if found.verdict == "periodic":
        return "The intervals recur exactly: exponent 0"
    if found.exponent is None:
        return (
            "No exponent: neighbouring trajectories separate at once, or not exponentially over "
            "any stretch, as in noise or where there are too few intervals"
        )
    words = f"{found.exponent:.3g} per impact"
    if found.interval is not None and dynamics.covers(found):
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
            "an impact can be predicted a few times as far ahead, and no further"
        )
    return f"Largest Lyapunov exponent {words}, which cannot be distinguished from 0"


def _false(dynamics: Dynamics) -> Iterator[str]:
    share = dynamics.false_share
    if share is not None and share > MANY_FALSE:
        yield (
            f"In no embedding are there fewer than {share:.0%} of false neighbours: noise, or "
            "impacts missed and spurious, hide whatever the exponent is."
        )


def surrogates(dynamics: Dynamics) -> Finding:
    """Whether the intervals are more than linear noise."""
    test = dynamics.surrogates
    if test is None:
        return _missing("More than noise?", "Not decided", "surrogates", dynamics)
    return Finding(
        "More than noise?",
        (with_doubts(_noise(test, dynamics), test.warnings) + ".",),
        Picture(
            draw(test.plot, 5.0, 3.6),
            f"Prediction error of the intervals among those of their surrogates, p = "
            f"{test.p_value:.2g}",
            "Error of nonlinear prediction by that of linear prediction, of the intervals (line) "
            f"among {len(test.surrogates)} {test.method} surrogates (bars): series of the same "
            "values and spectrum that are linear noise.",
        ),
    )


def _noise(test: SurrogateTest, dynamics: Dynamics) -> str:
    errors = (
        f"nonlinear prediction of an interval from those before it errs {test.statistic:.2f} times "
        f"as much as linear prediction, in linear noise of the same values and spectrum "
        f"{test.surrogates.mean():.2f} times (p = {test.p_value:.2g})"
    )
    errors += of_first(TESTED, dynamics.intervals)
    if test.rejected:
        return f"Yes: {errors}. That rules linear noise out; it does not prove chaos"
    if not test.decided:
        return f"Not decided: {errors}"
    if dynamics.dimension is dynamics.exponent is None:
        return f"No sign of it: {errors}"
    return f"No sign of it: {errors}. Do not take the numbers beside for those of the machine"


def _missing(title: str, lead: str, part: str, dynamics: Dynamics) -> Finding:
    return Finding(title, (printable(f"{lead}: {dynamics.without[part]}."),))


def of_first(most: int, count: int) -> str:
    """A remark if only the first intervals were used."""
    return f" (of the first {most} of {count} intervals)" if count > most else ""


def with_doubts(words: str, warnings: tuple[str, ...]) -> str:
    """A sentence followed by its reservations."""
    return "; but ".join((words, *warnings))
