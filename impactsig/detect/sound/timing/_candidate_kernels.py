"""Kernel that tells how probable sounds are by modes behind a filter. See `shared_modes.py`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._lane_kernels import fused
from ._edge_kernels import PARTS, step_modes
from ._mode_basis_kernels import factor, project
from ._shift_kernels import Search, Shifts, most_probable

__all__ = ["Part", "Search", "Starts", "degrees", "evidence_of", "fine_places"]


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
