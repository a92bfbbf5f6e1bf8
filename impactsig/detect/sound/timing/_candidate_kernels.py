"""Kernels that tell how probable sounds are by modes behind a filter. See `shared_modes.py`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...signal.order_kernels import centre_of, put_in_order
from .._lane_kernels import fused, sum_of_squares
from ._edge_kernels import PARTS, step_modes
from ._mode_basis_kernels import factor, project
from ._shift_kernels import Search, Shifts, leave, most_probable, place

__all__ = [
    "Fine",
    "Part",
    "Search",
    "Starts",
    "about",
    "begin_each",
    "degrees",
    "evidence_of",
    "fine_places",
    "start_each",
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
    beyond: np.ndarray  # variance of the instant by starts that are too far away for these


class Fine(NamedTuple):
    """Sounds on the modes of a model, at fine shifts about their origins."""

    starts: Starts
    energy: np.ndarray
    projections: np.ndarray
    shifts: Shifts


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
def fine_of(columns, modes, beside, part, starts):
    """Sounds about their origins, on columns that begin `beside` samples before."""
    basis = factor(columns, modes, fine_places(beside, part.close), part.lead + part.after)
    count = len(starts.which)
    energy, projections = np.empty(count), np.empty((count, 3, len(basis.places)))
    project(starts.sounds, starts.which, starts.begins, basis, energy, projections)
    shifts = Shifts(basis.grams, 1.0 / PARTS, degrees(part, modes))
    return Fine(starts, energy, projections, shifts)


@fused
def about(exponents, response, part, starts):
    """Sounds about their origins, by modes behind a filter."""
    beside = math.ceil(part.close / PARTS)
    first, last = -part.lead - beside, part.after + beside
    modes, columns = step_modes(exponents, response, part.taps, first, last)
    return fine_of(columns, modes, beside, part, starts)


@fused
def evidence_of(exponents, response, part, starts, noise, search):
    """Result of `most_probable` for the same."""
    fine = about(exponents, response, part, starts)
    return most_probable(fine.projections, fine.energy, fine.shifts, noise, search)


@fused
def start_each(exponents, response, part, reach, sounds, guess, most, noise, prior, error):
    """What is left of sounds at whole samples, in the median, and these about their starts.

    Of more than `most` those count that are the loudest where they are guessed to start. Whole
    shifts of at most `reach` from the guess of each are tried, the most probable of which puts its
    start at the origin; `error` is the model's part of s. What is left is the fraction beyond the
    `noise` of a sample, and infinite if there are no sounds.
    """
    size, count = part.lead + part.after, 2 * reach + 1
    first, last = -part.lead - reach, part.after + reach
    modes, columns = step_modes(exponents, response, part.taps, first, last)
    basis = factor(columns, modes, PARTS * (2 * reach - np.arange(count)), size)
    begins, which = np.empty(len(guess), np.int64), np.empty(len(guess), np.int64)
    begin_each(guess, part.lead + reach, sounds.shape[1] - size - 2 * reach, begins)
    some = 0
    for i in range(len(guess)):
        if begins[i] >= 0:
            which[some], begins[some] = i, begins[i] + reach
            some += 1
    which, begins, energy = which[:some], begins[:some], np.empty(some)
    if some > most:
        for i in range(some):
            own = sounds[which[i], begins[i] : begins[i] + size]
            energy[i] = -sum_of_squares(own)
        order = np.empty(some, np.int64)
        put_in_order(energy, order, np.empty(some, np.int64))
        some, loudest = most, np.sort(order[:most])
        which, begins, energy = which[loudest], begins[loudest], energy[:some]
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
            beyond[there] = beyond[i]
            there += 1
    middle = centre_of(left, there) if there else np.inf
    starts = Starts(sounds, which[:there], begins[:there], beyond[:there])
    return middle, fine_of(columns, modes, reach, part, starts)
