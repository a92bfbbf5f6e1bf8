"""Kernel that tells how probable sounds are by modes behind a filter. See `shared_modes.py`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import fused
from ._edge_kernels import PARTS, step_modes
from ._mode_basis_kernels import factor, project
from ._shift_kernels import Search, Shifts, leave, most_probable, place

__all__ = [
    "Part",
    "Search",
    "Starts",
    "begin_each",
    "degrees",
    "evidence_of",
    "fine_places",
    "starts_of",
]


class Part(NamedTuple):
    """What is fitted of sounds."""

    taps: np.ndarray  # of the filter that they have passed
    heard: float  # fraction of white noise that passes it
    lead: int  # samples before the instant
    after: int  # and after it
    near: int  # fine shifts on either side of an origin that a fit tries
    close: int  # and those by which models learn and are compared


class Starts(NamedTuple):
    """Sounds that start somewhere."""

    sounds: np.ndarray
    which: np.ndarray  # of them
    begins: np.ndarray  # sample of each that fine shifts count from


@fused
def begin_each(guess, before, last, out):
    """out[i]: the sample so many before the one next to guess[i]; -1 if it is not in 0 to `last`.

    And where there is no guess.
    """
    for i in range(len(guess)):
        at = math.floor(guess[i] + 0.5) - before if math.isfinite(guess[i]) else -1
        out[i] = at if 0 <= at <= last else -1


@fused
def degrees(part, modes):
    """Degrees of freedom of a fit, in noise, that so many columns of modes leave."""
    return max(part.heard * (part.lead + part.after) - modes, 1.0)


@fused
def fine_places(beside, most):
    """Places of so many fine shifts on either side, in columns that begin `beside` samples before.

    A shift of one of PARTS later begins one place earlier.
    """
    return PARTS * beside + most - np.arange(2 * most + 1)


@fused
def starts_of(exponents, response, part, reach, sounds, guess, noise, prior, error):
    """Fraction of their energy that sounds leave in the median at whole samples, and their starts.

    Whole shifts of at most `reach` from the guess of each are tried, the most probable of which
    puts its start at the origin; `error` is the model's part of s. The fraction is that beyond the
    `noise` of a sample, and infinite if there are no sounds.
    """
    size, count = part.lead + part.after, 2 * reach + 1
    modes, columns = step_modes(
        exponents, response, part.taps, -part.lead - reach, part.after + reach
    )
    basis = factor(columns, modes, PARTS * (2 * reach - np.arange(count)), size)
    begins, which = np.empty(len(guess), np.int64), np.empty(len(guess), np.int64)
    begin_each(guess, part.lead + reach, sounds.shape[1] - size - 2 * reach, begins)
    some = 0
    for i in range(len(guess)):
        if begins[i] >= 0:
            which[some], begins[some] = i, begins[i] + reach
            some += 1
    which, begins, energy = which[:some], begins[:some], np.empty(some)
    projections = np.empty((some, 3, count))
    project(sounds, which, begins, basis, energy, projections)
    shift, beyond, left = np.empty(some, np.int64), np.empty(some), np.empty(some)
    floor, freedom = (noise, error), degrees(part, modes)
    place(projections, energy, basis.grams, part.near // PARTS, floor, prior, shift, beyond)
    leave(projections, energy, basis.grams, floor, np.inf, prior, left)
    there = 0
    for i in range(some):
        if shift[i] >= 0:
            left[there] = left[i] - freedom * noise / energy[i]
            which[there], begins[there] = which[i], begins[i] + shift[i] - reach
            there += 1
    most = centre_of(left, there) if there else np.inf
    return most, Starts(sounds, which[:there], begins[:there])


@fused
def evidence_of(exponents, response, part, starts, noise, search):
    """Result of `most_probable` for sounds about their origins, by modes behind a filter."""
    beside = math.ceil(part.close / PARTS)
    first, last = -part.lead - beside, part.after + beside
    modes, columns = step_modes(exponents, response, part.taps, first, last)
    places = fine_places(beside, part.close)
    basis = factor(columns, modes, places, part.lead + part.after)
    energy = np.empty(len(starts.which))
    projections = np.empty((len(energy), 3, len(places)))
    project(starts.sounds, starts.which, starts.begins, basis, energy, projections)
    shifts = Shifts(basis.grams, 1.0 / PARTS, degrees(part, modes))
    return most_probable(projections, energy, shifts, noise, search)
