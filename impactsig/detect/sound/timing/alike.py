"""Mutual alignment of similar sounds, to a fraction of a sample.

A structure that is hit at one place has the same waveform each time, except for the strength. The
attack alone determines the instant to a sample; the whole waveform, aligned with that of the other
impacts, to a hundredth of one. The waveform is learned from up to LEARN impacts (`_waveform.py`).
The shift of an impact minimises the residual of p times the waveform (`laying.py`). A constant, the
median shift of the impacts learned from, is subtracted, so that on average instants are those of
the attacks, or of shared modes (`shared_modes.py`).

A sound is alike if the waveform leaves at most 1 - ALIKE^2 of its power, apart from noise. The
instants of attacks are kept where there is no common waveform. For sounds that differ in phase,
hardly anything between samples can be determined, since a slightly later instant with other phases
gives the same samples.

The error of a shift includes how sounds differ from each other, and how much of a shift may be the
phase of a single mode (`_shift_errors.py`).

Sounds are compared by the innovations with which attacks are timed, in which hum and low tones of a
room are weak.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ._alike_kernels import put_expected
from ._waveform import LEAST, Waveform, learn_waveform
from .laying import Laying, Lengths, are_alike, laying_of

LEARN = 256  # impacts that the waveform is learned from
CLEAR = 0.02  # fraction of its power left of a sound with so little noise that its attack is right
FITTED = 2  # numbers fitted to a sound
FINEST_SHIFT = 1e-3  # [samples], to which shifts are computed


@dataclass
class Overlay:
    """Shifts of the impacts of a record, in sequence.

    `reference` gives the shifts of so many impacts taken last that are known by other means and
    their standard errors (n, 2), and NaN for the others, whose attacks count.
    """

    lengths: Lengths
    reference: Callable[[int], np.ndarray]
    laying: Laying = field(init=False)
    wave: Waveform | None = None
    learned: bool = False
    held: list[np.ndarray] = field(default_factory=list)
    spreads: list[np.ndarray] = field(default_factory=list)
    count: int = 0
    found: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.laying = laying_of(self.lengths)

    def add(self, sounds: np.ndarray, spread: np.ndarray) -> None:
        """Add the sounds (n, length) of the next impacts, with standard errors of attacks."""
        if not self.learned:
            held = sounds[: LEARN - self.count]
            self.held.append(held)
            self.spreads.append(spread)
            self.count += len(held)
            if self.count < LEARN:
                return
            self._learn()
            sounds, spread = sounds[len(held) :], spread[len(held) :]
        if len(sounds):
            self.found.append(self._shifts(sounds, spread))

    def timing(self) -> np.ndarray:
        """Shift and standard error of every impact, shape (n, 2); NaN where unchanged."""
        if not self.learned:
            self._learn()
        return np.concatenate(self.found)

    def _learn(self) -> None:
        if self.count < LEAST:
            self.found.append(np.full((self.count, 2), np.nan))
        else:
            sounds, spread = np.concatenate(self.held), np.concatenate(self.spreads)
            expected = self._expected(spread)[: self.count]  # `reference` knows of later ones too
            self.wave = learn_waveform(self.laying, sounds, expected)
            self.found.append(self._laid(sounds, expected))
        self.learned, self.held, self.spreads = True, [], []

    def _expected(self, spread: np.ndarray) -> np.ndarray:
        """Prior shift and standard error of the last impacts."""
        expected = self.reference(len(spread)).copy()
        put_expected(spread, expected)
        return expected

    def _shifts(self, sounds: np.ndarray, spread: np.ndarray) -> np.ndarray:
        """Shift and standard error of the last sounds; NaN for those unlike the wave."""
        if self.wave is None:
            return np.full((len(sounds), 2), np.nan)
        return self._laid(sounds, self._expected(spread))

    def _laid(self, sounds: np.ndarray, expected: np.ndarray) -> np.ndarray:
        """The same of any sounds."""
        found = np.full((len(sounds), 2), np.nan)
        if self.wave is not None:
            expected = np.add(expected, (self.wave.latency, 0.0))
            wave = self.wave
            laid = self.laying.over(sounds, expected, wave.shifts, CLEAR, wave.colour, wave.misfit)
            alike = are_alike(laid)
            shift, factor, left, _, _, elsewhere = laid[alike].T
            power = left / max(self.laying.weight.sum() - FITTED, 1.0)
            near = wave.gain * power / factor**2 + FINEST_SHIFT**2
            near += wave.lever * wave.misfit + wave.phase
            found[alike, 0] = shift - self.wave.latency
            found[alike, 1] = np.sqrt(near + elsewhere)
        return found
