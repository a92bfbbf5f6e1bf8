"""Exponents of the modes that sounds share. See `shared_modes.py` for the method."""

from __future__ import annotations

import functools
from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ._shared_modes_kernels import add_rings

SKIP = 0.6e-3  # [s] after the guess: where rings begin, that modes are learned from
WEAKEST = 2e-3, 1e-4  # eigenvalues that make a mode, relative to the greatest
ABOVE_NOISE = 4.0  # times that of white noise
DOUBTFUL = 1.5  # times it, that may be the stronger of the two eigenvalues of a mode
ROUNDED = 1e-9  # relative to the greatest, that rounding may leave
MOST_POLES = 14  # more are not shared
EACH = 1.25  # poles for each sound, more than which are not shared
MODULI = 0.7, 0.9995
ALONE = 1e-12  # least share of the modes that the last of lagged samples leaves
FOLDED = 0.8  # of half the rate, from which a mode may be a folded one


class Ring(NamedTuple):
    """Rings that modes are learned from."""

    length: float  # [s]
    sparse: float  # fraction of all poles there could be, at most, that are shared
    left: float  # fraction of the energy, beyond noise, at most, that shared modes leave


RINGS = Ring(5e-3, 0.4, 0.1), Ring(7e-3, 0.5, 0.01)


@dataclass(frozen=True)
class Rings:
    """The sum of H'H / |y|^2 over sounds y, H the Hankel matrix of y: its upper half.

    White noise of power 1 adds `floor` to each eigenvalue.
    """

    ring: Ring
    size: int  # samples of each
    total: np.ndarray
    floor: float = 0.0

    @property
    def most(self) -> float:
        """Poles that are shared, at most."""
        return min(MOST_POLES, self.ring.sparse * len(self.total))

    @functools.cached_property
    def _tridiagonal(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The turns that make the matrix tridiagonal, and its diagonals then."""
        from scipy.linalg import lapack

        # These functions keep to one thread: those of numpy spin for longer than it takes.
        turns, diagonal, beside, scales, _ = lapack.dsytrd(self.total.T, lower=1)
        return turns, scales, diagonal, beside

    @functools.cached_property
    def eigenvalues(self) -> list[float]:
        """Eigenvalues of the matrix, which ascend."""
        from scipy.linalg import lapack

        return lapack.dsterf(*self._tridiagonal[2:])[0].tolist()

    def eigenvectors(self, count: int) -> np.ndarray:
        """Eigenvectors of the greatest so many, in the columns."""
        from scipy.linalg import lapack

        turns, scales, diagonal, beside = self._tridiagonal
        size, value = len(diagonal), self.eigenvalues[-count:]
        one, whole = np.ones(size, np.int32), np.full(size, size, np.int32)  # block
        vectors, _ = lapack.dstein(diagonal, beside, value, one, whole)
        turned = lapack.dormqr("L", "N", turns[1:, :-1], scales, vectors[1:], size * count)
        vectors[1:] = turned[0]
        return vectors


def no_rings(rate: float, ring: Ring) -> Rings:
    """Those of no sounds."""
    size = round(ring.length * rate)
    return Rings(ring, size, np.zeros((size // 2, size // 2)))


def with_rings(rings: Rings, sounds: np.ndarray, guess: np.ndarray, rate: float) -> Rings:
    """Rings, to whose total those of sounds that start near a guess are added."""
    if not len(sounds):
        return rings
    size, total = rings.size, rings.total.copy()
    floor = add_rings(sounds, guess, round(SKIP * rate), size, size - len(total) + 1, total)
    return Rings(rings.ring, size, total, rings.floor + floor)


class SharedExponents:
    """Candidate exponents of the modes that sounds share, each worked out when it is asked for.

    The eigenvectors of their rings span the modes; what turns these by a sample has the eigenvalues
    exp(exponent), one of each pair counts. There is no choice if modes are too many to be shared,
    or if too much of the rings lies beside the strong ones: the eigenvalues of the others, noise
    apart.
    """

    def __init__(self, rings: Rings, noise: float) -> None:
        self._rings, self._counts = rings, _counts(rings.eigenvalues, rings, noise)
        self._known = filter(len, map(self._exponents, self._counts))

    @functools.cached_property
    def first(self) -> np.ndarray | None:
        """Those of the strong modes; None if there is no choice."""
        return next(self._known, None)

    @functools.cached_property
    def weaker(self) -> list[np.ndarray]:
        """With the weak modes, and last with those that may be noise.

        A mode that a filter stops is weak, but makes the sounds more probable.
        """
        return [] if self.first is None else list(self._known)

    @functools.cached_property
    def folded(self) -> list[np.ndarray]:
        """With modes above half the rate that the sampler has folded, as those near it may be.

        These choices come apart: without a filter they are the same.
        """
        found = []
        for exponents in [] if self.first is None else [self.first, *self.weaker]:
            high = (exponents.imag > FOLDED * np.pi) & (exponents.imag < (1.0 - 1e-9) * np.pi)
            if high.any():
                above = exponents.real + 1j * (2.0 * np.pi - exponents.imag)
                found.append(np.where(high, above, exponents))
        return found

    @functools.cached_property
    def _turned(self) -> tuple[np.ndarray, np.ndarray]:
        """Last of the lagged samples of the eigenvectors, and products of the others, turned."""
        vectors = self._rings.eigenvectors(self._counts[-1])
        return vectors[-1], vectors[:-1].T @ vectors[1:]

    def _exponents(self, count: int) -> np.ndarray:
        """Those of so many eigenvectors."""
        from scipy.linalg import lapack

        last, products = self._turned
        end, turn = last[-count:], products[-count:, -count:]
        # (common' common)^-1 times this, by one row, for all but the last of lagged samples
        turn = turn + (end / max(1.0 - end @ end, ALONE))[:, None] * (end @ turn)
        real, imaginary, *_ = lapack.dgeev(turn, compute_vl=0, compute_vr=0)
        poles = (real + 1j * imaginary)[imaginary >= 0.0]
        modulus = np.abs(poles)
        return np.asarray(np.log(poles[(modulus > MODULI[0]) & (modulus < MODULI[1])]))


def rings_of_shared(
    sounds: np.ndarray, guess: np.ndarray, rate: float, noise: float
) -> Rings | None:
    """The shortest rings whose eigenvalues leave a choice of modes that these sounds share.

    Longer ones are tried where a ring is of few samples. Those of sounds that share a band, but no
    modes, span the more of it the longer they are: the longer ones have more strong eigenvalues.
    None if no modes are shared. Few sounds of their own modes have few as well, up to two each.
    """
    fewer = EACH * len(sounds)
    for ring in RINGS:
        rings = with_rings(no_rings(rate, ring), sounds, guess, rate)
        value = rings.eigenvalues
        strong = _strong(value, noise * rings.floor, WEAKEST[0])
        if strong <= fewer and _counts(value, rings, noise):
            return rings
        if rings.most >= MOST_POLES:
            break
        fewer = min(fewer, strong)
    return None


def _strong(value: list[float], floor: float, share: float, above: float = ABOVE_NOISE) -> int:
    """How many of these eigenvalues exceed a share of the greatest, the last, and noise."""
    return len(value) - bisect_right(value, max(share * value[-1], above * floor))


def _counts(value: list[float], rings: Rings, noise: float) -> list[int]:
    """Choices of how many of these eigenvalues, the greatest last, are those of shared modes."""
    width, counts = len(value), list[int]()
    most, floor = rings.most, noise * rings.floor
    for share in WEAKEST:
        count = _strong(value, floor, share)
        if count > most:
            return counts
        beside = sum(value[: width - count]) - floor * (width - count)
        if not counts and beside > rings.ring.left * (sum(value) - floor * width) > 0.0:
            return counts
        if count and count not in counts:
            counts.append(count)
    for share in (ROUNDED, WEAKEST[-1]):
        count = _strong(value, floor, share, DOUBTFUL)
        count += count % 2
        if counts and counts[-1] < count <= most:
            return [*counts, count]
    return counts
