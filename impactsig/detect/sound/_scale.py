"""Lengths of the sound detector at a sampling rate."""

from __future__ import annotations

import functools
import math

from ...errors import InvalidInput
from ._kernels import Scale
from .timing.laying import Lengths, lengths_at

LONGEST_HOP = 0.5e-3  # [s]
FORWARD = 4e-3  # [s]
PAST = 4e-3  # [s]
SPACING = 3e-3  # [s], between impacts
LAG_RATES = (22_050.0, 8_000.0)  # [Hz], of the innovations an attack is timed in
SLOPE = 0.25e-3  # [s], of the straight line they are taken from


@functools.lru_cache(maxsize=8)
def scale_at(rate: float) -> Scale:
    """Lengths of the detector at a sampling rate.

    Raises
    ------
    InvalidInput
        If the rate leaves no octave above 1 kHz, or is beyond that of any sound.
    """
    if not 4e3 <= rate <= 1e6:
        raise InvalidInput(
            "rate", rate, "4 kHz to 1 MHz for sound", 'Give sensor="force" for other records'
        )
    octaves = int(math.log2(rate * LONGEST_HOP))
    hop = 2**octaves
    past, forward, spacing = (max(round(t * rate / hop), 1) for t in (PAST, FORWARD, SPACING))
    short_lag, long_lag = (max(round(rate / f), 1) for f in LAG_RATES)
    slope = max(round(rate * SLOPE), 1)
    reach = spacing * hop // 2
    scale = Scale(hop, octaves, past, forward, spacing, short_lag, long_lag, slope, reach, 0)
    return scale._replace(before=sound_lengths(rate, scale).before)


@functools.lru_cache(maxsize=8)
def sound_lengths(rate: float, scale: Scale) -> Lengths:
    """Lengths of the sounds that are compared; each ends before the next may begin."""
    return lengths_at(rate, scale.short_lag, scale.slope, scale.spacing * scale.hop)
