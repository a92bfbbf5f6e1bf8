"""Kernels that add waveforms to a record in place, each sample once for each that touches it."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import njit

REACH = 14.0  # time constants after which a decay is left out: 1e-6 of where it began
ANCHOR = 1024  # samples after which a rotating phasor is set anew: rounding cannot add up


@njit(nogil=True)
def add_half_sines(
    samples: np.ndarray, touch: np.ndarray, contact: np.ndarray, peak: np.ndarray
) -> None:
    """Add half-sines that begin at `touch` and last `contact`, both in samples."""
    for i in range(len(touch)):
        k = max(math.ceil(touch[i]), 0)
        while k < len(samples) and k <= touch[i] + contact[i]:
            samples[k] += peak[i] * math.sin(math.pi * (k - touch[i]) / contact[i])
            k += 1


@njit(nogil=True)
def add_decays(
    samples: np.ndarray,
    begin: np.ndarray,
    amplitude: np.ndarray,
    phase: np.ndarray,
    turn: float,
    decay: float,
) -> None:
    """Add sinusoids that decay from `begin` on, until they are REACH time constants old.

    `begin` and `decay` are in samples, `turn` is the angle from one sample to the next.
    """
    shrink = math.exp(-1.0 / decay)
    along, across = shrink * math.cos(turn), shrink * math.sin(turn)
    for i in range(len(begin)):
        first = max(math.ceil(begin[i]), 0)
        last = min(len(samples), math.ceil(begin[i] + REACH * decay))
        since = first - begin[i]
        size = amplitude[i] * math.exp(-since / decay)
        c = size * math.cos(turn * since + phase[i])
        s = size * math.sin(turn * since + phase[i])
        for k in range(first, last):
            samples[k] += s
            c, s = c * along - s * across, c * across + s * along


@njit(nogil=True)
def add_sinusoid(samples: np.ndarray, amplitude: float, phase: float, turn: float) -> None:
    """Add ``amplitude sin(phase + k turn)`` to sample k."""
    along, across = math.cos(turn), math.sin(turn)
    c = s = 0.0
    for k in range(len(samples)):
        if k % ANCHOR == 0:
            c = amplitude * math.cos(phase + k * turn)
            s = amplitude * math.sin(phase + k * turn)
        samples[k] += s
        c, s = c * along - s * across, c * across + s * along


@njit(nogil=True)
def shape(samples: np.ndarray, pole: np.ndarray, zero: np.ndarray, state: np.ndarray) -> None:
    """Filter in place through first-order sections (1 - zero/z) / (1 - pole/z), one after another.

    `state`, shape (sections + 1,), is what came before: the last input and each section's output.
    """
    for k in range(len(samples)):
        value = samples[k]
        before = state[0]
        state[0] = value
        for j in range(len(pole)):
            value = value - zero[j] * before + pole[j] * state[j + 1]
            before = state[j + 1]
            state[j + 1] = value
        samples[k] = value
