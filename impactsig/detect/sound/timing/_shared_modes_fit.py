"""Fit of modes that start behind a filter to sounds, and what makes sounds most probable.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from .._nearby import middle
from ._candidate_kernels import (
    Fine,
    Part,
    Starts,
    about,
    begin_each,
    degrees,
    evidence_of,
    fine_places,
    start_each,
)
from ._edge_kernels import PARTS, REAL, step_modes
from ._fit_kernels import Fit, fit_each, put_fits, seek_each
from ._misfit_kernels import misfit
from ._mode_basis_kernels import Basis, factor
from ._shift_kernels import Search, Shifts, leave, most_probable

FIT = (1.5e-3, 3e-3)  # [s] before and after the instant
REACH = 0.8e-3  # [s], by which the guess may be off
NEAR = 0.3e-3  # [s], by which the first fit may be off
CLOSE = 3  # samples on either side of the origin by which models learn and are compared
LEAST = 8  # sounds that a model is learned from
PRIORS = (1e-2, 3e-3, 1e-3, 4e-4, 2e-4)  # variance of the impulse, over the energy
BY_PRIOR = float(np.log(PRIORS[0] / PRIORS[-1])) + 1.0  # most that another prior gains
SLOPE_PRIOR = (1.5 * np.pi) ** -2  # that of its slope, for a mode at 1.5 times half the rate
BOTH_PRIORS = np.outer(PRIORS, (1.0, SLOPE_PRIOR))
FIRST_PRIOR = 1e-3
FIRST_ERROR = 1e-4  # of a sample, relative to the energy, noise apart
COMPARED = 32  # sounds whose misfits are compared
OWN = 0.75  # of the misfit of others along the change by a shift, that counts for a sound


@dataclass
class Model:
    """Modes that start behind a filter, at shifts of 1 / PARTS samples about 0."""

    exponents: np.ndarray
    response: np.ndarray  # of the filter; empty if there is none
    part: Part
    reach: int  # samples on either side that an origin is looked for in
    noise: float  # power of a sample
    prior: tuple[float, float] = (FIRST_PRIOR, FIRST_PRIOR * SLOPE_PRIOR)
    error: float = FIRST_ERROR
    evidence: float = -np.inf  # per sound, logarithmic
    misfit: float = 0.0  # as `error`, of a sound along its change by a shift

    @functools.cached_property
    def columns(self) -> tuple[int, np.ndarray]:
        """Result of `step_modes` for what is fitted, and as much as it may be off."""
        part, reach = self.part, self.reach
        ends = -part.lead - reach, part.after + reach
        modes, columns = step_modes(self.exponents, self.response, part.taps, *ends)
        return modes, columns

    @functools.cached_property
    def freedom(self) -> float:
        """Degrees of freedom that the modes leave."""
        modes = len(self.exponents) + np.count_nonzero(self.exponents.imag > REAL)
        return float(degrees(self.part, modes))

    @functools.cached_property
    def whole(self) -> Basis:
        """Basis at whole shifts."""
        return self._at(PARTS * np.arange(2 * self.reach, -1, -1))

    @functools.cached_property
    def fine(self) -> Basis:
        """That at the shifts that a fit tries."""
        return self._at(fine_places(self.reach, self.part.near))

    def _at(self, places: np.ndarray) -> Basis:
        modes, columns = self.columns
        return factor(columns, modes, places, self.part.lead + self.part.after)

    def fit(self, sounds: np.ndarray, guess: np.ndarray, begins: np.ndarray) -> np.ndarray:
        """Instant, standard error [samples] and residual fraction of each sound; NaN if cut off.

        The share is that beyond noise. Instants count from so many samples before a sound `begins`.
        """
        return self._fits(self._found(sounds, begins, *self._origins(sounds, guess, begins)))

    def fit_first(
        self, sounds: np.ndarray, guess: np.ndarray, starts: Starts | None, most: float
    ) -> np.ndarray:
        """The same of the first sounds, of which all that start somewhere may be known.

        By those of which at most a fraction of `most` is left it learns the misfit.
        """
        begins = np.zeros(len(sounds), np.int64)
        if starts is None or len(starts.sounds) < len(sounds):
            origin, beyond = self._origins(sounds, guess, begins)
        else:
            origin, beyond = np.full(len(sounds), -1), np.zeros(len(sounds))
            origin[starts.which], beyond[starts.which] = starts.begins, starts.beyond
        found = self._found(sounds, begins, origin, beyond)
        self._compare(sounds, found, most)
        return self._fits(found)

    def _origins(
        self, sounds: np.ndarray, guess: np.ndarray, begins: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Result of `seek_each`."""
        origin, beyond = np.empty(len(guess), np.int64), np.empty(len(guess))
        near = self.part.near // PARTS
        seek_each(sounds, begins, guess, self.whole, near, self._fit, origin, beyond)
        return origin, beyond

    def _found(
        self, sounds: np.ndarray, begins: np.ndarray, origin: np.ndarray, beyond: np.ndarray
    ) -> np.ndarray:
        """Result of `fit_each`."""
        found, fine = np.empty((len(origin), 5)), self.fine
        shifts = Shifts(fine.grams, 1.0 / PARTS, self.freedom)
        fit_each(sounds, begins, origin, beyond, fine, shifts, self._fit, found)
        return found

    @property
    def _fit(self) -> Fit:
        return Fit(self.part.lead, (self.noise, self.error), self.prior)

    def _fits(self, found: np.ndarray) -> np.ndarray:
        fits = np.empty((len(found), 3))
        put_fits(found, self.error, self.misfit, fits)
        return fits

    def _compare(self, sounds: np.ndarray, found: np.ndarray, most: float) -> None:
        """Set the misfit, from some sounds of which no more than a fraction of `most` is left.

        What a model leaves lies in few directions, and one of them may be that in which a shift
        changes a sound. A fit has taken this part off the sound, but not off others: the misfit
        is OWN times the mean square of a component of a sound in this direction for all others,
        noise apart, in the median of the sounds.
        """
        step = max(-(-len(found) // COMPARED), 1)
        given = self.part.lead, self.fine, self.error, self.prior
        known = misfit(sounds, found, *given, step, most, LEAST)
        if math.isfinite(known):
            self.misfit = OWN * known

    @property
    def width(self) -> int:
        """Samples that a fit may need."""
        return self.part.lead + self.part.after + 2 * self.reach

    def begins(self, guess: np.ndarray, length: int) -> np.ndarray:
        """The first sample of each sound that a fit may need; -1 if these are not all there."""
        begins = np.empty(len(guess), np.int64)
        begin_each(guess, self.part.lead + self.reach, length - self.width, begins)
        return begins

    def starts(self, sounds: np.ndarray, guess: np.ndarray, most: int) -> tuple[float, Fine]:
        """So many of the loudest sounds that start near a guess, about their origins.

        And what it leaves of them, as `left`, if all started at whole samples.
        """
        given = self.exponents, self.response, self.part, self.reach, sounds, guess, most
        left, held = start_each(*given, self.noise, self.prior, self.error)
        return left, held

    def about(self, starts: Starts) -> Fine:
        """Sounds about origins that another model has found."""
        held: Fine = about(self.exponents, self.response, self.part, starts)
        return held

    def left(self, held: Fine) -> float:
        """Fraction of the energy that the model leaves in the median; infinite if it fits none."""
        energy, floor = held.energy, (self.noise, self.error)
        if not len(energy):
            return np.inf
        left, (grams, _, freedom) = np.empty(len(energy)), held.shifts
        leave(held.projections, energy, grams, floor, freedom, self.prior, left)
        return middle(left - freedom * self.noise / energy)

    def learn(self, held: Fine, least: float) -> None:
        """Set the prior and the error that make the sounds most probable."""
        if len(held.energy) >= LEAST:
            given = held.projections, held.energy, held.shifts, self.noise
            self._learned(most_probable(*given, self._search(least)))

    def learn_from(self, starts: Starts, least: float, beaten: float = -np.inf) -> None:
        """The same from sounds about their origins.

        The prior that it has, which is the first one tried, has to do where no other one can come
        up to an evidence of `beaten`.
        """
        if len(starts.which) >= LEAST:
            search = self._search(least, beaten - BY_PRIOR)
            given = self.exponents, self.response, self.part, starts, self.noise, search
            self._learned(evidence_of(*given))

    def _search(self, least: float, enough: float = -np.inf) -> Search:
        """Of the prior and the error."""
        if len(self.response):
            return Search(BOTH_PRIORS, PRIORS.index(self.prior[0]), FIRST_ERROR, least, enough)
        return Search(BOTH_PRIORS[:1], 0, FIRST_ERROR, least, enough)  # all are the same

    def _learned(self, found: tuple[float, float, float]) -> None:
        self.evidence, impulse, self.error = found
        self.prior = impulse, impulse * SLOPE_PRIOR


class Behind:
    """Makes models of sounds that have passed the filter of `taps`.

    `heard` is the fraction of white noise that passes the high-pass filter, `noise` its power.
    """

    def __init__(self, taps: np.ndarray, heard: float, rate: float, noise: float) -> None:
        lead, after = (round(t * rate) for t in FIT)
        near, self.rate = round(NEAR * rate * PARTS), rate
        self._part = Part(taps, heard, lead, after, near, min(PARTS * CLOSE, near))
        self._reach, self._noise = int(np.ceil(REACH * rate)), noise

    def __call__(self, exponents: np.ndarray, response: np.ndarray) -> Model:
        """Modes with these exponents behind a filter with this response."""
        return Model(exponents, response, self._part, self._reach, self._noise)
