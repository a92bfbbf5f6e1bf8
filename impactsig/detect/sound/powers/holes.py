"""Holes that codecs leave in a sound: narrow bands that are empty for a time.

A codec of a low bit rate leaves out what it takes for inaudible, band by band and frame by frame.
A band that it empties falls by far more than a room lets it, and when it is filled again it rises
as an impact does. In mean powers of some 50 ms, a sound is full of holes if of all bands and times
1 % fall by 40 dB to the next, and a number that is 0.5 % of these falls by 20 dB while as many
others rise by as much: a sound that decays into silence falls in all bands, and an impact raises
all. Recordings of drums, keys and taps have neither. Noise-free sound in which each impact has
modes of its own, and decays before the next, cannot be told from it.

Such holes are no background: powers that are 55 dB below the strongest of their band are left out.
"""

from __future__ import annotations

import numpy as np

from ._floor_kernels import count_falls

FALL, FALLEN = 1e-4, 0.01  # ratio of powers, and share of bands and times
LEAST = 1e-3  # share of deep falls in a window, fewer than which are not looked at
STEP, CROSSING = 1e-2, 5e-3  # ratio of powers, and share of these falls while others rise
DEEP = 10.0**-5.5  # times the strongest of a band: a hole


def falls_of(means: np.ndarray, sounding: np.ndarray) -> tuple[int, int, int]:
    """Numbers of pairs of neighbours in time, of deep falls, and of falls beside rises.

    Of powers (bands, times), of which those `sounding` are known; every other band is counted.
    """
    return count_falls(means, sounding, FALL, STEP, LEAST)


def has_holes(pairs: int, deep: int, crossing: int) -> bool:
    """Whether codecs left holes, given the sums of `falls_of`."""
    return deep > FALLEN * pairs and crossing > CROSSING * deep
