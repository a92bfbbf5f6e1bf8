"""Fit of the modes that sounds share, and choice of the anti-aliasing filter.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._edge import PARTS, responses, step_modes
from ._shared_modes_kernels import add_lagged_products, leave, place, project, weigh

RING = (0.6e-3, 5e-3)  # [s] after the guess: where modes are learned from, and how long
FIT = (1.5e-3, 3e-3)  # [s] before and after the instant
REACH = 0.8e-3  # [s], by which the guess may be off
NEAR = 0.3e-3  # [s], by which the first fit may be off
LEAST = 8  # sounds that a model is learned from
WEAKEST = 2e-3, 1e-4  # eigenvalues that make a mode, relative to the greatest
ABOVE_NOISE = 4.0  # times that of white noise
MOST_POLES, SPARSE = 14, 0.4  # more, or a greater part of all there could be, are not shared
MODULI = 0.7, 0.9995
PRIORS = (1e-2, 3e-3, 1e-3, 4e-4)  # variance of the impulse, over the energy
SLOPE_PRIOR = (1.5 * np.pi) ** -2  # that of its slope, for a mode at 1.5 times half the rate
FIRST_PRIOR = 1e-3
FIRST_ERROR = 1e-4  # of a sample, relative to the energy, noise apart
DOUBT, CERTAIN = 4.0, 20.0  # by which sounds without a filter must be, and are, more probable
HOPELESS = 2.0  # times what modes may leave, which no other filter mends
LIKELY = 3  # filters that are tried with more than one choice of modes
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
    the same. There is no choice if modes are too many to be shared.
    """
    from scipy import linalg

    skip, size = (round(t * rate) for t in RING)
    width = size // 2
    rows = size - width + 1
    total = np.zeros((width, width))  # its upper half
    floor = 0.0
    for sound, start in zip(sounds, guess, strict=True):
        if np.isfinite(start) and int(start) + skip + size <= len(sound):
            ring = sound[int(start) + skip :]
            energy = float(np.sum(ring[:size] ** 2))
            if energy > 0.0:
                add_lagged_products(ring, rows, 1.0 / energy, total)
                floor += rows * noise / energy
    # This driver keeps to one thread: those of numpy's spin for longer than it takes.
    value, vectors = linalg.eigh(total, lower=False, driver="evr")
    choices: dict[int, np.ndarray] = {}
    for share in WEAKEST:
        count = int(np.sum(value > max(share * value[-1], ABOVE_NOISE * floor)))
        if count > min(MOST_POLES, SPARSE * width):
            break
        if count and count not in choices:
            common = vectors[:, -count:]
            turn = np.linalg.lstsq(common[:-1], common[1:], rcond=None)[0]
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


@dataclass
class Model:
    """Modes that start behind a filter, at shifts of 1 / PARTS samples about 0."""

    lead: int  # samples of a fit before its origin
    size: int  # of a fit
    freedom: float  # degrees of it in noise that Q leaves
    basis: np.ndarray  # (shifts, columns + 2, size), rows of Q' and K'
    gram: np.ndarray  # (shifts, 3): diagonal of K'K, and what lies beside it
    near: int  # shifts on either side that a fit looks at
    noise: float = 0.0  # power of a sample
    prior: tuple[float, float] = (FIRST_PRIOR, FIRST_PRIOR * SLOPE_PRIOR)
    error: float = FIRST_ERROR
    evidence: float = -np.inf  # per sound, logarithmic

    def fit(self, sounds: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Instant, standard error [samples] and residual share of each sound; NaN if cut off.

        The share is that beyond noise.
        """
        fits = np.full((len(sounds), 3), np.nan)
        origin, beyond = self._origins(sounds, guess)
        there = np.flatnonzero(origin >= 0)
        if len(there):
            energy, projections, gram = self._projections(sounds[there], origin[there])
            out = self._weighed(energy, projections, gram, self.error, self.prior)
            fits[there, 0] = origin[there] + out[:, 0]
            fits[there, 1] = np.sqrt(out[:, 1] ** 2 + beyond[there])
            fits[there, 2] = out[:, 2] - self.freedom * self.noise / energy
        return fits

    def median_left(self, sounds: np.ndarray, guess: np.ndarray) -> float:
        """Share of the energy that the model leaves in the median; infinite if it fits none."""
        left = self.fit(sounds, guess)[:, 2]
        left = left[np.isfinite(left)]
        return float(np.median(left)) if len(left) else np.inf

    def learn(self, sounds: np.ndarray, guess: np.ndarray, least: float) -> None:
        """Set the prior and the error that make the sounds most probable."""
        self.evidence = -np.inf
        origin, _ = self._origins(sounds, guess)
        there = np.flatnonzero(origin >= 0)
        if len(there) < LEAST:
            return
        energy, projections, gram = self._projections(sounds[there], origin[there])
        left = np.empty(len(energy))
        for impulse in PRIORS:
            prior, error = (impulse, impulse * SLOPE_PRIOR), FIRST_ERROR
            for _ in range(2):
                leave(projections, energy, gram, (self.noise, error), prior, left)
                beyond = left / self.freedom - self.noise / energy
                error = max(float(np.median(beyond)), least)
            out = self._weighed(energy, projections, gram, error, prior)
            evidence = float(np.mean(out[:, 4]))
            if not evidence > self.evidence:
                return  # it has one maximum
            self.evidence, self.prior, self.error = evidence, prior, error

    def _origins(self, sounds: np.ndarray, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample nearest to the most probable start of each sound, -1 if it is cut off.

        Beside it what starts that are not near to it add to the variance.
        """
        origin, beyond = np.empty(len(sounds), np.int64), np.empty(len(sounds))
        whole, near = self._part(len(self.basis) // 2, PARTS), self.near // PARTS
        floor = self.noise, self.error
        place(sounds, guess, self.lead, whole, near, floor, self.prior, origin, beyond)
        return origin, beyond

    def _projections(
        self, sounds: np.ndarray, origin: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        basis, gram = self._part(self.near, 1)
        energy, projections = np.empty(len(sounds)), np.empty((len(sounds), len(basis), 3))
        project(sounds, origin, self.lead, basis, energy, projections)
        return energy, projections, gram

    def _weighed(
        self,
        energy: np.ndarray,
        projections: np.ndarray,
        gram: np.ndarray,
        error: float,
        prior: tuple[float, float],
    ) -> np.ndarray:
        out = np.empty((len(energy), 5))
        weigh(projections, energy, gram, 1.0 / PARTS, (self.noise, error), self.freedom, prior, out)
        return out

    def _part(self, reach: int, every: int) -> tuple[np.ndarray, np.ndarray]:
        """Basis and Gram matrices of shifts about 0."""
        middle = len(self.basis) // 2
        part = slice(middle - reach // every * every, middle + reach + 1, every)
        return np.ascontiguousarray(self.basis[part]), np.ascontiguousarray(self.gram[part])


def modes_behind(
    exponents: np.ndarray,
    response: np.ndarray | None,
    taps: np.ndarray,
    rate: float,
    heard: float,
) -> Model:
    """The model of modes with these exponents behind a filter and that of `taps`.

    `heard` is the share of white noise that passes the high-pass filter.
    """
    lead, after = (round(t * rate) for t in FIT)
    reach = int(np.ceil(REACH * rate))
    modes, beyond = step_modes(exponents, response, taps, -lead - reach, after + reach)
    shift = np.arange(-PARTS * reach, PARTS * reach + 1)
    index = PARTS * (np.arange(after + lead) + reach) - shift[:, None]
    q = np.linalg.qr(modes[:, index].transpose(1, 2, 0))[0]
    rest = beyond[:, index].transpose(1, 2, 0)
    rest = rest - q @ (q.transpose(0, 2, 1) @ rest)
    basis = np.ascontiguousarray(np.concatenate((q, rest), axis=2).transpose(0, 2, 1))
    square = rest.transpose(0, 2, 1) @ rest
    freedom = max(heard * (lead + after) - q.shape[2], 1.0)
    gram = np.stack((square[:, 0, 0], square[:, 1, 1], square[:, 0, 1]), axis=1)
    return Model(lead, lead + after, freedom, basis, gram, round(NEAR * rate * PARTS))


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
    """The model with the filter under which a few of these sounds are most probable.

    None if they share no modes, or are more probable without any filter. `unlike` is the share of
    the energy that the modes of sounds that share them leave at most.
    """

    def learned(exponents: np.ndarray, response: np.ndarray | None) -> Model:
        model = modes_behind(exponents, response, taps, rate, heard)
        model.noise = noise
        model.learn(sounds[few], guess[few], EXACT)
        return model

    choices, folded = shared_exponents(sounds, guess, noise, rate)
    if not choices:
        return None
    first, *others = choices
    bare = learned(first, None)
    unfiltered, left = bare.evidence, bare.median_left(sounds[few], guess[few])
    common, *rare = responses()
    model = learned(first, common)
    left = min(left, model.median_left(sounds[few], guess[few]))
    if model.evidence < unfiltered - CERTAIN or left > HOPELESS * unlike:
        return None
    tried = [(model, common), *((learned(first, response), response) for response in rare)]
    tried.sort(key=lambda item: -item[0].evidence)
    likely = [response for _, response in tried[:LIKELY]]
    best = tried[0][0]
    for exponents in others:
        unfiltered = max(unfiltered, learned(exponents, None).evidence)
    for exponents in (*others, *folded):
        for response in likely:
            model = learned(exponents, response)
            if model.evidence > best.evidence:
                best = model
            elif model.evidence < best.evidence - CERTAIN:
                break
    if best.evidence <= unfiltered - DOUBT:
        return None
    best.learn(sounds[few], guess[few], ROUGH)
    return best
