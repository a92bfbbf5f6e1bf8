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

FALL, FALLEN = 1e-4, 0.01  # ratio of powers, and share of bands and times
STEP, CROSSING = 1e-2, 5e-3  # ratio of powers, and share of these falls while others rise
DEEP = 10.0**-5.5  # times the strongest of a band: a hole


def has_holes(means: np.ndarray, sounding: np.ndarray) -> bool:
    """Whether codecs left holes in powers (bands, times), of which those `sounding` are known."""
    together = sounding[1:] & sounding[:-1]
    before, after = means[:, :-1], means[:, 1:]
    count = np.count_nonzero((after < FALL * before) & together)
    if count <= FALLEN * len(means) * np.count_nonzero(together):
        return False
    falls = np.count_nonzero((after < STEP * before) & together, axis=0)
    rises = np.count_nonzero((before < STEP * after) & together, axis=0)
    return bool(np.minimum(falls, rises).sum() > CROSSING * count)
