"""Exponents from the growth of tangent vectors."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

BATCHES = 64
FEWEST = 8  # batches that still tell a scatter


class Growth(NamedTuple):
    """Exponents, and the evidence for them; the last axis is the directions'."""

    exponents: np.ndarray
    error: np.ndarray
    between: np.ndarray
    curve: np.ndarray


def growth_of(time: np.ndarray, grown: np.ndarray, lost: Any) -> Growth:
    """Exponents from the log growth of the columns at the ends of batches.

    The first axis is the batches', of `time` and of `grown`; between it and the directions there
    may be one of motions, which all have come to the same ends, as `lost` has.
    """
    d = grown.shape[-1]
    if not len(time):
        nothing = np.full(grown.shape[1:], math.nan)
        return Growth(nothing, nothing, nothing, grown)
    curve = grown / time[..., None]
    widths = np.diff(time, axis=0, prepend=0.0)
    rates = np.diff(grown, axis=0, prepend=0.0) / widths[..., None]
    whole = widths > 0.5 * widths[0]  # a run that ended early leaves a piece
    error = batch_error(rates[whole.reshape(len(whole), -1).all(axis=1)])
    some = np.asarray(lost)[..., None]
    order = np.where(some > 0, np.arange(d), np.argsort(-curve[-1], axis=-1, kind="stable"))
    between = np.take_along_axis(curve[-1], order, axis=-1)
    exponents = np.where(np.arange(d) >= d - some, -math.inf, between)
    error = np.take_along_axis(error, order, axis=-1)
    return Growth(exponents, error, between, np.take_along_axis(curve, order[None], axis=-1))


def lost_of(totals: np.ndarray) -> np.ndarray:
    """Number of directions that collapses have removed, from totals in the last axis."""
    from .columns import LINES, POINTS

    return np.where(totals[..., POINTS] > 0, 2, np.where(totals[..., LINES] > 0, 1, 0))


def forget(totals: np.ndarray, place: np.ndarray) -> None:
    """Reset the totals; a stick in progress counts as a collapse."""
    from .columns import BY_FRICTION, DETERMINANT, FREE, HELD, LINES, POINTS

    totals[...] = 0.0
    held, friction = place[..., HELD] != FREE, place[..., HELD] == BY_FRICTION
    totals[..., LINES] = held & friction
    totals[..., POINTS] = held & ~friction
    totals[..., DETERMINANT] = np.where(held, -np.inf, 0.0)


def edges_of(before: float, length: float) -> np.ndarray:
    """Ends of the batches; the last is the end of the run."""
    edges = before + length * np.arange(1, BATCHES + 1) / BATCHES
    edges[-1] = before + length
    return edges


def steps_of(count: int) -> np.ndarray:
    """Steps after which the batches of a run of so many end."""
    steps = np.unique(count * np.arange(1, BATCHES + 1) // BATCHES)
    return steps[steps > 0]


def measured(omega: Any, start: np.ndarray, instants: np.ndarray, taken: np.ndarray) -> Any:
    """Time since the start and growth of both columns, from instants and totals."""
    from .columns import FIRST, SECOND

    turns, phase = np.moveaxis(instants - start, -1, 0)
    return (2 * math.pi * turns + phase) / omega, taken[..., [FIRST, SECOND]]


def batch_error(rates: np.ndarray) -> np.ndarray:
    """Standard error of the mean of the rows, by batch means.

    Neighbouring pieces may depend on each other: they are joined two by two, and the greatest of
    the errors that the joined ones give is taken.

    Parameters
    ----------
    rates : ndarray, shape (n, ...)
        Means over n pieces of one length.

    Returns
    -------
    ndarray, shape (...)
        NaN where there are fewer than 8 pieces.
    """
    error = np.full(rates.shape[1:], math.nan)
    while len(rates) >= FEWEST:
        error = np.fmax(error, rates.std(axis=0, ddof=1) / math.sqrt(len(rates)))
        even = rates[: len(rates) // 2 * 2]
        rates = (even[::2] + even[1::2]) / 2
    return error
