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
from .timing.shared_modes import Timing

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

    def timing(self, error: np.ndarray) -> Timing:
        """Shifts of the attacks behind the filter, which have these errors; NaN if unknown."""
        (shift, own), late = self.overlay.timing(), np.concatenate(self.late)
        known = np.isfinite(shift)
        if known.any():
            shift = shift + late - middle(late[known])
        return Timing(np.where(np.abs(shift) <= SURELY * error, shift, np.nan), own)


def unknown(count: int) -> Timing:
    """Shifts of so many attacks that nothing but they tells."""
    return Timing(*np.full((2, count), np.nan))
