"""Counting errors of an instrument: missed, shifted and spurious impacts."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..._arguments import Seed, number, pair, streams
from ..._showing import Shown
from ...errors import InvalidInput
from ...impacts import Impacts
from ..flows.course import OF_A_FLOW
from ..motion import Motion
from ._thresholding import Spikes, spikes

ECHO_STRENGTH = 0.5
"""Peak and impulse of an echo over those of its impact."""


@dataclass(frozen=True, eq=False, repr=False)
class Measured(Shown):
    """A measured train, together with the true one.

    Attributes
    ----------
    impacts : Impacts
        The measured train.
    truth : Impacts
        The true train.
    source : ndarray of int, shape (len(impacts),)
        Index of the true impact for each measured one; -1 for others (spurious spikes,
        echoes, and approaches that noise took for impacts).

    See Also
    --------
    measure, synthesize

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, measure
    >>> train = Impacts.from_times(0.05 * np.arange(1000))
    >>> found = measure(train, missed=0.02, seed=1)
    >>> len(found.truth) - len(found.impacts) == 1000 - len(found.source)
    True
    """

    impacts: Impacts
    truth: Impacts
    source: np.ndarray

    @property
    def spurious(self) -> np.ndarray:
        """Indices into `impacts` of the k spurious ones, ascending, shape (k,)."""
        return np.flatnonzero(self.source < 0)

    @property
    def missed(self) -> np.ndarray:
        """Indices into `truth` of the k missed impacts, ascending, shape (k,)."""
        seen = np.zeros(len(self.truth), bool)
        seen[self.source[self.source >= 0]] = True
        return np.flatnonzero(~seen)

    def __repr__(self) -> str:
        return (
            f"Measured({len(self.impacts)} impacts; {len(self.missed)} of {len(self.truth)} "
            f"missed, {len(self.spurious)} spurious)"
        )


def measure(
    impacts: Impacts | Motion,
    *,
    noise: float = 0.0,
    rate: float | None = None,
    jitter: float = 0.0,
    dead_time: float = 0.0,
    missed: float = 0.0,
    missed_weak: tuple[float, float] | None = None,
    spurious: float = 0.0,
    echoes: float = 0.0,
    echo_delay: float = 5e-3,
    seed: Seed = None,
) -> Measured:
    """Apply the counting errors of an instrument: noise, jitter, missed and spurious impacts.

    The effects are applied in this order: impacts are counted where the noisy displacement reaches
    a threshold; some are missed; the others are shifted by jitter and may be followed by echoes;
    spurious spikes are added; impacts within the dead time of another one are ignored. Every effect
    has its own random numbers for every impact, so that changing one effect does not change the
    others.

    Parameters
    ----------
    impacts : Impacts or Motion
        The truth.
    noise : float
        White Gaussian noise on the displacement before the threshold, as in [Karpodinis]_: its
        standard deviation as a fraction of that of the displacement relative to the stops over the
        run (the reference of the percentages in the thesis is not in the available text; this is
        our choice). With s the standard deviation of the noise, a spike is counted at the first
        sample above the threshold, which is 3 s plus half of the longest displacement between two
        samples short of the stop, and no further one until a sample was 11 s short of it. Instants
        are therefore early by the distance to the threshold divided by the velocity, several
        impacts in one excursion are one spike, and approaches that turn back just short of the stop
        are counted as well, with strengths 0. Requires a Motion.
    rate : float, optional
        Samples per second of the noisy displacement [Hz]; by default 2500 per forcing period (or
        natural period, without forcing), corresponding to 50 to 60 kS/s in the thesis.
    jitter : float
        Standard deviation of the Gaussian jitter of the instants [s]. An instant outside the run is
        set to its end.
    dead_time : float
        Impacts at most this long after one that was counted are ignored [s].
    missed : float
        Share of the impacts that are missed, whatever their strength, 0 to 1.
    missed_weak : (level, scale), optional
        Additional misses of weak impacts: an impact of strength s is missed with the probability
        ``1 / (1 + exp((s - level) / scale))``, half of those at `level`. The strength is the peak,
        or else the approach velocity or the impulse.
    spurious : float
        Expected number of spurious spikes, as a fraction of the number of impacts: a Poisson
        process over the run without its gaps. Each has the contact time, peak and impulse of a
        randomly chosen impact.
    echoes : float
        Probability that an impact is followed by an echo, 0 to 1; half as strong.
    echo_delay : float
        Time from an impact to its echo [s].
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result; a Generator is advanced.

    Returns
    -------
    Measured
        The measured train. Its `time_error` combines that of the truth, the jitter, and the RMS
        shift by the noise; its `probability` is the fraction of its spikes that are impacts.

    Raises
    ------
    InvalidInput
        If an argument is out of range, weak impacts are to be missed in a train without strengths,
        or noise is to be added where there is no displacement.

    See Also
    --------
    synthesize, match_impacts

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, measure
    >>> train = Impacts.from_times(0.05 * np.arange(1000))
    >>> measure(train, missed=0.02, spurious=0.01, seed=1)
    Measured(994 impacts; 17 of 1000 missed, 11 spurious)
    """
    noise = number("noise", noise, least=0)
    rate = None if rate is None else number("rate", rate, above=0)
    jitter = number("jitter", jitter, least=0, most=1e6)
    dead_time = number("dead_time", dead_time, least=0)
    missed = number("missed", missed, least=0, most=1)
    spurious = number("spurious", spurious, least=0, most=1e6)
    echoes = number("echoes", echoes, least=0, most=1)
    echo_delay = number("echo_delay", echo_delay, above=0)
    lost, weak, moved, echoing, false, noisy = streams(seed, 6)
    counted, impacts = _count(impacts, noise, rate, noisy)
    count = len(impacts)

    # First every impact, seen or not, then the approaches that were taken for one.
    time = np.concatenate((counted.of_impact, counted.spurious))
    which = np.concatenate((np.arange(count), np.full(len(counted.spurious), -1)))
    seen = (lost.random(len(time)) >= missed) & ~np.isnan(time)
    if missed_weak is not None:
        chance = _chance_of_missing(impacts, which, missed_weak)
        seen &= weak.random(len(time)) >= chance
    time = time + jitter * moved.standard_normal(len(time))
    echo = seen & (echoing.random(len(time)) < echoes)
    extra = false.poisson(spurious * count)
    instants = _uniform_instants(impacts, false.random(extra))
    lookalike = false.integers(count, size=extra) if count else np.empty(0, np.intp)

    time = np.concatenate((time[seen], time[echo] + echo_delay, instants))
    origin = np.concatenate((np.flatnonzero(seen), np.flatnonzero(echo), lookalike))
    strength = np.repeat((1.0, ECHO_STRENGTH, 1.0), (seen.sum(), echo.sum(), extra))
    source = np.concatenate((which[seen], np.full(echo.sum() + extra, -1)))

    late = (source < 0) & (time > impacts.stop)  # an echo after the end of the run
    order = np.argsort(time, kind="stable")
    order = order[~late[order]]
    time = np.clip(time[order], impacts.start, impacts.stop)
    if dead_time:
        alive = _outside_dead_time(time, dead_time)
        time, order = time[alive], order[alive]
    origin, source = origin[order], source[order]
    train = _like(impacts, which[origin], time, strength[order])
    at_stop = None
    if impacts.stop_index is not None:
        at_stop = np.concatenate((impacts.stop_index, counted.stop))[origin]
    early = counted.of_impact - impacts.time
    early = early[~np.isnan(early)]
    by_noise = math.sqrt(np.mean(early**2)) if len(early) else 0.0
    error = np.zeros(len(train)) if train.time_error is None else train.time_error
    error = np.sqrt(error**2 + jitter**2 + by_noise**2)
    true = np.full(len(train), np.mean(source >= 0) if len(source) else 1.0)
    train = replace(train, time_error=error, probability=true, stop_index=at_stop)
    if not len(train):
        train = replace(train, reason=impacts.reason or "all impacts were missed")
    source.flags.writeable = False
    return Measured(train, impacts, source)


def _count(
    given: Impacts | Motion, noise: float, rate: float | None, rng: np.random.Generator
) -> tuple[Spikes, Impacts]:
    """Instants before any is missed or shifted, and the true train."""
    truth = given.impacts if isinstance(given, Motion) else given
    if not isinstance(truth, Impacts):
        raise InvalidInput(
            "impacts",
            given,
            "Impacts or a Motion",
            f'Of a motion keep all: simulate(..., keep="all"). {OF_A_FLOW}',
        )
    if not noise:
        return Spikes(truth.time, np.empty(0), np.empty(0, np.intp)), truth
    if not isinstance(given, Motion):
        raise InvalidInput(
            "noise", noise, "a Motion to measure", "Impacts have no displacement to add it to"
        )
    return spikes(given, noise, rate, rng), truth


def _chance_of_missing(impacts: Impacts, which: np.ndarray, missed_weak: Any) -> np.ndarray:
    level, scale = pair("missed_weak", missed_weak, "a pair (level, scale)")
    level = number("missed_weak level", level)
    scale = number("missed_weak scale", scale, above=0)
    strength = strength_of(impacts)
    if strength is None:
        raise InvalidInput(
            "missed_weak", missed_weak, "impacts with a peak, an approach velocity or an impulse"
        )
    strength = np.append(strength, 0.0)[which]
    return 0.5 * (1.0 - np.tanh(0.5 * (strength - level) / scale))  # the logistic, never too great


def strength_of(impacts: Impacts) -> np.ndarray | None:
    """Peak, else approach velocity, else impulse of each impact; None if none is known."""
    known = (impacts.peak, impacts.approach_velocity, impacts.impulse)
    return next((strength for strength in known if strength is not None), None)


def _uniform_instants(impacts: Impacts, share: np.ndarray) -> np.ndarray:
    """Instants at these shares (0 to 1) of the run without its gaps."""
    gaps = np.clip(impacts.gaps[np.argsort(impacts.gaps[:, 0])], impacts.start, impacts.stop)
    length = gaps[:, 1] - gaps[:, 0]
    before = gaps[:, 0] - impacts.start - np.concatenate(([0.0], np.cumsum(length)))[:-1]
    valid = share * (impacts.duration - length.sum())
    passed = np.searchsorted(before, valid, side="right")
    return impacts.start + valid + np.concatenate(([0.0], np.cumsum(length)))[passed]


def _outside_dead_time(time: np.ndarray, dead_time: float) -> np.ndarray:
    """Mask of the impacts that come more than `dead_time` after the last one counted.

    An impact that long after any other is counted whatever was before it. So the train falls into
    clusters, and all clusters can be gone through at once.
    """
    kept = np.zeros(len(time), bool)
    cursor = np.flatnonzero(time > np.concatenate(([-np.inf], time[:-1] + dead_time)))
    end = np.append(cursor[1:], len(time))
    while len(cursor):
        kept[cursor] = True
        cursor = np.searchsorted(time, time[cursor] + dead_time, side="right")
        cursor, end = cursor[cursor < end], end[cursor < end]
    return kept


def _like(impacts: Impacts, like: np.ndarray, time: np.ndarray, strength: np.ndarray) -> Impacts:
    """Impacts at `time` with the columns of other impacts, `strength` times as strong.

    Every per-impact quantity has the length of the train; those in force are scaled. The impact
    -1 has no time in contact and no strength.
    """
    known: dict[str, Any] = {"time": time, "flags": np.append(impacts.flags, np.uint8(0))[like]}
    for item in fields(impacts):
        value = getattr(impacts, item.name)
        if item.name in known or not isinstance(value, np.ndarray) or item.name == "gaps":
            continue
        scaled = item.name in ("peak", "impulse", "approach_velocity")
        own = np.append(value, 0.0)[like]
        known[item.name] = own * strength if scaled else own
    return replace(impacts, **known)
