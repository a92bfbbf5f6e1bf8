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

from .._nearby import greatest_within, middle
from ._gate_kernels import put_edge_steps

FLANK = 8e-3  # [s]
FADES = -math.log(4.0)
EDGES = 3  # of which a median says something
REACHES = 0.05, 0.025  # [s] from silence, of what may fade: the first that leaves enough
ENOUGH = 0.25  # of the audible parts


def edge_steps(parts: np.ndarray, audible: np.ndarray, seconds: float) -> np.ndarray:
    """Mean over the octaves of ln(p_i / p_k) at each edge, of powers (octaves, parts).

    Edges are where parts, of `seconds` each, begin and cease to be `audible`.
    """
    out = np.empty(len(audible))
    return out[: put_edge_steps(parts, audible, max(round(FLANK / seconds), 1), out)]


def beside_fades(
    steps: np.ndarray, audible: np.ndarray, silent: np.ndarray, seconds: float
) -> np.ndarray | None:
    """Which parts, of `seconds` each, lie in fades beside `silent` ones; None if no gate fades."""
    if len(steps) < EDGES or middle(steps) >= FADES:
        return None
    for reach in REACHES:
        beside = greatest_within(silent, round(reach / seconds))
        if np.count_nonzero(audible & ~beside) >= ENOUGH * np.count_nonzero(audible):
            return beside
    return None
