"""Exponents of the modes that sounds share. See `shared_modes.py` for the method."""

from __future__ import annotations

import numpy as np

from ._shared_modes_kernels import add_rings

RING = (0.6e-3, 5e-3)  # [s] after the guess: where modes are learned from, and how long
WEAKEST = 2e-3, 1e-4  # eigenvalues that make a mode, relative to the greatest
ABOVE_NOISE = 4.0  # times that of white noise
DOUBTFUL = 1.5  # times it, that may be the stronger of the two eigenvalues of a mode
ROUNDED = 1e-9  # relative to the greatest, that rounding may leave
MOST_POLES, SPARSE = 14, 0.4  # more, or a greater part of all there could be, are not shared
LEFT = 0.1  # fraction of the energy of rings, beyond noise, that shared modes do not leave
MODULI = 0.7, 0.9995
ALONE = 1e-12  # least share of the modes that the last of lagged samples leaves
FOLDED = 0.8  # of half the rate, from which a mode may be a folded one


def shared_exponents(
    sounds: np.ndarray, guess: np.ndarray, noise: float, rate: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Candidate exponents of the modes that sounds share, the most probable first.

    The eigenvectors of the sum of all H'H / |y|^2, H the Hankel matrix of a sound y, span the
    modes; what turns these by a sample has the eigenvalues exp(exponent), one of each pair is
    returned. The weak modes come in a choice after the strong, and last those that may be noise: a
    mode that a filter stops is weak, but makes the sounds more probable. A mode near half the rate
    may be one above it, folded by the sampler: these choices come apart, for without a filter they
    are the same. There is no choice if modes are too many to be shared, or if more than LEFT of the
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
    total = np.zeros((width, width))
    known = np.isfinite(guess) & (guess < sounds.shape[1])
    first = np.where(known, guess, sounds.shape[1]).astype(np.int64) + skip
    return total, add_rings(sounds, first, size, noise, size - width + 1, total)


def _counts(value: np.ndarray, floor: float) -> list[int]:
    """Choices of how many of these eigenvalues, the greatest last, are those of shared modes."""
    width, counts = len(value), list[int]()
    most = min(MOST_POLES, SPARSE * width)
    for share in WEAKEST:
        count = int(np.sum(value > max(share * value[-1], ABOVE_NOISE * floor)))
        if count > most:
            return counts
        beside = float(np.sum(value[: width - count])) - floor * (width - count)
        if not counts and beside > LEFT * (float(np.sum(value)) - floor * width) > 0.0:
            return counts
        if count and count not in counts:
            counts.append(count)
    for share in (ROUNDED, WEAKEST[-1]):
        count = int(np.sum(value > max(share * value[-1], DOUBTFUL * floor)))
        count += count % 2
        if counts and counts[-1] < count <= most:
            return [*counts, count]
    return counts
