"""Gates that fade: where the background is not read from what fades.

A gate may open and close over tens of milliseconds. Near digital silence the sound is then softer
than it was in the room, and a background read there is too low: each opening rises far above it,
as an impact does. In parts of some milliseconds, with p_i the power of the last or first part
beside a silence and p_k that of the part FLANK farther from it, the gate fades where it opens, or
where it closes, if

    median over these edges of silence of { mean over the octaves of ln(p_i / p_k) } < -ln 4.

Without fades this is 0 to -1.2, with fades of 30 to 120 ms -3 to -6. Most gates open at once and
fade where they close.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .._nearby import middle
from ._gate_kernels import put_edge_steps

FLANK = 8e-3  # [s]
FADES = -math.log(4.0)
EDGES = 3  # of which a median says something
REACHES = 0.05, 0.025  # [s] from silence, of what may fade: the first that leaves enough
ENOUGH = 0.25  # of the audible parts


def edge_steps(
    parts: np.ndarray, audible: np.ndarray, seconds: float
) -> tuple[np.ndarray, np.ndarray]:
    """Mean over the octaves of ln(p_i / p_k) at each edge, of powers (octaves, parts).

    Edges are where parts, of `seconds` each, begin to be `audible`, and where they cease to.
    """
    out = np.empty((2, len(audible)))
    opening, closing = put_edge_steps(parts, audible, max(round(FLANK / seconds), 1), out)
    return out[0, :opening], out[1, :closing]


def beside_fades(
    steps: Sequence[np.ndarray], audible: np.ndarray, silent: np.ndarray, seconds: float
) -> np.ndarray | None:
    """Which parts, of `seconds` each, lie in fades beside `silent` ones; None if no gate fades.

    `steps` are those where a gate opens, and where it closes.
    """
    opens, closes = (len(side) >= EDGES and middle(side) < FADES for side in steps)
    silences = np.append(0, np.cumsum(silent))
    index = np.arange(len(silent))
    for reach in REACHES if opens or closes else ():
        near = round(reach / seconds)
        first = np.maximum(index - near * opens, 0)
        last = np.minimum(index + near * closes + 1, len(silent))
        beside: np.ndarray = silences[last] > silences[first]
        if np.count_nonzero(audible & ~beside) >= ENOUGH * np.count_nonzero(audible):
            return beside
    return None
