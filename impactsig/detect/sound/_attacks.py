"""Attacks of the impacts of a sound record, and their instants and standard errors.

This is the second pass over the record. Every attack is timed in the window that holds it; where
impacts sound alike their common waveform then gives the instants, where they share modes these do.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..signal.order_kernels import quantile
from ._attack_kernels import crests_after, measure
from ._beginnings import Beginnings
from ._choosing import Chosen, loudness_of
from ._clicks import BESIDE as CLICK
from ._clicks import lone_samples
from ._cores import window_size
from ._growth import Growth
from ._heard import Heard, unknown
from ._instant_kernels import put_at_most, put_errors, put_instants
from ._kernels import Scale
from ._scale import LAG_RATES, sound_lengths
from ._survey import Survey
from ._windows import Window
from .deciding.beside import PowersBeside
from .deciding.crest_kernels import LATER, SOONER
from .deciding.doubt import EVEN
from .deciding.gradual import EDGES as GRADUAL_EDGES
from .deciding.gradual import gradual_odds, most_odds_beside
from .deciding.overload import Overload
from .deciding.swells import EDGES as SWELL_EDGES
from .deciding.swells import crowds, most_odds, sharpness
from .timing.alike import Overlay
from .timing.shared_modes import SharedModes

BESIDE = 60e-3  # [s], beside a window in which attacks are timed
COARSE = 10e-3  # [s], before and after an instant that is only known to some 10 ms
RINGING = 0.84, 0.5  # quantile of the time from attack to clear sound, and fraction that is usual
FEW_MODES = 4.0  # whose waveforms are alike in any phases after a shift
CLEAR_OF_HUM = 6.6  # [neper of power], of impacts that need no filter to be timed


class Measured(NamedTuple):
    """Attacks, and what they and the first pass tell of the impacts."""

    attack: np.ndarray  # (n, 5), results of `measure`
    probability: np.ndarray  # by the first pass
    spread: np.ndarray  # of the instant by the first pass, where that is all there is [s]
    lone: np.ndarray  # whether there is an isolated sample
    sharp: np.ndarray  # abruptness e relative to swelling noise, and R; NaN where not asked for
    rise: np.ndarray
    gradual: np.ndarray  # log-odds that rises are sudden
    overload: np.ndarray  # greatest log-odds of what may be an edge of an overload

    def unless_swelling(self, rate: float) -> np.ndarray:
        """Probabilities of impacts, with what the attacks tell of gradual rises."""
        likely = self.probability >= EVEN
        in_order = np.maximum.accumulate(self.attack[:, 0]) / rate
        swelling = most_odds(in_order, likely, self.sharp, self.rise)
        gradual = most_odds_beside(in_order, self.gradual, likely)
        return at_most(at_most(self.probability, swelling), gradual)

    def unless_overloaded(self, likely: np.ndarray) -> np.ndarray:
        """Probabilities of impacts that are `likely` otherwise."""
        return at_most(likely, self.overload)


def at_most(probability: np.ndarray, odds: np.ndarray) -> np.ndarray:
    """The probabilities, but no more than those of some log-odds."""
    out = np.empty(len(probability))
    put_at_most(probability, odds, out)
    return out


class Attacks:
    """Collects the attacks of chosen impacts, window by window.

    `limits` are the least and the greatest sample of the record.
    """

    def __init__(
        self, survey: Survey, chosen: dict[int, Chosen], limits: tuple[float, float]
    ) -> None:
        scale, rate = survey.scale, survey.rate
        self.chosen, self.limits, self.scale, self.rate = chosen, limits, scale, rate
        # Innovations hear hum by the square of their lag, but a filter rings before loud impacts.
        loud = 4.0 * math.log(scale.short_lag * LAG_RATES[0] / rate)
        clear = survey.hum_crest + CLEAR_OF_HUM + loud
        before = survey.filter
        predicts = before is not None and before.predicts
        if not predicts and before is not None and loudness_of(survey, chosen) > clear:
            before = None
        self.filter = before
        # What is left of ringing shows where it begins, but not its modes; of few, any phase.
        self.comparable = before is None or before.modes > FEW_MODES
        self.more = math.ceil(BESIDE * rate / scale.hop) + survey.spoilt
        self.size = window_size(scale) // scale.hop  # frames of a window
        self.crowded = {at: crowds(one.frame * (scale.hop / rate)) for at, one in chosen.items()}
        self.lengths = sound_lengths(rate, scale)
        self.modes = SharedModes(rate, scale.short_lag, scale.slope)
        self.overlay = Overlay(self.lengths, unknown if predicts else self.modes.last)
        self.heard = Heard(self.lengths, limits, scale) if predicts else None
        self.growth = Growth(rate, self.lengths.before)
        self.beginnings = Beginnings(rate)
        self.overload = Overload(limits, survey.spectrum, scale, rate)
        lags = (scale.long_lag, scale.slope), (scale.short_lag, scale.slope)
        self.beside = PowersBeside(SWELL_EDGES, rate, lags[0], beyond=True)
        self.far_beside = PowersBeside(GRADUAL_EDGES, rate, lags[1], beyond=False)
        self.attack, self.lone = [np.empty((0, 5))], [np.empty(0, np.bool_)]

    def add(self, window: Window) -> None:
        """Time the attacks in the next window."""
        if window.segment not in self.chosen:
            return
        scale, rate = self.scale, self.rate
        passage, first = self.chosen[window.segment], window.first // scale.hop
        here = slice(*passage.frame.searchsorted((first, first + self.size)).tolist())
        if here.start == here.stop:
            return
        raw, core = window.beside(self.more * scale.hop)
        x = raw if self.filter is None else self.filter.of(raw)
        places = passage.frame[here] * scale.hop + (core - first * scale.hop)
        for k in passage.coarse[here].nonzero()[0].tolist():
            places[k] = greatest_rise(x, int(places[k]), scale, rate)
        attack, sounds = np.empty((len(places), 5)), np.empty((len(places), self.lengths.length))
        measure(x, places, self.limits, scale, attack, sounds)
        at, lone = attack[:, 0].copy(), np.empty(len(places), np.bool_)
        if self.filter is not None:
            crests = np.empty((len(places), 2))
            crests_after(raw, at, self.limits, scale, crests)
            attack[:, 2] = crests[:, 1]
            if self.heard is not None:
                attack[:, 1] = crests[:, 0]
        lone_samples(raw, at, round(CLICK * rate), scale.reach, lone)
        self.beside.add(x, at, self.crowded[window.segment][here])
        self.far_beside.add(x, at, np.isfinite(passage.steady[here]))
        self.overload.add(raw, at, passage.may_be_edge[here])
        if self.heard is None:
            self.modes.add(x, at)
        else:
            self.heard.add(raw, places, at)
        if self.comparable:
            self.overlay.add(sounds, np.sqrt(attack[:, 3]))
        self.growth.add(sounds, passage.probability[here] >= EVEN)
        self.beginnings.add(x, at)
        np.add(at, window.segment + window.first - core, out=attack[:, 0])
        self.attack.append(attack)
        self.lone.append(lone)

    def measured(self) -> Measured:
        """The attacks of all windows."""
        none, every = np.empty(0), self.chosen.values()
        steady = np.concatenate([none, *(one.steady for one in every)])
        return Measured(
            np.concatenate(self.attack),
            np.concatenate([none, *(one.probability for one in every)]),
            np.concatenate([none, *(one.spread for one in every)]),
            np.concatenate(self.lone),
            *sharpness(self.beside.powers(), self.rate),
            gradual_odds(steady, self.far_beside.powers(), self.far_beside.edges),
            self.overload.odds(),
        )

    def instants(
        self, measured: Measured, likely: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Instants and their standard errors [samples], and which are by the common waveform.

        `likely` are the probabilities of impacts.
        """
        attack, reach = measured.attack, self.scale.reach
        count = len(attack)
        by_modes = self.modes.timing() if self.heard is None else unknown(count)
        by_wave = self.overlay.timing() if self.comparable else unknown(count)
        if self.heard is not None:
            heard = self.heard.timing(np.sqrt(attack[:, 3]))
            if np.isfinite(heard).any():
                by_wave = heard
        instant, shift, error = np.empty((3, count))
        alike, lengths = np.empty(count, np.bool_), self.lengths
        limits = lengths.agree, float(lengths.far)
        put_instants(attack, by_modes, by_wave, *limits, shift, instant, alike)
        early = self.beginnings.spread(instant - attack[:, 0], (likely >= EVEN) & ~alike)
        usual = RINGING[1] * quantile(attack[:, 4].copy(), RINGING[0])
        of_each = self.rate * measured.spread, early, likely
        known = self.growth.spread(), usual, reach
        put_errors(attack, instant, by_modes, by_wave, alike, *of_each, *known, error)
        return instant, error, alike


def greatest_rise(x: np.ndarray, place: int, scale: Scale, rate: float) -> int:
    """Frame near `place` at which the power rises most within COARSE."""
    half = round(COARSE * rate)
    edge = scale.spacing * scale.hop
    low = max(place - round(SOONER * rate) + edge, half)
    high = min(place + round(LATER * rate) - edge, len(x) - half)
    if low >= high:
        return place
    near = x[low - half : high + half].astype(float)
    total = np.concatenate(([0.0], np.cumsum((near - near.mean()) ** 2)))
    sums = total[half:] - total[:-half]
    least = np.finfo(float).eps * total[-1]
    rise = (sums[half:] + least) / (sums[:-half] + least)
    split = low + int(np.argmax(rise[: high - low]))
    return split - split % scale.hop
