"""Periodicity: what period a train of impacts was found to have, in numbers and in words."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Kind = Literal[
    "periodic", "unlocked", "aperiodic", "intermittent", "too few impacts", "too short a run"
]
LEAST_IMPACTS = 8


@dataclass(frozen=True)
class Candidate:
    """One period that was tried.

    Attributes
    ----------
    impacts : int
        m, the impacts that recur.
    periods : int or None
        n, the forcing periods in which they do; None where the forcing period is not known.
    repeat_period : float
        The time in which they recur [s].
    score : float
        Gain in log-likelihood over impacts at random instants, less a penalty for every parameter.
    missed, spurious, jitter : float
        As in `Periodicity`, were this the period.
    probability : float
        That this is the period, among the candidates and none.
    """

    impacts: int
    periods: int | None
    repeat_period: float
    score: float
    missed: float
    spurious: float
    jitter: float
    probability: float


@dataclass(frozen=True, eq=False)
class Periodicity:
    """What `identify_period` found, and on what evidence.

    Attributes
    ----------
    impacts, periods : int or None
        m and n of period(m, n): m impacts in n forcing periods. `periods` is None where the
        forcing period is not known or the repeat period is no multiple of it; both are None where
        there is no period.
    kind : str
        "periodic"; "unlocked" (periodic, but not in multiples of the forcing period given);
        "aperiodic"; "intermittent" (aperiodic, with long silent stretches, as near grazing);
        "too few impacts"; "too short a run" (of less than four forcing periods).
    confidence : float
        Probability of that answer under the models compared, 0 to 1; 0 where it cannot be told.
    count : int
        Impacts looked at.
    forcing_period : float or None
        The forcing period [s]: as given, or where the motion is locked to it, in the clock of the
        recording.
    repeat_period : float or None
        The time after which the motion recurs [s].
    phases : ndarray, shape (m,)
        When in the repeat period the impacts come, as shares of it, the first at 0.
    jitter : float or None
        Standard deviation of the impacts about their phases [s].
    missed, spurious : float or None
        Share of the impacts due that did not come; share of the impacts that were not due.
    longest_silence : float
        The longest interval [s].
    candidates : tuple of Candidate
        The periods that were tried.
    """

    impacts: int | None
    periods: int | None
    kind: Kind
    confidence: float
    count: int
    forcing_period: float | None = None
    repeat_period: float | None = None
    phases: np.ndarray = field(default_factory=lambda: np.empty(0))
    jitter: float | None = None
    missed: float | None = None
    spurious: float | None = None
    longest_silence: float = 0.0
    candidates: tuple[Candidate, ...] = ()

    @property
    def aperiodic(self) -> bool:
        """Whether the impacts were enough to tell, and do not recur."""
        return self.kind in ("aperiodic", "intermittent")

    def describe(self) -> str:
        """The answer in words."""
        if self.kind == "too few impacts":
            needed = f"{LEAST_IMPACTS} or more at different instants are needed"
            return f"period unknown: too few impacts ({self.count}; {needed})"
        if self.kind == "too short a run":
            return f"period unknown: less than four forcing periods of {self.forcing_period:.4g} s"
        if self.kind == "intermittent":
            return (
                "aperiodic (intermittent): impacting alternates with silence "
                f"of up to {self.longest_silence:.3g} s"
            )
        if self.kind == "aperiodic":
            return f"aperiodic: {self._nearest()}"
        assert self.impacts is not None
        assert self.repeat_period is not None
        number = f"{self.impacts} impact{'s' if self.impacts > 1 else ''}"
        if self.periods is not None:
            span = "per forcing period"
            if self.periods > 1:
                span = f"in {self.periods} forcing periods"
            return f"period({self.impacts},{self.periods}): {number} {span}"
        words = f"periodic: {number} every {_milliseconds(self.repeat_period)}"
        if self.kind == "periodic":
            return f"{words} (forcing period not given)"
        assert self.forcing_period is not None
        ratio = self.repeat_period / self.forcing_period
        return f"{words}, which is {ratio:.4g} forcing periods: check the forcing frequency"

    def _nearest(self) -> str:
        """Why the best of the candidates is none."""
        best = max(self.candidates, key=lambda candidate: candidate.score, default=None)
        if best is None or not best.impacts or best.score <= 0:
            return "the impacts do not recur"
        name = f"{best.impacts} in {_milliseconds(best.repeat_period)}"
        if best.periods is not None:
            name = f"period({best.impacts},{best.periods})"
        if max(best.missed, best.spurious) < 0.05:
            return f"nearest to {name}, but scattered by {_milliseconds(best.jitter)}"
        if best.missed > best.spurious:
            return f"nearest to {name}, but {best.missed:.0%} of the impacts due do not come"
        return f"nearest to {name}, but {best.spurious:.0%} of the impacts come at other times"

    def __str__(self) -> str:
        return self.describe()


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.4g} ms"
