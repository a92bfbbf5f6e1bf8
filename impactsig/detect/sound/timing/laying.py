"""Sounds laid over a waveform, each at its likeliest shift."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from ._alike_kernels import SHIFTS, lay_over, mark_alike, shift_taps
from ._filter_kernels import TAPS
from ._waveform_kernels import lay_if_alike, most_alike

REACH = 0.25e-3  # [s], by which the attack of a clear sound may be off
FAR = 2.4e-3  # [s], of one in noise or behind a filter that rings before it
QUIET = 1e-3  # [s], before all that, by which noise is known
BESIDE = 3  # samples left out on either side of the attack: a jump is not the same in all sounds
FINEST = 32_000.0  # [Hz], the rate of the shifts tried first
AGREE = 60e-6  # [s], by which the attack and the waveform may differ in the median
AGREE_IN_NOISE = 150e-6  # [s], at most, if what is left is noise: two standard errors of attacks


class Lengths(NamedTuple):
    """Lengths in samples: a sound is kept from `before` its attack on, the wave from `first`.

    `parts`: shifts tried first for each sample. `edges`: where innovations jump if the sound does.
    """

    reach: int
    far: int
    agree: float
    agree_in_noise: float
    edges: tuple[int, int, int]
    stride: int
    parts: int
    pad: int
    first: int
    before: int
    size: int
    length: int


def lengths_at(rate: float, lag: int, slope: int, size: int) -> Lengths:
    """Lengths at a sampling rate, for waves that last `size` after the attack.

    `lag` and `slope` are those of the innovations.
    """
    reach, far = max(round(REACH * rate), 4), max(round(FAR * rate), 2)
    pad = TAPS + 1
    first = far + pad + TAPS + max(round(QUIET * rate), 2)
    size += reach
    parts = 1
    while parts < SHIFTS and parts * rate < FINEST:
        parts *= 2
    return Lengths(
        reach,
        far,
        AGREE * rate,
        AGREE_IN_NOISE * rate,
        (0, lag, lag + slope),
        lag,
        parts,
        pad,
        first,
        first + reach,
        size,
        2 * first + size,
    )


class Laying(NamedTuple):
    """How sounds are weighted where they are laid over a waveform."""

    lengths: Lengths
    taper: np.ndarray
    weight: np.ndarray  # without what the edges touch
    taps: np.ndarray  # by which waveforms are shifted

    def over(
        self,
        sounds: np.ndarray,
        expected: np.ndarray,
        shifts: np.ndarray,
        clear: float,
        colour: float,
        misfit: float = 0.0,
    ) -> np.ndarray:
        """What `lay_over` finds of each sound (n, 6) on the waveform at all `shifts`."""
        laid, lengths = np.empty((len(sounds), 6)), self.lengths
        near = expected.copy()
        near[:, 1] = np.maximum(near[:, 1], lengths.reach)
        lay_over(
            sounds, near, lengths, clear, colour, misfit, shifts, self.taper, self.weight, laid
        )
        return laid

    def over_if_alike(
        self,
        sounds: np.ndarray,
        expected: np.ndarray,
        shifts: np.ndarray,
        parts: np.ndarray,
        least: int,
    ) -> np.ndarray | None:
        """What `lay_over` finds anywhere; None if too few can be alike, or agree with attacks.

        See `lay_if_alike`.
        """
        laid, given = np.empty((len(sounds), 6)), (self.lengths, shifts, self.taper, self.weight)
        return laid if lay_if_alike(sounds, expected, *given, parts, least, laid) else None

    def leader(self, sounds: np.ndarray) -> int:
        """Number of the sound to which most others are alike; -1 if these are less than half."""
        return int(most_alike(sounds, self.lengths, self.taps, self.taper, self.weight))

    def sum_of(self, a: np.ndarray, b: np.ndarray) -> float:
        """Weighted scalar product of two waveforms."""
        return float(np.sum(self.weight * a * b))


@functools.lru_cache(maxsize=8)
def laying_of(lengths: Lengths) -> Laying:
    """The weights of sounds of these lengths."""
    rising, falling = lengths.reach, lengths.size // 3
    taper = np.ones(lengths.size)
    taper[:rising] = 0.5 - 0.5 * np.cos(np.pi * (np.arange(rising) + 0.5) / rising)
    taper[-falling:] = 0.5 + 0.5 * np.cos(np.pi * (np.arange(falling) + 0.5) / falling)
    weight = taper.copy()
    for edge in lengths.edges:
        weight[rising + edge - BESIDE : rising + edge + BESIDE] = 0.0
    return Laying(lengths, taper, weight, shift_taps())


def are_alike(laid: np.ndarray) -> np.ndarray:
    """Whether the residual of each sound is only noise and a fraction 1 - ALIKE**2."""
    out = np.empty(len(laid), np.bool_)
    mark_alike(laid, out)
    return out
