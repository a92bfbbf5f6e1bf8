"""Initial guess: the equation of motion over three successive impacts.

Between impacts the flow is known, so its velocities at both ends follow from the instants of two
impacts alone, both being at the stop. With p the forced response, y = 1 - p, and the free motion
``C z + S w``, the restitution ``v+ = -r v-`` at the middle one of three impacts at t_0, t_1, t_2
reads

    (1 + r) S_1 S_0 p'_1 + S_0 y_2 - [C_1 S_0 - r (C_0 - 2 zeta S_0) S_1] y_1 - r E_0 S_1 y_0 = 0,

E = exp(-2 zeta h), with 0 and 1 for the legs before and after. Divided by the length of its
gradient by the three instants this is how far they must be moved to fulfil it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .partition import Partition, Train

ALIKE = 0.06  # periods: words whose first phases scatter by more are split
FEWEST = 15  # words in a mean
FAR = 0.3  # of a radian of natural time: no triple counts for more
ROUNDS, TRIMMED = 8, 0.9  # of the least squares for a forcing, and share of the triples that count
RIDGE = 1e-9
TURN = 2 * np.pi


class Values(NamedTuple):
    """Parameters in units of the gap and of 1 / omega_n, or arrays of several."""

    restitution: Any
    damping: Any
    amplitude: Any
    frequency: Any  # of the forcing
    phase: Any  # of the forcing at the mean phase of the impacts


class Courses(NamedTuple):
    """Sequences of successive impacts, each a mean over similar words."""

    instant: np.ndarray  # in periods from the mean phase, shape (groups, length + 1)
    strength: np.ndarray | None  # by the mean of all, same shape
    weight: np.ndarray  # share of the words, shape (groups, 1)


def courses(train: Train, partition: Partition, fewest: int = FEWEST) -> Courses:
    """The mean courses of a train, each of at least so many equal words."""
    sifted = partition.sift(train)
    words = partition.words(sifted)
    x = sifted.cycle + sifted.phase
    groups = []
    fewest = min(fewest, int(np.bincount(words.code).max()))
    for code in np.unique(words.code):
        steps = words.first[words.code == code][:, None] + np.arange(partition.length + 1)
        groups += _alike(steps, sifted.phase[steps[:, 0]], fewest)
    instant = [(x[steps] - sifted.cycle[steps[:, :1]]).mean(0) for steps in groups]
    strength = sifted.strength
    known = None if strength is None else np.array([strength[steps].mean(0) for steps in groups])
    count = np.array([[len(steps)] for steps in groups], float)
    shape = (-1, partition.length + 1)
    return Courses(np.array(instant).reshape(shape), known, count / count.sum())


def _alike(steps: np.ndarray, phase: np.ndarray, fewest: int) -> list[np.ndarray]:
    """Groups whose first phases are close."""
    if len(steps) < fewest:
        return []
    if phase.std() < ALIKE or len(steps) < 2 * fewest:
        return [steps]
    late = phase > np.median(phase)
    return _alike(steps[late], phase[late], fewest) + _alike(steps[~late], phase[~late], fewest)


def imbalance(values: Values, course: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shift of the instants that would satisfy the balance, and the approach velocities.

    Both of the middle one of all triples, shape (..., groups, length - 1), the first axes those of
    the values; in units of 1 / omega_n and of gaps by these.
    """
    r, zeta, amplitude, omega, phase = (np.asarray(one)[..., None, None] for one in values)
    t = course * TURN / omega
    response = amplitude / (1 - omega**2 + 2j * zeta * omega) * np.exp(1j * (omega * t + phase))
    y, p1, p2 = 1 - response.real, -omega * response.imag, -(omega**2) * response.real
    s, c, ds, e = _legs(zeta, np.diff(t))
    s0, e0, ds0 = s[..., :-1], e[..., :-1], ds[..., :-1]
    s1, c1, ds1 = s[..., 1:], c[..., 1:], ds[..., 1:]
    y0, y1, y2 = y[..., :-2], y[..., 1:-1], y[..., 2:]
    v0, v1, v2 = p1[..., :-2], p1[..., 1:-1], p1[..., 2:]
    stay = c1 * s0 - r * ds0 * s1
    value = (1 + r) * s1 * s0 * v1 + s0 * y2 - stay * y1 - r * e0 * s1 * y0
    # By the length of the leg before and of the one after; s' = ds, c' = -s, e' = -2 zeta e.
    before = (1 + r) * s1 * ds0 * v1 + ds0 * y2 + 2 * zeta * r * e0 * s1 * y0
    before -= (c1 * ds0 + r * (s0 + 2 * zeta * ds0) * s1) * y1
    after = (1 + r) * ds1 * s0 * v1 + (s1 * s0 + r * ds0 * ds1) * y1 - r * e0 * ds1 * y0
    first = r * e0 * s1 * v0 - before
    last = after - s0 * v2
    middle = before - after + (1 + r) * s1 * s0 * p2[..., 1:-1] + stay * v1
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = value / np.sqrt(first**2 + middle**2 + last**2)
        approach = v1 + (ds0 * y1 - e0 * y0) / s0
    return distance, approach


def _legs(zeta: np.ndarray, leg: np.ndarray) -> tuple[np.ndarray, ...]:
    """S, C, S' and E of legs of so much natural time."""
    root = np.sqrt(1 - zeta**2)
    e = np.exp(-zeta * leg)
    s = e * np.sin(root * leg) / root
    c = e * np.cos(root * leg) + zeta * s
    return s, c, c - 2 * zeta * s, e * e


def badness(values: Values, course: Courses) -> np.ndarray:
    """Mean square error of instants and strengths, with a penalty where the stop would pull.

    Of each of the values.
    """
    distance, approach = imbalance(values, course.instant)
    off = np.where(approach < 0, np.abs(distance) + FAR, np.abs(distance))
    off = np.minimum(np.nan_to_num(off, nan=FAR), 2 * FAR) ** 2
    triples = off.shape[-1]
    if course.strength is not None:
        speed = np.maximum(np.nan_to_num(approach, nan=0.0), 0.0)
        mean = np.sum(course.weight * speed, axis=(-2, -1), keepdims=True) / triples
        known = course.strength[:, 1:-1]
        known = known / (np.sum(course.weight * known) / triples)
        off = off + np.minimum(np.abs(speed / np.maximum(mean, 1e-12) - known), 2 * FAR) ** 2
    total: np.ndarray = np.sum(course.weight * off, axis=(-2, -1)) / triples
    return total


def forcings(values: Values, course: Courses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The forcing that balances the mean courses best, at given values of the other parameters.

    The balance is linear in the cosine and the sine of the forced response, which weighted least
    squares find, without the triples that are off most.

    Parameters
    ----------
    values : Values
        Restitution and damping, shape (n,); amplitude and phase are not used.
    course : Courses

    Returns
    -------
    off : ndarray, shape (n,)
        How far instants must be moved, root mean square.
    amplitude, phase : ndarray, shape (n,)
    """
    r, zeta = values.restitution[:, None, None], values.damping[:, None, None]
    omega = values.frequency
    turn = TURN * course.instant[None]
    s, c, ds, e = _legs(zeta, np.diff(turn) / omega)
    s0, e0, ds0, s1, c1 = s[..., :-1], e[..., :-1], ds[..., :-1], s[..., 1:], c[..., 1:]
    stay, first = c1 * s0 - r * ds0 * s1, (1 + r) * s1 * s0

    def column(p: np.ndarray, q: np.ndarray) -> np.ndarray:  # of a response and its derivative
        own = first * q[..., 1:-1] + stay * p[..., 1:-1]
        found: np.ndarray = own - s0 * p[..., 2:] + r * e0 * s1 * p[..., :-2]
        return found

    cosine, sine = np.cos(turn), np.sin(turn)
    columns = np.stack((column(cosine, -omega * sine), column(sine, omega * cosine)), axis=-1)
    rest = s0 - stay - r * e0 * s1
    dynamic = 1 - omega**2 + 2j * values.damping * omega
    share = np.broadcast_to(course.weight, rest.shape)
    weight, kept = np.ones_like(rest), np.ones(rest.shape, bool)
    for _ in range(ROUNDS):
        counted = weight * kept * share
        normal = np.einsum("nij,nija,nijb->nab", counted, columns, columns)
        right = -np.einsum("nij,nija,nij->na", counted, columns, rest)
        # A few similar triples may determine one direction only.
        normal += RIDGE * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        pair = np.linalg.solve(normal, right[..., None])[..., 0]
        force = (pair[:, 0] - 1j * pair[:, 1]) * dynamic
        found = values._replace(amplitude=np.abs(force), phase=np.angle(force))
        distance = np.nan_to_num(np.abs(imbalance(found, course.instant)[0]), nan=FAR)
        value = rest + np.einsum("nija,na->nij", columns, pair)
        weight = (distance / np.maximum(np.abs(value), 1e-12)) ** 2
        kept = distance <= np.quantile(distance, TRIMMED, axis=(1, 2), keepdims=True)
    counted = kept * share
    off = np.sqrt(np.sum(counted * distance**2, axis=(1, 2)) / np.sum(counted, axis=(1, 2)))
    return off, found.amplitude, found.phase
