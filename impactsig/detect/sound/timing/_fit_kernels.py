"""Kernel that fits a model of shared modes to sounds, a few side by side."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._lane_kernels import fused
from ._mode_basis_kernels import Basis, project
from ._shift_kernels import Shifts, place, weigh

TOGETHER = 16  # sounds


class Fit(NamedTuple):
    """What the kernel needs of a model."""

    lead: int  # samples of a fit before its origin
    whole: Basis  # at whole samples about 0
    fine: Basis  # and at fine shifts
    shifts: Shifts  # these
    floor: tuple[float, float]  # noise of a sample, and the part of s that the model's errors make
    prior: tuple[float, float]


@fused
def fit_each(sounds, begins, guess, fit, out):
    """Posterior of the instant of each sound that starts near a guess, and what is left of it.

    The part of a sound that is fitted begins at the guess, and then at the most probable whole
    shift from there. Instants and guesses count from begins[i] samples before a sound. NaN where a
    sound does not hold all that, or there is no guess.

    out : (n, 5)
        Instant, its variance, the variance by starts farther away, residual fraction beyond noise,
        and the power of a sample of noise over the energy.
    """
    count, size = len(guess), fit.whole.size
    reach, shifts = len(fit.whole.places) // 2, len(fit.fine.places)
    near = int(fit.shifts.step * (shifts // 2))
    which, begin = np.empty(count, np.int64), np.empty(count, np.int64)
    known = 0
    for i in range(count):
        out[i] = np.nan
        if begins[i] >= 0 and math.isfinite(guess[i]):
            first = math.floor(guess[i] + 0.5) - fit.lead - begins[i]
            if reach <= first <= sounds.shape[1] - reach - size:
                which[known], begin[known] = i, first
                known += 1
    energy, beyond = np.empty(TOGETHER), np.empty(TOGETHER)
    shift, fitted = np.empty(TOGETHER, np.int64), np.empty((TOGETHER, 3))
    at_samples = np.empty((TOGETHER, 3, len(fit.whole.places)))
    between = np.empty((TOGETHER, 3, shifts))
    for at in range(0, known, TOGETHER):
        some = min(TOGETHER, known - at)
        held, start = which[at : at + some], begin[at : at + some]
        project(sounds, held, start, fit.whole, energy, at_samples)
        place(
            at_samples[:some],
            energy[:some],
            fit.whole.grams,
            near,
            fit.floor,
            fit.prior,
            shift,
            beyond,
        )
        there = 0
        for i in range(some):
            if shift[i] >= 0:
                held[there], start[there] = held[i], start[i] + shift[i] - reach
                beyond[there] = beyond[i]
                there += 1
        project(sounds, held[:there], start[:there], fit.fine, energy, between)
        weigh(between[:there], energy[:there], fit.shifts, fit.floor, fit.prior, fitted)
        for i in range(there):
            own, one = fit.floor[0] / energy[i], held[i]
            out[one, 0] = begins[one] + start[i] + fit.lead + fitted[i, 0]
            out[one, 1], out[one, 2] = fitted[i, 1] * fitted[i, 1], beyond[i]
            out[one, 3], out[one, 4] = fitted[i, 2] - fit.shifts.freedom * own, own


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
