"""What noise feeds into an orbit, be it white, filtered or of the stiffness.

Half an orbit leads from the lower to the upper turn in the time L, and the noise does work on it at
the rate F(t) f(t), with F = v, or v x where the noise is of the stiffness. As the way back is the
same in reverse, F is odd and a series of sines, ``F = sum F_n sin(n pi t / L)``, and the variance
of the energy grows at the rate ``V^2 = sum F_n^2 S(n pi / L) / 2``, S the noise's spectral density.

That sum, whose terms fall as slowly as n^-2 where stops turn the velocity round, is not needed: the
correlation of the noise is the real part of ``(I / tau) exp(-rate s)``, and so the sum is that of

``(1 / tau) (2 int_0^L F P dt - (p^2 - 2 p q exp(-rate L) + q^2) / (1 - exp(-2 rate L)))``

with P' = F - rate P and P(0) = 0, p = P(L) and q the integral of ``F exp(-rate t)``. P is found by
Radau's implicit method of order 15, in steps that resolve what P(0) excites as long as it lasts.
Where the noise hardly changes along half an orbit, or forgets all over and over, limits are taken.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ...oscillators import Noise
from ._cycles import AGREED, NODES, Piece, orbits, pieces_of, rule
from ._families import Family
from ._well import Conservative

STAGES = 8
AT_ONCE = 256  # steps, of each orbit
LASTS = 32.0  # correlation times, after which nothing is left of how P began
RESOLVED = 2.0  # of the phase and the exponent of exp(-rate t), in a step
SLOW = 1e-4  # phase and exponent of exp(-rate t) in half an orbit, up to which noise is constant
FAST = 3e4  # the same from which on it forgets at once
STEPS = 3  # in a part of an orbit, at least
ENOUGH = 1e-9  # relative change at which the nodes are not doubled again


class Band(NamedTuple):
    """What noise of intensity 1 is."""

    correlation_time: float
    angular_frequency: float
    parametric: bool

    @property
    def coloured(self) -> bool:
        """Whether it feeds in another share than white noise that is a force."""
        return self.parametric or self.correlation_time > 0

    @property
    def rate(self) -> complex:
        """At which its correlation shrinks and turns."""
        return complex(1 / self.correlation_time, -self.angular_frequency)


def band_of(noise: Noise) -> Band:
    """A noise but for its intensity."""
    return Band(noise.correlation_time, noise.angular_frequency, noise.parametric)


def fed(
    part: Conservative,
    family: Family,
    band: Band,
    energy: np.ndarray,
    area: np.ndarray,
    coarse: bool = False,
) -> np.ndarray:
    """Half the variance that a cycle adds to the energy, by the noise's intensity.

    That is the area, the integral of v dx, under white noise that is a force, and under white noise
    of the stiffness the integral of v x^2 dx.
    """
    if not band.coloured:
        return area
    found = np.zeros(energy.shape)
    left = np.arange(len(energy))
    for level, nodes in enumerate(NODES[:1] if coarse else NODES):
        finer = _fed(part, family, band, energy[left], nodes, STEPS << level)
        change = np.abs(finer - found[left])
        found[left] = finer
        left = left[change > (ENOUGH if band.correlation_time else AGREED) * np.abs(finer)]
        if not left.size:
            break
    return found


def fed_slope(
    part: Conservative,
    family: Family,
    band: Band,
    energy: np.ndarray,
    breaks: Iterable[float],
) -> np.ndarray:
    """Derivative of it by the energy, by a five-point difference that keeps off grazing orbits."""
    apart = np.min([np.full(energy.shape, np.inf), *(abs(energy - at) for at in breaks)], axis=0)
    step = np.clip(apart / 3, 1e-6 * energy, 1e-3 * energy)
    near = [
        fed(part, family, band, at, orbits(part, at, family=family).area)
        for at in (energy - 2 * step, energy - step, energy + step, energy + 2 * step)
    ]
    return np.asarray((near[0] - 8 * near[1] + 8 * near[2] - near[3]) / (12 * step))


class Way(NamedTuple):
    """A part of half an orbit at the nodes of a rule, for each energy.

    Attributes
    ----------
    pace, work : numpy.ndarray, shape (energies, nodes)
        Derivatives of the time, and of a constant noise's work, by what the nodes are even in.
    done : numpy.ndarray, shape (energies, nodes)
        Work that a constant noise has done there from the first bottom on.
    outwards : bool
        Whether the mass goes from the last node to the first.
    """

    pace: np.ndarray
    work: np.ndarray
    done: np.ndarray
    outwards: bool

    def only(self, which: np.ndarray) -> Way:
        """The same for some of the energies."""
        return Way(self.pace[which], self.work[which], self.done[which], self.outwards)


def _fed(
    part: Conservative, family: Family, band: Band, energy: np.ndarray, nodes: int, steps: int
) -> np.ndarray:
    """The same with a number of nodes, and of steps in a part at least."""
    weights = rule(nodes)[1]
    bottom = family.wells[0].bottom
    ways = [
        _way(part.mass, band, piece, bottom, nodes) for piece in pieces_of(part, family, energy)
    ]
    if not band.correlation_time:
        with np.errstate(divide="ignore", invalid="ignore"):
            square = [np.nan_to_num(way.work**2 / way.pace) @ weights for way in ways]
        return 2 * np.sum(square, axis=0)
    length = np.sum([way.pace @ weights for way in ways], axis=0)
    forgotten = abs(band.rate) * length
    found = np.where(
        forgotten < FAST,
        _slow(band, ways, length, weights),
        _fast(band, ways, nodes),
    )
    # Orbits of about the same period take the same steps.
    octave = np.floor(np.log2(length))
    between = (forgotten > SLOW) & (forgotten < FAST)
    for each in np.unique(octave[between]):
        which = np.flatnonzero(between & (octave == each))
        some = [way.only(which) for way in ways]
        found[which] = _filtered(band, some, length[which], nodes, steps)
    return found


def _slow(band: Band, ways: list[Way], length: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The limit of noise that hardly changes in a cycle: S falls as the square of the frequency."""
    middle = sum((way.done * way.pace) @ weights for way in ways) / length
    square = sum(((way.done - middle[:, None]) ** 2 * way.pace) @ weights for way in ways)
    return np.asarray(2 * square / band.correlation_time**2)


def _fast(band: Band, ways: list[Way], nodes: int) -> np.ndarray:
    """The limit of noise that forgets at once: white, but for where a stop turns the velocity."""
    weights = rule(nodes)[1]
    square, ends = np.zeros((2, len(ways[0].pace)))
    passed = [way.pace.max(axis=1) > 0 for way in ways]
    count = np.cumsum(passed, axis=0)
    for way, here, number in zip(ways, passed, count, strict=True):
        force = np.divide(way.work, way.pace, out=np.zeros_like(way.pace), where=way.pace > 0)
        square += (force * way.work) @ weights
        for at, reached in ((0.0, number == 1), (1.0, number == count[-1])):
            end = force @ _between(nodes, np.array([1 - at if way.outwards else at]))[0]
            ends += np.where(here & reached, end**2, 0.0)
    rate = band.rate
    return np.asarray(
        2 * (square * (1 / rate).real - ends * (1 / rate**2).real) / band.correlation_time
    )


def _way(mass: float, band: Band, piece: Piece, bottom: float, nodes: int) -> Way:
    """A part of half an orbit; 0 for energies that do not get there."""
    weights = rule(nodes)[1]
    pace, work, done = np.zeros((3, len(piece.distance), nodes))
    for crowded, which in piece.crowding():
        own = rule(nodes, crowded)
        away, v, step = piece.only(which).course(mass, own)
        away += piece.well.bottom - bottom
        step = step * (own[1] / weights)
        pace[which] = step / v
        work[which] = step * (bottom + away) if band.parametric else step
        done[which] = away * (bottom + away / 2) if band.parametric else away
    return Way(pace, work, done, piece.side.sign > 0)


def _filtered(
    band: Band, ways: list[Way], length: np.ndarray, nodes: int, steps: int
) -> np.ndarray:
    """The sum over the harmonics, for orbits of periods within an octave."""
    rate = band.rate if band.angular_frequency else band.rate.real
    times, shares, inner = _radau()
    count = len(length)
    state = np.zeros(count, type(rate))  # P
    both, past = np.zeros((2, count), type(rate))  # the integral of F P, and q
    elapsed = np.zeros(count)
    for way in ways:
        fastest = float(way.pace.max())
        if not fastest:
            continue
        start = float(elapsed[way.pace.max(axis=1) > 0].min())
        every = np.array(_steps(start, fastest, abs(rate), band.correlation_time, steps))
        for some in np.array_split(every, -(-len(every) // AT_ONCE)):
            low, span = some[:, :1], np.diff(some)
            at = low + span * times
            values = _between(nodes, (1 - at if way.outwards else at).ravel()).T
            pace, work = (
                (each @ values).reshape(count, len(some), STAGES) * span
                for each in (way.pace, way.work)
            )
            matrix = np.eye(STAGES) + rate * inner * pace[..., None, :]
            right = np.stack([np.ones_like(work), work @ inner.T], axis=-1)
            # What stages would be of P = 1 before the step, and what the noise's work adds.
            kept, new = np.moveaxis(np.linalg.solve(matrix, right), -1, 0)
            lasts = pace @ shares
            time = (elapsed[:, None] + np.cumsum(lasts, axis=1) - lasts)[..., None]
            past += ((work * np.exp(-rate * (time + pace @ inner.T))) @ shares).sum(axis=1)
            before, added = (work * kept) @ shares, (work * new) @ shares
            for k in range(len(some)):
                both += state * before[:, k] + added[:, k]
                state = kept[:, k, -1] * state + new[:, k, -1]
            elapsed = elapsed + lasts.sum(axis=1)
    left = np.exp(-rate * length)
    ends = (state**2 - 2 * state * past * left + past**2) / -np.expm1(-2 * rate * length)
    return np.real(2 * both - ends) / band.correlation_time


def _steps(
    start: float, pace: float, rate: float, memory: float, least: int
) -> list[tuple[float, float]]:
    """Steps through a part of an orbit that begins at an instant, as shares of it."""
    found, low = [], 0.0
    while low < 1:
        lasting = start + low * pace < LASTS * memory
        size = min(1 / least, RESOLVED / (rate * pace)) if lasting else 1 / least
        high = low + size
        high = 1.0 if high > 1 - size / 4 else high
        found.append((low, high))
        low = high
    return found


@lru_cache(maxsize=1)
def _radau() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radau's points on (0, 1], their weights, and integrals from 0 to each of the points."""
    series = np.zeros(STAGES + 1)
    series[-2:] = -1.0, 1.0
    points = np.sort(np.real(legendre.legroots(series)))
    points[-1] = 1.0
    order = np.arange(STAGES)
    values = legendre.legvander(points, STAGES)
    whole = np.empty((STAGES, STAGES))  # integrals of Legendre's polynomials from -1 to each point
    whole[:, 0] = points + 1
    whole[:, 1:] = (values[:, 2:] - values[:, : STAGES - 1]) / (2 * order[1:] + 1)
    inner = whole @ np.linalg.inv(values[:, :STAGES]) / 2
    return (points + 1) / 2, inner[-1], inner


def _between(nodes: int, at: np.ndarray) -> np.ndarray:
    """Values at points from 0 to 1 over those at Gauss and Legendre's."""
    return np.asarray(legendre.legvander(2 * at - 1, nodes - 1) @ _coefficients(nodes))


@lru_cache(maxsize=16)
def _coefficients(nodes: int) -> np.ndarray:
    """Legendre coefficients over values at the nodes."""
    points, weights = legendre.leggauss(nodes)
    values = legendre.legvander(points, nodes - 1)
    return np.asarray((np.arange(nodes)[:, None] + 0.5) * values.T * weights)
