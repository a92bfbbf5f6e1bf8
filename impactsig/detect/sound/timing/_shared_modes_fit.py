"""Fit of modes that start behind a filter to sounds, and what makes sounds most probable.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from .._nearby import middle
from ._edge import PARTS, step_modes
from ._mode_basis_kernels import ROWS_AT_ONCE, orthonormal, project
from ._shift_kernels import NOTHING, leave, most_probable, place, weigh

FIT = (1.5e-3, 3e-3)  # [s] before and after the instant
REACH = 0.8e-3  # [s], by which the guess may be off
NEAR = 0.3e-3  # [s], by which the first fit may be off
LEAST = 8  # sounds that a model is learned from
PRIORS = (1e-2, 3e-3, 1e-3, 4e-4)  # variance of the impulse, over the energy
BY_PRIOR = float(np.log(PRIORS[0] / PRIORS[-1])) + 1.0  # most that another prior gains
SLOPE_PRIOR = (1.5 * np.pi) ** -2  # that of its slope, for a mode at 1.5 times half the rate
BOTH_PRIORS = np.outer(PRIORS, (1.0, SLOPE_PRIOR))
FIRST_PRIOR = 1e-3
FIRST_ERROR = 1e-4  # of a sample, relative to the energy, noise apart
COMPARED = 32  # sounds whose misfits are compared
OWN = 0.75  # of the misfit of others along the change by a shift, that counts for a sound


@dataclass
class Projected:
    """Sounds on the modes of a model: at whole shifts, and at fine ones about an origin."""

    count: int  # of all sounds
    which: np.ndarray  # of them, that hold all that a fit needs
    sounds: np.ndarray  # these
    first: np.ndarray  # sample of each that the first whole shift puts at the start of a fit
    energy: np.ndarray
    whole: np.ndarray  # (sounds, 3, shifts); no shifts if origins are given
    begins: np.ndarray  # sample of each at which the fine shifts count from; -1 if unknown
    energy_there: np.ndarray
    fine: np.ndarray  # (sounds, 3, shifts)


@dataclass
class Model:
    """Modes that start behind a filter, at shifts of 1 / PARTS samples about 0."""

    lead: int  # samples of a fit before its origin
    freedom: float  # degrees of it in noise that Q leaves
    near: int  # shifts on either side that a fit tries
    reach: int  # samples on either side that its origin is looked for in
    parts: tuple[np.ndarray, np.ndarray]  # results of `step_modes`, from `lead` + `reach` before
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

    def _at(self, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of Q' and K' at each shift, (shifts, rows, samples), behind rows of zeros.

        With the diagonal of K'K and what lies beside it, (3, shifts).
        """
        modes, beyond = self.parts
        columns = np.concatenate((modes, beyond))
        size = modes.shape[1] // PARTS - 2 * self.reach
        rows = -(-len(columns) // ROWS_AT_ONCE) * ROWS_AT_ONCE
        basis, grams = np.empty((len(shift), rows, size)), np.empty((3, len(shift)))
        orthonormal(columns, len(modes), PARTS, PARTS * self.reach, shift, basis, grams)
        return basis, grams

    def fit(self, sounds: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Instant, standard error [samples] and residual fraction of each sound; NaN if cut off.

        The share is that beyond noise.
        """
        return self.fit_projected(self.projected(sounds, guess))

    def projected(self, sounds: np.ndarray, guess: np.ndarray) -> Projected:
        """Sounds that start near a guess, for any prior and error."""
        basis, _ = self.whole
        reach, size = len(basis) // 2, basis.shape[2]
        known = np.isfinite(guess)
        first = np.floor(np.where(known, guess, -1e6) + 0.5).astype(np.int64) - self.lead
        which = np.flatnonzero((first >= reach) & (first + reach + size <= sounds.shape[1]))
        if len(which) < len(sounds):
            sounds, first = sounds[which], first[which]
        energy, whole = self._projections(sounds, first, basis)
        fine = np.empty((len(which), 3, 2 * self.near + 1))
        unknown = np.full(len(which), -1)
        return Projected(
            len(guess), which, sounds, first, energy, whole, unknown, energy.copy(), fine
        )

    def projected_there(self, held: Projected, most: int) -> Projected:
        """The loudest of sounds that have an origin by another model, for a fit about the same."""
        there = np.flatnonzero(held.begins >= 0)
        if len(there) > most:
            there = np.sort(there[np.argsort(-held.energy_there[there], kind="stable")[:most]])
        sounds, begins = held.sounds[there], held.begins[there]
        energy, fine = self._projections(sounds, begins, self.fine[0])
        which, first, whole = held.which[there], held.first[there], np.empty((len(there), 3, 0))
        return Projected(held.count, which, sounds, first, energy, whole, begins, energy, fine)

    def fit_projected(self, held: Projected) -> np.ndarray:
        """The fit of sounds that are projected on this model."""
        fits = np.full((held.count, 3), np.nan)
        there, origin, beyond = self._origins(held)
        if len(there):
            energy, fine = self._near(held, there, origin)
            out, floor = np.empty((len(there), 3)), (self.noise, self.error)
            weigh(fine, energy, self.fine[1], 1.0 / PARTS, floor, self.freedom, self.prior, out)
            which, own = held.which[there], self.noise / energy
            wider = np.maximum((own + self.misfit) / (own + self.error), 1.0)
            fits[which, 0] = origin + self.lead + out[:, 0]
            fits[which, 1] = np.sqrt(out[:, 1] ** 2 * wider + beyond)
            fits[which, 2] = out[:, 2] - self.freedom * self.noise / energy
        return fits

    def median_left(self, held: Projected) -> float:
        """Fraction of the energy that the model leaves in the median; infinite if it fits none."""
        there, origin, _ = self._origins(held)
        if not len(there):
            return np.inf
        energy, fine = self._near(held, there, origin)
        left, floor = np.empty(len(there)), (self.noise, self.error)
        leave(fine, energy, self.fine[1], floor, self.freedom, self.prior, left)
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

        The first prior has to do where no other one can come up to an evidence of `beaten`.
        """
        self.evidence = -np.inf
        there, origin, _ = self._origins(held)
        if len(there) < LEAST:
            return
        energy, fine = self._near(held, there, origin)
        self.evidence, impulse, self.error = most_probable(
            fine,
            energy,
            self.fine[1],
            1.0 / PARTS,
            self.noise,
            self.freedom,
            BOTH_PRIORS if self.parts[1].any() else BOTH_PRIORS[:1],  # without a filter all same
            FIRST_ERROR,
            least,
            beaten - BY_PRIOR,
        )
        self.prior = impulse, impulse * SLOPE_PRIOR

    def compare(self, held: Projected, most: float) -> None:
        """Set the misfit, from some sounds of which no more than a fraction of `most` is left.

        What a model leaves lies in few directions, and one of them may be that in which a shift
        changes a sound. A fit has taken this part off the sound, but not off others: the misfit
        is OWN times the mean square of a component of a sound in this direction for all others,
        noise apart, in the median of the sounds.
        """
        there, origin, _ = self._origins(held)
        some = slice(None, None, max(-(-len(there) // COMPARED), 1))
        there, origin = there[some], origin[some]
        energy, fine = self._near(held, there, origin)
        out, floor = np.empty((len(there), 3)), (self.noise, self.error)
        weigh(fine, energy, self.fine[1], 1.0 / PARTS, floor, self.freedom, self.prior, out)
        own = self.noise / energy
        alike = np.flatnonzero(out[:, 2] - self.freedom * own <= most)
        if len(alike) < LEAST:
            return
        at = np.rint(PARTS * out[alike, 0]).astype(int) + self.near
        at = np.clip(at, 1, 2 * self.near - 1)
        samples = origin[alike, None] + np.arange(self.fine[0].shape[2])
        sounds = held.sounds[there[alike, None], samples] / np.sqrt(energy[alike, None])
        own = own[alike]
        left = sounds - self._fitted(sounds, own, at)
        change = self._fitted(sounds, own, at + 1) - self._fitted(sounds, own, at - 1)
        change -= self._fitted(change, own, at)  # by a shift alone
        size = np.sqrt(np.sum(change**2, axis=1, keepdims=True))
        change /= np.where(size > 0.0, size, 1.0)
        squares = (change @ left.T) ** 2 - own
        others = np.sum(squares, axis=0) - np.diag(squares)
        self.misfit = OWN * middle(others) / (len(own) - 1)

    def _fitted(self, sounds: np.ndarray, own: np.ndarray, at: np.ndarray) -> np.ndarray:
        """What the model makes of sounds of energy 1, with their own noise, at fine shifts."""
        rows, (impulse, slope, both) = self.fine[0][at], self.fine[1][:, at]
        error = own + self.error
        impulse, slope = impulse + error / self.prior[0], slope + error / self.prior[1]
        parts = (rows @ sounds[:, :, None])[:, :, 0]
        first, second = parts[:, -2].copy(), parts[:, -1].copy()
        det = impulse * slope - both * both
        parts[:, -2] = (first * slope - second * both) / det
        parts[:, -1] = (second * impulse - first * both) / det
        return np.asarray((parts[:, None] @ rows)[:, 0])

    def _origins(self, held: Projected) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Those that start somewhere, the sample at which a fit begins, and a variance.

        It is the one that puts the most probable start at its origin; what starts that are not
        near to that add to the variance.
        """
        if not held.whole.shape[2]:
            return np.arange(len(held.begins)), held.begins, np.zeros(len(held.begins))
        basis, gram = self.whole
        shift, beyond = np.empty(len(held.energy), np.int64), np.empty(len(held.energy))
        floor = self.noise, self.error
        place(held.whole, held.energy, gram, self.near // PARTS, floor, self.prior, shift, beyond)
        there = np.flatnonzero(shift >= 0)
        return there, (held.first + shift)[there] - len(basis) // 2, beyond[there]

    def _near(
        self, held: Projected, there: np.ndarray, origin: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Energy and fine projections of some sounds where a fit begins at these samples."""
        moved = held.begins[there] != origin
        some = there[moved]
        if len(some):
            held.begins[some] = origin[moved]
            held.energy_there[some], held.fine[some] = self._projections(
                held.sounds[some], origin[moved], self.fine[0]
            )
        if len(there) == len(held.fine):
            return held.energy_there, held.fine
        return held.energy_there[there], held.fine[there]

    def _projections(
        self, sounds: np.ndarray, first: np.ndarray, basis: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        energy, projections = np.empty(len(sounds)), np.empty((len(sounds), 3, len(basis)))
        project(sounds, first, basis, energy, projections)
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
    parts = step_modes(exponents, response, taps, -lead - reach, after + reach)
    freedom = max(heard * (lead + after) - len(parts[0]), 1.0)
    return Model(lead, freedom, round(NEAR * rate * PARTS), reach, parts)
