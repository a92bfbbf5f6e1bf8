"""Waveforms of sounds beside what still rings, for records behind a prediction.

Behind the filter of `powers/ringing.py`, impacts that share a waveform leave short sounds, of which
those of few modes are alike in any phase. Where the ringing before them is weak enough, their
waveform in the record itself is used, as elsewhere, if what it says agrees with the attack behind
the filter: by a whole period of a low mode it may well be wrong.
"""

from __future__ import annotations

import numpy as np

from ._attack_kernels import measure
from ._kernels import Scale
from ._nearby import middle
from .timing.alike import Overlay
from .timing.laying import Lengths

SURELY = 3.0  # standard errors of attacks, by which a waveform may differ


class Heard:
    """Collects sounds as they are in the record.

    `limits` are the least and the greatest sample.
    """

    def __init__(self, lengths: Lengths, limits: tuple[float, float], scale: Scale) -> None:
        self.lengths, self.limits, self.scale = lengths, limits, scale
        self.overlay = Overlay(lengths, unknown)
        self.late = [np.empty(0)]

    def add(self, x: np.ndarray, places: np.ndarray, attacks: np.ndarray) -> None:
        """Add the sounds about `places` of x, whose attacks behind the filter are these."""
        found, sounds = np.empty((len(places), 5)), np.empty((len(places), self.lengths.length))
        measure(x, places, self.limits, self.scale, found, sounds)
        self.overlay.add(sounds, np.sqrt(found[:, 3]))
        self.late.append(found[:, 0] - attacks)

    def timing(self, error: np.ndarray) -> np.ndarray:
        """Shifts of the attacks behind the filter, which have these errors, and their own errors.

        As by `Overlay.timing`.
        """
        (shift, own), late = self.overlay.timing().T, np.concatenate(self.late)
        known = np.isfinite(shift)
        if known.any():
            shift = shift + late - middle(late[known])
        shift = np.where(np.abs(shift) <= SURELY * error, shift, np.nan)
        return np.stack((shift, own), axis=1)


def unknown(count: int) -> np.ndarray:
    """Shifts, and their errors, of so many attacks that nothing but they tells."""
    return np.full((count, 2), np.nan)
