"""Widths at which force records are searched, and the response of a pulse to each.

The response to a width w is the mean of the samples over w less the mean of both flanks,

    y = g (C - (L + R) / 2),

with C over w samples, L and R over four widths each, from one and a half widths off the centre
outward. The gain g makes the greatest response to a half-sine of the matching length (w / 0.742)
its peak, so that responses read as heights of pulses. Beyond 8 samples the widths are whole
numbers of block means, which makes a wide response as cheap as it is smooth.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

FACTOR = 4
"""Samples of one level that make a block of the next."""
# The mean over w of a half-sine of length T is most above white noise (by sqrt(w)) at
# tan(x) = 2 x, x = pi w / (2 T) = 1.16556; it is then sin(x)/x of the peak.
MATCH = 2 * 1.16556 / math.pi
"""Width over length of the half-sine that it responds to best."""
HALF_SINE_GAIN = 1.16556 / math.sin(1.16556)


class Ladder(NamedTuple):
    """The widths in ascending order, with their properties."""

    level: np.ndarray  # of the block means: blocks of FACTOR**level samples
    unit: np.ndarray  # width in blocks
    near: np.ndarray  # flanks lie at near < |distance| <= far from the centre, in blocks
    far: np.ndarray
    gain: np.ndarray
    width: np.ndarray  # in samples


def ladder(longest: float) -> Ladder:
    """Widths for contacts of up to `longest` samples, and two beyond.

    Two beyond tell what is wider than a contact from the widest contact.
    """
    limit = MATCH * longest
    rungs = [(0, 1), (0, 2), (0, 3), (0, 4), (0, 6), (0, 8)]
    level = 1
    while sum(unit * FACTOR**on > limit for on, unit in rungs) < 2:
        rungs += [(level, unit) for unit in (3, 4, 6, 8)]
        level += 1
    while rungs[-3][1] * FACTOR ** rungs[-3][0] > limit and len(rungs) > 6:
        rungs.pop()
    on, unit = np.array(rungs).T
    near = unit + (unit + 1) // 2
    near[on == 0] += 1
    far = near + 4 * unit
    far[on == 0] += 4
    gain = np.where((on == 0) & (unit == 1), 1.0, HALF_SINE_GAIN)
    return Ladder(on, unit, near, far, gain, unit * FACTOR**on)


def white_noise(rungs: Ladder) -> np.ndarray:
    """Standard deviation of the responses to white noise, relative to the first."""
    flank = (rungs.far - rungs.near) * (rungs.width // rungs.unit)
    deviation = rungs.gain * np.sqrt(1.0 / rungs.width + 0.5 / flank)
    return deviation / deviation[0]
