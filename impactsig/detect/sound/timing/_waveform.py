"""Waveform that the impacts of a record share.

It is the least-squares mean of the impacts that are alike, aligned first with the one of the
strongest that is similar to most others, and then with their mean. There is none unless half of the
impacts are alike, and their shifts agree with their attacks: sounds of the same tones in other
phases can be alike after a large shift.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...._numerics.spread import DEVIATION_BY_MEDIAN
from .._nearby import middle
from ._alike_kernels import ROWS, mean_wave, shift_wave
from ._shift_errors import beyond, is_one_mode, lever_of, misfit_of, noise_gain, slope_of
from ._waveform_kernels import put_differences, tolerated
from .laying import Laying, are_alike

FEW = 16  # sounds, of which no part tells surely
LEADERS = 8  # of the impacts that are tried as the first waveform
LEAST = 8  # impacts that make a waveform
PARTS = np.array([(0, 8), (4, 8), (1, 4), (2, 4), (3, 4)])  # first and stride, laid side by side
WHOLE = np.array([(0, 1)])  # all at once
SOME, BEYOND = 0.1, 5.0  # fraction, at most, that may differ by more standard errors: by a period
PASSES = 3  # over the impacts learned from
LEAST_CERTAIN = 0.25  # share of the power of the wave's slope that is not its noise, at least


class Waveform(NamedTuple):
    """The common waveform of the impacts used for learning."""

    shifts: np.ndarray  # (ROWS, size)
    latency: float  # shift that leaves their instants at the reference, in the median
    gain: float  # variance of the shift of a sound of factor 1, over the power of its noise
    colour: float  # that variance over the one in white noise
    misfit: float  # variance of a sound of factor 1 in a direction in which sounds differ
    lever: float  # variance of the shift of a sound of factor 1, over the misfit
    phase: float  # variance of shifts that are phases


def learn_waveform(laying: Laying, sounds: np.ndarray, expected: np.ndarray) -> Waveform | None:
    """The waveform of sounds whose shifts are `expected`, with errors (n, 2); None if none is."""
    if len(sounds) < LEAST:
        return None
    lengths = laying.lengths
    part = slice(lengths.first - lengths.pad, lengths.first + lengths.size + lengths.pad)
    strongest = np.argsort(-np.einsum("ij,ij->i", sounds, sounds), kind="stable")
    # Every so many of the stronger half: the others are noisier.
    some = strongest[: -(-len(sounds) // 2)][:: -(-len(sounds) // (2 * LEADERS))]
    leader = laying.leader(sounds[some])
    if leader < 0:
        return None
    parts = PARTS if len(sounds) > FEW else WHOLE
    wave, shifts = sounds[some[leader], part].copy(), np.empty((ROWS, lengths.size))
    for turn in range(PASSES):
        shift_wave(wave, lengths.pad, laying.taps, shifts)
        laid = laying.over_if_alike(sounds, expected, shifts, parts, LEAST)
        if laid is None:
            return None
        alike = are_alike(laid)
        fits, attacks = laid[alike], expected[alike]
        shift, factor, error, apart = fits[:, 0], fits[:, 1], attacks[:, 1], np.empty(len(fits))
        latency = put_differences(fits, attacks, apart)
        if middle(apart) > tolerated(fits, attacks, lengths):
            return None
        if np.mean(apart > np.maximum(lengths.agree, BEYOND * error)) > SOME:
            return None
        if turn < PASSES - 1:
            # It is to begin where attacks do, not where that of its leader was taken to be.
            move = shift - latency
            near = np.abs(move) <= lengths.far  # no more of a sound is kept
            mean_wave(sounds[alike][near], move[near], factor[near], part.start, wave)
    gain, colour = noise_gain(laying, shifts, sounds[alike])
    halves = np.empty((2, ROWS, lengths.size))
    for half, rows in enumerate(halves):
        mean_wave(sounds[alike][half::2], shift[half::2], factor[half::2], part.start, wave)
        shift_wave(wave, lengths.pad, laying.taps, rows)
    one, other, both = (slope_of(rows) for rows in (*halves, shifts))
    certain = max(laying.sum_of(one, other) / laying.sum_of(both, both), LEAST_CERTAIN)
    phase = 0.0
    if is_one_mode(laying, shifts[ROWS // 2]):
        # Another phase is another shift: only attacks tell how much of either there is.
        known = max(middle(error), 12.0**-0.5) ** 2
        total = (DEVIATION_BY_MEDIAN * middle(apart)) ** 2
        if total > 2.0 * known:
            return None
        phase = beyond(total, known)
    misfit = misfit_of(laying, shifts[ROWS // 2], sounds[alike], fits)
    lever = lever_of(laying, shifts)
    return Waveform(shifts, latency, gain / certain**2, colour, misfit, lever, phase)
