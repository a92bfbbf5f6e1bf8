"""Result of `identify_period`: the kind of motion, in numbers and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from .._showing import Shown

Kind = Literal[
    "periodic",
    "drifting",
    "quasi-periodic",
    "banded",
    "chaotic",
    "irregular",
    "unlocked",
    "too few impacts",
    "too short a run",
]
LEAST_IMPACTS = 8
SURE = 0.95  # probability from which on an answer is given without "probably"
MISSED_NAMED = 0.28  # share of the impacts due from which on it is named that they did not come
BAND_NAMED = 0.01  # [forcing periods] from which on a band that may be hidden is named


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
class SpeedDrift(Shown):
    """Drift of the forcing speed through the run, estimated from the impacts.

    Attributes
    ----------
    time : ndarray, shape (k,)
        [s].
    speed : ndarray, shape (k,)
        Speed relative to its mean over the run, minus 1.
    log_odds : float
        Logarithm of the odds of a changing against a constant speed.
    tone : float or None
        If the change is a single slow modulation, its frequency per forcing period. Without a
        forcing channel it cannot be distinguished from a modulation of the impacts.

    See Also
    --------
    identify_period, results.Periodicity

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, identify_period
    >>> turns = np.arange(400.0)
    >>> train = Impacts.from_times(0.05 * turns * (1 + 1e-4 * turns))
    >>> drift = identify_period(train, forcing_period=0.05).drift
    >>> round(drift.range, 2)
    0.07
    """

    time: np.ndarray
    speed: np.ndarray
    log_odds: float
    tone: float | None = None

    @property
    def range(self) -> float:
        """Difference between the greatest and the least speed, relative to the mean."""
        return float(np.ptp(self.speed))


@dataclass(frozen=True, eq=False)
class Periodicity(Shown):
    """The kind of motion that a train shows, with the evidence.

    Attributes
    ----------
    kind : str
        The motion: "periodic"; "drifting" (periodic, while the speed of the forcing changes);
        "quasi-periodic" (a second frequency modulates the phase); "banded" (chaos in narrow bands
        about the phases of a period); "chaotic" (no period, but impacts that are locked to phases
        of the forcing, or intervals that predict the next); "irregular" (neither); "unlocked"
        (periodic, but not in multiples of the forcing period given); "too few impacts"; "too short
        a run" (of less than four forcing periods).
    probability : mapping of str to float
        Probabilities of "periodic", "drifting", "quasi-periodic", "banded", "chaotic" and
        "irregular"; all 0 if the data do not decide. "banded" includes bands that are hidden by the
        jitter, so that a periodic motion with jitter has odds near 1 against it.
    confidence : float
        Probability of the answer that `describe` gives in words.
    impacts, periods : int or None
        m and n of period(m, n): m impacts in n forcing periods, also of the period that a
        quasi-periodic or banded motion stays near. `periods` is None where the forcing period is
        not known or the repeat period is no multiple of it; both are None where there is no period.
    count : int
        Number of impacts analysed.
    forcing_period : float or None
        The forcing period [s]: as given, or, if the motion is locked to it, its mean over the run
        in the clock of the recording.
    repeat_period : float or None
        The time after which the motion recurs [s].
    phases : ndarray, shape (m,)
        Phases of the impacts as fractions of the repeat period, the first at 0.
    jitter : float or None
        Standard deviation of the impacts about their phases [s].
    missed, spurious : float or None
        Fraction of the expected impacts that are missing; fraction of the impacts that were not
        expected.
    satellites, satellite_delay : float or None
        Fraction of the impacts that are followed by a second one at a fixed delay, as by an echo,
        and this delay [s].
    drift : SpeedDrift or None
        The forcing speed through the run, if there is a period and no forcing channel was given.
    tone, tone_rms : float or None
        Frequency [1/forcing period] and size [s] of the modulation of a quasi-periodic motion.
    banded_below : float or None
        RMS width [s] up to which bands of chaos may be hidden by the jitter.
    longest_silence : float
        The longest interval [s].
    intermittent : bool
        Whether at least a tenth of the time consists of intervals that are four times longer than
        nine in ten of the others.
    candidates : tuple of Candidate
        The periods that were tried.

    See Also
    --------
    identify_period, results.PeriodTrack

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, identify_period
    >>> train = Impacts.from_times(0.1 * np.arange(60) + 0.03 * (np.arange(60) % 2))
    >>> found = identify_period(train, forcing_period=0.1)
    >>> found.kind, found.impacts, found.periods, found.phases.round(3)
    ('periodic', 2, 2, array([0.  , 0.35]))
    """

    kind: Kind
    probability: Mapping[str, float]
    confidence: float
    impacts: int | None
    periods: int | None
    count: int
    forcing_period: float | None = None
    repeat_period: float | None = None
    phases: np.ndarray = field(default_factory=lambda: np.empty(0))
    jitter: float | None = None
    missed: float | None = None
    spurious: float | None = None
    satellites: float | None = None
    satellite_delay: float | None = None
    drift: SpeedDrift | None = None
    tone: float | None = None
    tone_rms: float | None = None
    banded_below: float | None = None
    longest_silence: float = 0.0
    intermittent: bool = False
    candidates: tuple[Candidate, ...] = ()

    @property
    def recurs(self) -> bool:
        """Whether the motion has a period, even if the forcing speed drifts."""
        return self.kind in ("periodic", "drifting", "unlocked")

    @property
    def aperiodic(self) -> bool:
        """Whether there are enough impacts to decide, and the motion has no period."""
        return self.kind in ("quasi-periodic", "banded", "chaotic", "irregular")

    @property
    def name(self) -> str:
        """The period(m, n) of the motion, or the one it stays near; empty if there is none."""
        if self.impacts is None:
            return ""
        if self.periods is not None:
            return f"period({self.impacts},{self.periods})"
        assert self.repeat_period is not None
        return f"{_impacts(self.impacts)} every {_milliseconds(self.repeat_period)}"

    def describe(self) -> str:
        """Describe the result in words."""
        if self.kind == "too few impacts":
            needed = f"{LEAST_IMPACTS} or more at different instants are needed"
            return f"period unknown: too few impacts ({self.count}; {needed})"
        if self.kind == "too short a run":
            return f"period unknown: less than four forcing periods of {self.forcing_period:.4g} s"
        return self._aperiodic() if self.aperiodic else self._periodic()

    def _aperiodic(self) -> str:
        words = {
            "quasi-periodic": "quasi-periodic",
            "banded": "banded chaos",
            "chaotic": "chaotic",
            "irregular": "irregular",
        }[self.kind]
        if self.confidence < SURE:
            either = self.probability["chaotic"] + self.probability["irregular"]
            if self.kind in ("chaotic", "irregular"):
                words = "chaotic or irregular"
            if either < SURE:
                words = f"probably {words}"
        words = f"aperiodic ({words})"
        if self.kind == "quasi-periodic":
            assert self.tone is not None
            assert self.tone_rms is not None
            cycle = "forcing period" if self.periods is not None else "repeat"
            words += (
                f": near {self.name}, modulated by {_milliseconds(self.tone_rms)} rms at "
                f"{self.tone:.4g} per {cycle}"
            )
        elif self.kind == "banded":
            assert self.jitter is not None
            words += f": near {self.name}, scattered by {_milliseconds(self.jitter)}"
        elif not self.intermittent:
            words += ": the impacts do not recur"
        if self.intermittent:
            words += (
                ": impacting alternates with silence "
                f"of up to {self.longest_silence:.3g} s (intermittent)"
            )
        return words

    def _periodic(self) -> str:
        assert self.impacts is not None
        assert self.repeat_period is not None
        number = _impacts(self.impacts)
        if self.periods is not None:
            span = "per forcing period"
            if self.periods > 1:
                span = f"in {self.periods} forcing periods"
            words = f"{self.name}: {number} {span}"
        else:
            words = f"periodic: {self.name}"
            if self.kind == "unlocked":
                assert self.forcing_period is not None
                ratio = self.repeat_period / self.forcing_period
                return f"{words}, which is {ratio:.4g} forcing periods: check the forcing frequency"
            words += " (forcing period not given)"
        return words + self._besides()

    def _besides(self) -> str:
        """Further properties of a periodic motion in words: drift, missed impacts, bands."""
        words = ""
        if self.kind == "drifting":
            assert self.drift is not None
            likely = "drifts" if self.confidence >= SURE else "probably drifts"
            words += f"; the speed {likely} by {100 * self.drift.range:.2g} %"
            if self.drift.tone is not None:
                words += (
                    f", or the impacts are modulated at {self.drift.tone:.2g} per period "
                    "(a forcing channel would tell)"
                )
        if self.missed is not None and self.missed > MISSED_NAMED:
            words += f"; {self.missed:.0%} of the impacts due are left out at random"
        unit = self.forcing_period or self.repeat_period
        if self.banded_below is not None and unit and self.banded_below >= BAND_NAMED * unit:
            words += f", or banded below {100 * self.banded_below / unit:.2g} % of the period"
        if self.satellites is not None and self.satellite_delay is not None:
            words += (
                f"; {self.satellites:.0%} of the impacts have a satellite "
                f"{_milliseconds(self.satellite_delay)} later"
            )
        return words


def _impacts(number: int) -> str:
    return f"{number} impact{'s' if number > 1 else ''}"


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.4g} ms"
