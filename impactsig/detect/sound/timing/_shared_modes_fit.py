"""Fit of the modes that sounds share, and choice of the anti-aliasing filter.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._nearby import middle
from ._edge import PARTS, responses, step_modes
from ._shared_modes_kernels import (
    NOTHING,
    ROWS_AT_ONCE,
    add_rings,
    leave,
    orthonormal,
    place,
    project,
    weigh,
)

RING = (0.6e-3, 5e-3)  # [s] after the guess: where modes are learned from, and how long
FIT = (1.5e-3, 3e-3)  # [s] before and after the instant
REACH = 0.8e-3  # [s], by which the guess may be off
NEAR = 0.3e-3  # [s], by which the first fit may be off
LEAST = 8  # sounds that a model is learned from
WEAKEST = 2e-3, 1e-4  # eigenvalues that make a mode, relative to the greatest
ABOVE_NOISE = 4.0  # times that of white noise
MOST_POLES, SPARSE = 14, 0.4  # more, or a greater part of all there could be, are not shared
LEFT = 0.1  # fraction of the energy of rings, beyond noise, that shared modes do not leave
MODULI = 0.7, 0.9995
PRIORS = (1e-2, 3e-3, 1e-3, 4e-4)  # variance of the impulse, over the energy
BY_PRIOR = float(np.log(PRIORS[0] / PRIORS[-1])) + 1.0  # most that another prior gains
SLOPE_PRIOR = (1.5 * np.pi) ** -2  # that of its slope, for a mode at 1.5 times half the rate
FIRST_PRIOR = 1e-3
FIRST_ERROR = 1e-4  # of a sample, relative to the energy, noise apart
DOUBT, CERTAIN = 4.0, 20.0  # by which sounds without a filter must be, and are, more probable
HOPELESS = 2.0  # times what modes may leave, which no other filter mends
STRANGERS = 6.0, 4.0  # times, before priors are learned, at whole samples and between them
LIKELY = 3  # filters that are tried with more than one choice of modes
LOUD = 16  # sounds, the loudest, that filters are compared by
BEHIND = 1.0  # by which a filter is so much less probable that a narrower one is not tried
ALONE = 1e-12  # least share of the modes that the last of lagged samples leaves
FOLDED = 0.8  # of half the rate, from which a mode may be a folded one
EXACT, ROUGH = 1e-7, 2e-5  # least error by which a filter is chosen, and an instant


def shared_exponents(
    sounds: np.ndarray, guess: np.ndarray, noise: float, rate: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Candidate exponents of the modes that sounds share, the most probable first.

    The eigenvectors of the sum of all H'H / |y|^2, H the Hankel matrix of a sound y, span the
    modes; what turns these by a sample has the eigenvalues exp(exponent), one of each pair is
    returned. The weak modes come in a choice after the strong. A mode near half the rate may
    be one above it, folded by the sampler: these choices come apart, for without a filter they are
    the same. There is no choice if modes are too many to be shared, or if more than LEFT of the
    rings lies beside the strong ones: the eigenvalues of the others, noise apart.
    """
    from scipy import linalg

    total, floor = _rings(sounds, guess, noise, rate)
    # This driver keeps to one thread: those of numpy's spin for longer than it takes.
    value, vectors = linalg.eigh(total, lower=False, driver="evr")
    choices = {}
    for count in _counts(value, floor):
        common, last = vectors[:-1, -count:], vectors[-1, -count:]
        turn = common.T @ vectors[1:, -count:]  # (common' common)^-1 times this, by one row
        turn += np.outer(last, last @ turn) / max(1.0 - last @ last, ALONE)
        poles = np.linalg.eigvals(turn).astype(complex)
        lasting = (np.abs(poles) > MODULI[0]) & (np.abs(poles) < MODULI[1])
        choices[count] = np.log(poles[lasting & (poles.imag >= 0.0)])
    folded = []
    for exponents in choices.values():
        high = (exponents.imag > FOLDED * np.pi) & (exponents.imag < (1.0 - 1e-9) * np.pi)
        if high.any():
            above = exponents.real + 1j * (2.0 * np.pi - exponents.imag)
            folded.append(np.where(high, above, exponents))
    return [choice for choice in choices.values() if len(choice)], folded


def may_share(sounds: np.ndarray, guess: np.ndarray, noise: float, rate: float) -> bool:
    """Whether eigenvalues leave a choice of modes that these sounds share."""
    from scipy import linalg

    total, floor = _rings(sounds, guess, noise, rate)
    value = linalg.eigh(total, lower=False, driver="evr", eigvals_only=True)
    return bool(_counts(value, floor))


def _rings(
    sounds: np.ndarray, guess: np.ndarray, noise: float, rate: float
) -> tuple[np.ndarray, float]:
    """The upper half of the sum of all H'H / |y|^2, and what noise adds to each eigenvalue."""
    skip, size = (round(t * rate) for t in RING)
    width = size // 2
    rows = size - width + 1
    total = np.zeros((width, width))
    there = np.flatnonzero(np.isfinite(guess) & (guess < sounds.shape[1]))
    first = guess[there].astype(int) + skip
    there, first = (v[first + size <= sounds.shape[1]] for v in (there, first))
    floor = 0.0
    if len(there):
        rings = np.lib.stride_tricks.sliding_window_view(sounds, size, axis=1)[there, first]
        floor = add_rings(rings, np.sum(rings**2, axis=1), noise, rows, total)
    return total, floor


def _counts(value: np.ndarray, floor: float) -> list[int]:
    """Choices of how many of these eigenvalues, the greatest last, are those of shared modes."""
    width = len(value)
    counts: list[int] = []
    for share in WEAKEST:
        count = int(np.sum(value > max(share * value[-1], ABOVE_NOISE * floor)))
        if count > min(MOST_POLES, SPARSE * width):
            break
        beside = float(np.sum(value[: width - count])) - floor * (width - count)
        if not counts and beside > LEFT * (float(np.sum(value)) - floor * width) > 0.0:
            break
        if count and count not in counts:
            counts.append(count)
    return counts


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
            out = self._weighed(energy, fine, self.error, self.prior)
            which = held.which[there]
            fits[which, 0] = origin + self.lead + out[:, 0]
            fits[which, 1] = np.sqrt(out[:, 1] ** 2 + beyond)
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
        left = np.empty(len(energy))
        for impulse in PRIORS if self.parts[1].any() else PRIORS[:1]:  # without a filter all same
            prior, error = (impulse, impulse * SLOPE_PRIOR), FIRST_ERROR
            for _ in range(2):
                floor = self.noise, error
                leave(fine, energy, self.fine[1], floor, np.inf, prior, left)
                beyond = left / self.freedom - self.noise / energy
                error = max(middle(beyond), least)
            out = self._weighed(energy, fine, error, prior)
            evidence = float(np.mean(out[:, 4]))
            if not evidence > self.evidence:
                return  # it has one maximum
            self.evidence, self.prior, self.error = evidence, prior, error
            if evidence < beaten - BY_PRIOR:
                return

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

    def _weighed(
        self, energy: np.ndarray, fine: np.ndarray, error: float, prior: tuple[float, float]
    ) -> np.ndarray:
        out, floor = np.empty((len(energy), 5)), (self.noise, error)
        weigh(fine, energy, self.fine[1], 1.0 / PARTS, floor, self.freedom, prior, out)
        return out


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


def chosen_model(
    sounds: np.ndarray,
    guess: np.ndarray,
    few: np.ndarray,
    noise: float,
    rate: float,
    taps: np.ndarray,
    heard: float,
    unlike: float,
) -> Model | None:
    """The model with the filter under which the loudest of a few of these sounds are most probable.

    None if they share no modes, or are more probable without any filter. `unlike` is the share of
    the energy that the modes of sounds that share them leave at most.
    """
    some, near = sounds[few], guess[few]

    def behind(exponents: np.ndarray, response: np.ndarray | None) -> Model:
        model = modes_behind(exponents, response, taps, rate, heard)
        model.noise = noise
        return model

    def projected(exponents: np.ndarray, response: np.ndarray | None) -> tuple[Model, Projected]:
        model = behind(exponents, response)
        return model, model.projected(some, near)

    choices, folded = shared_exponents(sounds, guess, noise, rate)
    if not choices:
        return None
    first, *others = choices
    (bare, by_bare), (model, held) = (projected(first, own) for own in (None, responses()[0]))
    both = (model, held), (bare, by_bare)
    if all(part.median_left_at_samples(of) > STRANGERS[0] * unlike for part, of in both):
        return None
    if all(part.median_left(of) > STRANGERS[1] * unlike for part, of in both):
        return None
    model.learn(held, EXACT)
    most = HOPELESS * unlike
    # Modes that start at once leave as much whatever their prior and error are.
    if model.median_left(held) > most and bare.median_left(by_bare) > most:
        return None
    bare.learn(by_bare, EXACT)
    unfiltered = bare.evidence
    if model.evidence < unfiltered - CERTAIN:
        return None
    for exponents in others:
        other, by_other = projected(exponents, None)
        other.learn(by_other, EXACT)
        unfiltered = max(unfiltered, other.evidence)
    best = _most_probable(behind, choices, folded, model, held)
    if best is not model:
        held = best.projected(some, near)
    # What is as probable as a model that is probable enough needs no further proof.
    if model.evidence <= unfiltered - DOUBT:
        if best is not model:
            best.learn(held, EXACT)
        if best.evidence <= unfiltered - DOUBT:
            return None
    best.learn(held, ROUGH)
    return best


def _most_probable(
    behind: Callable[[np.ndarray, np.ndarray], Model],
    choices: list[np.ndarray],
    folded: list[np.ndarray],
    model: Model,
    held: Projected,
) -> Model:
    """The model with the filter and the modes under which the loudest sounds are most probable.

    All are compared about the origins by a model of the widest filter and the first choice. The
    filters after the slope are narrower and narrower: there is one maximum.
    """
    widest, slope, *narrower = responses()
    own = copy.copy(model)
    own.learn(own.projected_there(held, LOUD), EXACT)
    tried = [(own, widest)]
    rank = LIKELY if len(choices) > 1 or folded else 1  # how many are of use

    def learned(exponents: np.ndarray, response: np.ndarray, beaten: float = -np.inf) -> Model:
        other = behind(exponents, response)
        other.learn(other.projected_there(held, LOUD), EXACT, beaten)
        return other

    def less(item: tuple[Model, np.ndarray]) -> float:
        return -item[0].evidence

    beaten = -np.inf
    for response in (slope, *narrower):
        other = learned(choices[0], response, beaten)
        tried.append((other, response))
        tried.sort(key=less)
        if len(tried) >= rank:
            beaten = tried[rank - 1][0].evidence
        if response is not slope and other.evidence < beaten - BEHIND:
            break
    likely = tried[:LIKELY]
    for exponents in (*choices[1:], *folded):
        most = likely[0][0].evidence
        for i, (before, response) in enumerate(likely):
            other = learned(exponents, response)
            if other.evidence > before.evidence:
                likely[i] = other, response
            most = max(most, other.evidence)
            if other.evidence < most - CERTAIN:
                break
        likely.sort(key=less)  # what other modes tell of a filter counts for the next
    best = likely[0][0]
    return model if best is own else best
