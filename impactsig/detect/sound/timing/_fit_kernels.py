"""Kernel that fits a model of shared modes to sounds, a few side by side."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._lane_kernels import fused
from ._mode_basis_kernels import LANES, project
from ._shift_kernels import place, weigh


class Fit(NamedTuple):
    """What the kernel needs of a model."""

    lead: int  # samples of a fit before its origin
    whole: np.ndarray  # bases at whole samples about 0, in single precision: twice as fast
    whole_grams: np.ndarray
    fine: np.ndarray  # and at fine shifts, `step` apart
    fine_grams: np.ndarray
    step: float  # [samples]
    floor: tuple[float, float]  # noise of a sample, and the part of s that the model's errors make
    misfit: float
    freedom: float
    prior: tuple[float, float]


@fused
def begin_each(guess, before, last, out):
    """out[i]: the sample so many before the one next to guess[i]; -1 if it is not in 0 to `last`.

    And where there is no guess.
    """
    for i in range(len(guess)):
        at = math.floor(guess[i] + 0.5) - before if math.isfinite(guess[i]) else -1
        out[i] = at if 0 <= at <= last else -1


@fused
def fit_each(sounds, begins, guess, fit, out):
    """Instant, standard error and residual fraction of each sound that starts near a guess.

    The part of a sound that is fitted begins at the guess, and then at the most probable whole
    shift from there. The share is that beyond noise. Instants and guesses count from begins[i]
    samples before a sound. NaN where a sound does not hold all that, or there is no guess.

    out : (n, 3)
    """
    count, reach, size = len(guess), len(fit.whole) // 2, fit.whole.shape[2]
    near = int(fit.step * (len(fit.fine) // 2))
    which, begin = np.empty(count, np.int64), np.empty(count, np.int64)
    known = 0
    for i in range(count):
        out[i, 0] = out[i, 1] = out[i, 2] = np.nan
        if begins[i] >= 0 and math.isfinite(guess[i]):
            first = math.floor(guess[i] + 0.5) - fit.lead - begins[i]
            if reach <= first <= sounds.shape[1] - reach - size:
                which[known], begin[known] = i, first
                known += 1
    energy, beyond = np.empty(LANES), np.empty(LANES)
    shift, fitted = np.empty(LANES, np.int64), np.empty((LANES, 3))
    at_samples = np.empty((LANES, 3, len(fit.whole)))
    between = np.empty((LANES, 3, len(fit.fine)))
    for at in range(0, known, LANES):
        some = min(LANES, known - at)
        held, start = which[at : at + some], begin[at : at + some]
        project(sounds, held, start, fit.whole, energy, at_samples)
        place(
            at_samples[:some],
            energy[:some],
            fit.whole_grams,
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
        weigh(
            between[:there],
            energy[:there],
            fit.fine_grams,
            fit.step,
            fit.floor,
            fit.freedom,
            fit.prior,
            fitted,
        )
        for i in range(there):
            own, one = fit.floor[0] / energy[i], held[i]
            wider = max((own + fit.misfit) / (own + fit.floor[1]), 1.0)
            out[one, 0] = begins[one] + start[i] + fit.lead + fitted[i, 0]
            out[one, 1] = math.sqrt(fitted[i, 1] * fitted[i, 1] * wider + beyond[i])
            out[one, 2] = fitted[i, 2] - fit.freedom * own
