"""Gates that fade: where the background is not read from what fades.

A gate may open and close over tens of milliseconds. Near digital silence the sound is then softer
than it was in the room, and a background read there is too low: each opening rises far above it,
as an impact does. In parts of some milliseconds, with p_i the power of the last or first part
beside a silence and p_k that of the part FLANK farther from it, the gate fades if

    median over the edges of silence of { mean over the octaves of ln(p_i / p_k) } < -ln 4.

Without fades this is 0 to -1.2, with fades of 30 to 120 ms -3 to -6.
"""

from __future__ import annotations

import math

import numpy as np

from .._nearby import greatest_within

FLANK = 8e-3  # [s]
FADES = -math.log(4.0)
EDGES = 3  # of which a median says something
REACHES = 0.05, 0.025  # [s] from silence, of what may fade: the first that leaves enough
ENOUGH = 0.25  # of the audible parts


def fades(parts: np.ndarray, audible: np.ndarray, flank: int) -> bool:
    """Whether powers (octaves, parts) fade where they cease to be `audible`, and begin to be.

    A stretch that is audible to the first or the last part has no edge there.
    """
    change = np.diff(audible.astype(np.int8))
    begins, ends = np.flatnonzero(change == 1) + 1, np.flatnonzero(change == -1)
    edge = np.concatenate((begins, ends))
    inner = np.concatenate((begins + flank, ends - flank))
    heard = np.concatenate(([0], np.cumsum(audible)))
    inside = (inner >= 0) & (inner < len(audible))
    edge, inner = edge[inside], inner[inside]
    low, high = np.minimum(edge, inner), np.maximum(edge, inner) + 1
    whole = heard[high] - heard[low] == flank + 1
    outer, further = parts[:, edge[whole]], parts[:, inner[whole]]
    known = (outer > 0.0).all(axis=0) & (further > 0.0).all(axis=0)
    if np.count_nonzero(known) < EDGES:
        return False
    steps = np.log(outer[:, known] / further[:, known]).mean(axis=0)
    return bool(np.median(steps) < FADES)


def beside_fades(
    parts: np.ndarray, audible: np.ndarray, silent: np.ndarray, seconds: float
) -> np.ndarray:
    """Which parts, of `seconds` each, lie in fades beside `silent` ones; none if no gate fades."""
    if fades(parts, audible, max(round(FLANK / seconds), 1)):
        for reach in REACHES:
            beside = greatest_within(silent, round(reach / seconds))
            if np.count_nonzero(audible & ~beside) >= ENOUGH * np.count_nonzero(audible):
                return beside
    return np.zeros(len(silent), np.bool_)
