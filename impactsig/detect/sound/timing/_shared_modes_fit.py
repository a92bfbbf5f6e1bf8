"""Fit of modes that start behind a filter to sounds, and what makes sounds most probable.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from .._nearby import middle
from ._edge import PARTS, columns_of
from ._fit_kernels import Fit, begin_each, fit_each
from ._mode_basis_kernels import ROWS_AT_ONCE, leave_and_change, orthonormal, project
from ._shift_kernels import NOTHING, leave, most_probable, place, weigh

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
_NONE = np.empty((0, 3, 0))  # projections
OWN = 0.75  # of the misfit of others along the change by a shift, that counts for a sound


@dataclass
class Projected:
    """Sounds on the modes of a model: at whole shifts, and at fine ones about an origin."""

    sounds: np.ndarray
    which: np.ndarray  # of them, that hold all that a fit needs; what follows is of these
    first: np.ndarray  # sample that the first whole shift puts at the start of a fit
    energy: np.ndarray
    whole: np.ndarray  # (sounds, 3, shifts); no shifts if origins are given
    there: np.ndarray  # of these, that have an origin; what follows is of them
    begins: np.ndarray  # sample that the fine shifts count from
    energy_there: np.ndarray
    fine: np.ndarray  # (sounds, 3, shifts)
    grams: np.ndarray  # of these shifts

    def loudest(self, most: int) -> Projected:
        """The loudest of the sounds that have an origin, on the same modes about it."""
        loud = np.sort(np.argsort(-self.energy_there, kind="stable")[:most])
        there, energy = self.there[loud], self.energy_there[loud]
        which, first, begins = self.which[there], self.first[there], self.begins[loud]
        origins = np.arange(len(loud)), begins, energy, self.fine[loud], self.grams
        return Projected(self.sounds, which, first, self.energy[there], _NONE, *origins)


@dataclass
class Model:
    """Modes that start behind a filter, at shifts of 1 / PARTS samples about 0."""

    lead: int  # samples of a fit before its origin
    freedom: float  # degrees of it in noise that Q leaves
    near: int  # shifts on either side that a fit tries
    reach: int  # samples on either side that its origin is looked for in
    columns: np.ndarray  # result of `columns_of`, from `lead` + `reach` before
    noise: float = 0.0  # power of a sample
    prior: tuple[float, float] = (FIRST_PRIOR, FIRST_PRIOR * SLOPE_PRIOR)
    error: float = FIRST_ERROR
    evidence: float = -np.inf  # per sound, logarithmic
    misfit: float = 0.0  # as `error`, of a sound along its change by a shift

    @functools.cached_property
    def whole(self) -> tuple[np.ndarray, np.ndarray]:
        """Basis and Gram elements at whole samples."""
        return self._at(PARTS * np.arange(-self.reach, self.reach + 1))

    @functools.cached_property
    def fine(self) -> tuple[np.ndarray, np.ndarray]:
        """The same at the shifts that a fit tries."""
        return self._at(np.arange(-self.near, self.near + 1))

    @functools.cached_property
    def close(self) -> tuple[np.ndarray, np.ndarray]:
        """The same at those by which models learn and are compared."""
        most = PARTS * CLOSE
        return self._at(np.arange(-most, most + 1)) if most < self.near else self.fine

    def _at(self, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of Q' and K' at each shift, (shifts, rows, samples), behind rows of zeros.

        With the diagonal of K'K and what lies beside it, (3, shifts).
        """
        size = self.columns.shape[1] // PARTS - 2 * self.reach
        rows = -(-len(self.columns) // ROWS_AT_ONCE) * ROWS_AT_ONCE
        basis, grams = np.empty((len(shift), rows, size)), np.empty((3, len(shift)))
        modes, begin = len(self.columns) - 2, PARTS * self.reach
        orthonormal(self.columns, modes, PARTS, begin, shift, basis, grams)
        return basis, grams

    def fit(
        self, sounds: np.ndarray, guess: np.ndarray, begins: np.ndarray | None = None
    ) -> np.ndarray:
        """Instant, standard error [samples] and residual fraction of each sound; NaN if cut off.

        The share is that beyond noise. Instants count from so many samples before a sound `begins`.
        """
        fits = np.empty((len(guess), 3))
        begins = np.zeros(len(guess), np.int64) if begins is None else begins
        fit_each(sounds, begins, guess, self._fit, fits)
        return fits

    @property
    def _fit(self) -> Fit:
        """Of a model that is learned, for the kernel."""
        return Fit(
            self.lead,
            self._coarse,
            self.whole[1],
            *self.fine,
            1.0 / PARTS,
            (self.noise, self.error),
            self.misfit,
            self.freedom,
            self.prior,
        )

    @functools.cached_property
    def _coarse(self) -> np.ndarray:
        """The basis at whole samples, in single precision."""
        return self.whole[0].astype(np.float32)

    @property
    def width(self) -> int:
        """Samples that a fit may need."""
        return self.whole[0].shape[2] + 2 * self.reach

    def begins(self, guess: np.ndarray, length: int) -> np.ndarray:
        """The first sample of each sound that a fit may need; -1 if these are not all there."""
        begins = np.empty(len(guess), np.int64)
        begin_each(guess, self.lead + self.reach, length - self.width, begins)
        return begins

    def _first(self, guess: np.ndarray) -> np.ndarray:
        """Sample of each sound at which a fit at its guess begins."""
        known = np.where(np.isfinite(guess), guess, -1e6)
        return np.asarray(np.floor(known + 0.5).astype(np.int64) - self.lead)

    def projected(self, sounds: np.ndarray, guess: np.ndarray) -> Projected:
        """Sounds that start near a guess, for any prior and error."""
        basis = self._coarse
        reach, size = len(basis) // 2, basis.shape[2]
        first = self._first(guess)
        which = np.flatnonzero((first >= reach) & (first + reach + size <= sounds.shape[1]))
        first = first[which]
        energy, whole = _projections(sounds, which, first, basis)
        nowhere = np.empty(0, np.int64)
        later = nowhere, nowhere, np.empty(0), _NONE, _NONE
        return Projected(sounds, which, first, energy, whole, *later)

    def projected_there(self, held: Projected) -> Projected:
        """Sounds that have an origin by another model, for a fit about the same."""
        basis, grams = self.close
        which = held.which[held.there]
        energy, fine = _projections(held.sounds, which, held.begins, basis)
        origins = np.arange(len(which)), held.begins, energy, fine, grams
        return Projected(held.sounds, which, held.first[held.there], energy, _NONE, *origins)

    def median_left(self, held: Projected) -> float:
        """Fraction of the energy that the model leaves in the median; infinite if it fits none."""
        energy, fine = self._near(held)
        if not len(energy):
            return np.inf
        left, floor = np.empty(len(energy)), (self.noise, self.error)
        leave(fine, energy, held.grams, floor, self.freedom, self.prior, left)
        return middle(left - self.freedom * self.noise / energy)

    def median_left_at_samples(self, held: Projected) -> float:
        """About the same, if all start at whole samples, before anything is learned."""
        some = held.energy > NOTHING * self.noise
        energy, left = held.energy[some], np.empty(np.count_nonzero(some))
        floor = self.noise, FIRST_ERROR
        leave(held.whole[some], energy, self.whole[1], floor, np.inf, self.prior, left)
        return middle(left - self.freedom * self.noise / energy) if len(left) else np.inf

    def learn(self, held: Projected, least: float, beaten: float = -np.inf) -> None:
        """Set the prior and the error that make the sounds most probable.

        The prior that it has, which is the first one tried, has to do where no other one can come
        up to an evidence of `beaten`.
        """
        begin, priors = PRIORS.index(self.prior[0]), BOTH_PRIORS
        if not self.columns[-1].any():  # without a filter all are the same
            begin, priors = 0, BOTH_PRIORS[:1]
        self.evidence = -np.inf
        energy, fine = self._near(held)
        if len(energy) < LEAST:
            return
        self.evidence, impulse, self.error = most_probable(
            fine,
            energy,
            held.grams,
            1.0 / PARTS,
            self.noise,
            self.freedom,
            priors,
            begin,
            FIRST_ERROR,
            least,
            beaten - BY_PRIOR,
        )
        self.prior = impulse, impulse * SLOPE_PRIOR

    def compare(self, held: Projected, most: float) -> float:
        """Set the misfit, from some sounds of which no more than a fraction of `most` is left.

        Its ratio to what the model leaves in a sample, with the noise, is returned.

        What a model leaves lies in few directions, and one of them may be that in which a shift
        changes a sound. A fit has taken this part off the sound, but not off others: the misfit
        is OWN times the mean square of a component of a sound in this direction for all others,
        noise apart, in the median of the sounds.
        """
        energy, fine = self._near(held)
        some = slice(None, None, max(-(-len(energy) // COMPARED), 1))
        there, origin = held.there[some], held.begins[some]
        energy, fine = energy[some].copy(), fine[some].copy()  # one layout for the kernel
        out, floor = np.empty((len(there), 3)), (self.noise, self.error)
        weigh(fine, energy, held.grams, 1.0 / PARTS, floor, self.freedom, self.prior, out)
        own = self.noise / energy
        alike = np.flatnonzero(out[:, 2] - self.freedom * own <= most)
        if len(alike) < LEAST:
            return 0.0
        own, which = own[alike], held.which[there[alike]]
        left, change = np.empty((2, len(alike), self.close[0].shape[2]))
        leave_and_change(
            held.sounds,
            which,
            origin[alike],
            PARTS * out[alike, 0],
            own + self.error,
            self.prior,
            *self.close,
            left,
            change,
        )
        squares = (change @ left.T) ** 2 - own
        others = np.sum(squares, axis=0) - np.diag(squares)
        self.misfit = OWN * middle(others) / (len(own) - 1)
        return self.misfit / (middle(own) + self.error)

    def _near(self, held: Projected) -> tuple[np.ndarray, np.ndarray]:
        """Energy and fine projections of the sounds that start somewhere.

        The first time, fits begin at the sample that puts the most probable start at its origin.
        """
        if held.fine.shape[2]:
            return held.energy_there, held.fine
        basis, gram = self.whole
        shift, beyond = np.empty(len(held.energy), np.int64), np.empty(len(held.energy))
        floor = self.noise, self.error
        place(held.whole, held.energy, gram, self.near // PARTS, floor, self.prior, shift, beyond)
        held.there = np.flatnonzero(shift >= 0)
        held.begins = (held.first + shift)[held.there] - len(basis) // 2
        basis, held.grams = self.close
        held.energy_there, held.fine = _projections(
            held.sounds, held.which[held.there], held.begins, basis
        )
        return held.energy_there, held.fine


def _projections(
    sounds: np.ndarray, which: np.ndarray, first: np.ndarray, basis: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    energy, projections = np.empty(len(which)), np.empty((len(which), 3, len(basis)))
    project(sounds, which, first, basis, energy, projections)
    return energy, projections


def modes_behind(
    exponents: np.ndarray,
    response: np.ndarray | None,
    taps: np.ndarray,
    rate: float,
    heard: float,
) -> Model:
    """The model of modes with these exponents behind a filter and that of `taps`.

    `heard` is the fraction of white noise that passes the high-pass filter.
    """
    lead, after = (round(t * rate) for t in FIT)
    reach = int(np.ceil(REACH * rate))
    columns = columns_of(exponents, response, taps, -lead - reach, after + reach)
    freedom = max(heard * (lead + after) - (len(columns) - 2), 1.0)
    return Model(lead, freedom, round(NEAR * rate * PARTS), reach, columns)
