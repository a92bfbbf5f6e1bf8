"""Gates that close to a floor: by how much they lower the noise.

Noise suppression, as of telephones and meetings, attenuates what is softer than a threshold by some
20 to 50 dB, and opens at once for what is louder. The background N_b is then that of closed
stretches, and all noise that an opening lets through rises above it, as an impact does.

An opened gate is held for a while, in which the sound that opened it decays into the noise. Then
the noise falls within some 10 to 30 ms, without having decayed before: no sound in a room does.
With r_bi the power of octave b, down to 170 Hz, in part i of some 12 ms over N_b, and r_i its mean
weighted as in C, a gate closes about part i if, for k from 1 to 2,

    r_(i+1) < 4.5,  r_(i-k) > 20 r_(i+1)                   it falls by 13 dB or more, to the noise
    | mean_b ln(r_b(i-k-1) / r_b(i-k)) | < 0.35            from a level that did not fall
    the standard deviation over b of ln r_b(i-k) < 0.5     with the spectrum of the noise
    max_j r_j > 3 r_(i-k)                                  after something louder, within 0.3 s

The last condition excludes noise that is switched on and off. Octaves are asked first, and low ones
only if there are closings. If four or more, and a tenth of all falls to the noise, lie within four
seconds, and the median deviation of ln r_(i-k) from its median is less than 0.35, the noise of the
octaves is e to that median higher. That of low octaves and narrow bands, whose means extend over
openings, is read from the stretches in which the gate is open, with the power of each divided by
its open share. What is closed counts as digital silence where crests are counted in the audible
time.
"""

from __future__ import annotations

import functools

import numpy as np

from .._nearby import middle
from ._closing_kernels import AT_NOISE, closed_groups, closing_levels

CLOSED = 0.25  # ratio to the noise behind an open gate, below which it is closed
FEWEST, SHARE = 4, 0.1  # closings, and share of these in all falls to the noise
SCATTER = 0.35  # greatest median deviation of their levels [neper]


def opened_noise(parts: np.ndarray, noise: np.ndarray) -> float:
    """Noise behind an open gate, over the `noise` that was read; 0 if there is no gate.

    `parts` are mean powers of octaves and low octaves (octaves, parts) in which the noise is one;
    that of the octaves is known. That of low octaves is read here from the parts in which a gate is
    closed, since longer means extend from one opening to the next.
    """
    out = np.empty(parts.shape[1] // 2 + 1)
    octaves = len(noise)
    weights = octave_weights(octaves)
    if not enough(*closing_levels(parts[:octaves], noise, weights, out)):
        return 0.0
    closed = (weights / noise) @ parts[:octaves] < AT_NOISE
    noise = np.append(noise, np.median(parts[octaves:, closed], axis=1))
    count, falls = closing_levels(parts, noise, octave_weights(len(parts)), out)
    if not enough(count, falls):
        return 0.0
    levels = np.log(out[:count])
    level = middle(levels)
    return float(np.exp(level)) if middle(np.abs(levels - level)) < SCATTER else 0.0


def enough(closings: int, falls: int) -> bool:
    """Whether so many of all falls to the noise show a gate."""
    return closings >= max(FEWEST, SHARE * falls)


def closed_in(parts: np.ndarray, noise: np.ndarray, groups: int) -> np.ndarray:
    """Which of so many groups of parts a gate attenuates, given the noise behind it while open."""
    out = np.empty(groups, np.bool_)
    closed_groups(parts, noise, octave_weights(len(parts)), CLOSED, out)
    return out


@functools.lru_cache(maxsize=8)
def octave_weights(count: int) -> np.ndarray:
    """Weights of so many octaves from the highest on: inverse to the scatter of their powers."""
    weights = 2.0 ** (-0.5 * np.arange(count))
    return np.asarray(weights / weights.sum())
