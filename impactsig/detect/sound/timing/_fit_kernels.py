"""Kernels that fit a model of shared modes to sounds, a few side by side."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._lane_kernels import fused
from ._mode_basis_kernels import Basis, project
from ._shift_kernels import Shifts, place, weigh

__all__ = ["Basis", "Fit", "Shifts", "fit_each", "put_fits", "seek_each"]

TOGETHER = 16  # sounds


class Fit(NamedTuple):
    """What the kernels need of a model."""

    lead: int  # samples of a fit before its origin
    floor: tuple[float, float]  # noise of a sample, and the part of s that the model's errors make
    prior: tuple[float, float]


@fused
def seek_each(sounds, begins, guess, whole, near, fit, origin, beyond):
    """Sample of each sound that starts near a guess from which fine shifts count, and `place`.

    It lies `fit.lead` before the most probable of the `whole` shifts about the guess, which counts
    from begins[i] samples before a sound; -1 where a sound does not hold all these, or there is no
    guess.
    """
    count, reach = len(guess), len(whole.places) // 2
    which, begin = np.empty(count, np.int64), np.empty(count, np.int64)
    known = 0
    for i in range(count):
        origin[i], beyond[i] = -1, 0.0
        if begins[i] >= 0 and math.isfinite(guess[i]):
            first = math.floor(guess[i] + 0.5) - fit.lead - begins[i]
            if reach <= first <= sounds.shape[1] - reach - whole.size:
                which[known], begin[known] = i, first
                known += 1
    energy, farther = np.empty(TOGETHER), np.empty(TOGETHER)
    shift, found = np.empty(TOGETHER, np.int64), np.empty((TOGETHER, 3, len(whole.places)))
    for at in range(0, known, TOGETHER):
        some = min(TOGETHER, known - at)
        held, start = which[at : at + some], begin[at : at + some]
        project(sounds, held, start, whole, energy, found)
        given = found[:some], energy[:some], whole.grams, near, fit.floor, fit.prior
        place(*given, shift, farther)
        for i in range(some):
            if shift[i] >= 0:
                origin[held[i]] = start[i] + shift[i] - reach
                beyond[held[i]] = farther[i]


@fused
def fit_each(sounds, begins, origin, beyond, fine, shifts, fit, out):
    """Posterior of the instant of each sound about its origin, and what is left of it.

    Instants count from begins[i] samples before a sound. NaN where there is no origin.

    out : (n, 5)
        Instant, its variance, that by starts farther away (`beyond`), residual fraction beyond
        noise, and the power of a sample of noise over the energy.
    """
    which = np.empty(len(origin), np.int64)
    known = 0
    for i in range(len(origin)):
        out[i] = np.nan
        if origin[i] >= 0:
            which[known] = i
            known += 1
    energy, fitted = np.empty(TOGETHER), np.empty((TOGETHER, 3))
    found = np.empty((TOGETHER, 3, len(fine.places)))
    for at in range(0, known, TOGETHER):
        held = which[at : min(at + TOGETHER, known)]
        some, start = len(held), origin[held]
        project(sounds, held, start, fine, energy, found)
        weigh(found[:some], energy[:some], shifts, fit.floor, fit.prior, fitted)
        for i in range(some):
            own, one = fit.floor[0] / energy[i], held[i]
            out[one, 0] = begins[one] + start[i] + fit.lead + fitted[i, 0]
            out[one, 1], out[one, 2] = fitted[i, 1] * fitted[i, 1], beyond[one]
            out[one, 3], out[one, 4] = fitted[i, 2] - shifts.freedom * own, own


@fused
def put_fits(found, error, misfit, out):
    """Instant, standard error and residual fraction of what `fit_each` has found.

    A deviation is that of a part `error` of s; what is off by more along a shift is the misfit.

    out : (n, 3)
    """
    for i in range(len(found)):
        instant, variance, beyond, left, own = found[i]
        wider = max((own + misfit) / (own + error), 1.0)
        out[i, 0], out[i, 1], out[i, 2] = instant, math.sqrt(variance * wider + beyond), left
