"""Kernels that compare events with the stronger ones near them."""

from __future__ import annotations

import numpy as np

from .._compiled import njit

RINGING, NARROWER, WEAKER = 30.0, 0.6, 0.2
"""Widths after an impact in which its sensor may ring; how narrow and weak that is beside it."""
LOBES = 20
"""Samples to either side of a very short pulse where its filter rings."""


@njit(nogil=True)
def ringing(events, near, widest, out):
    """Mark in `out` the events that ring: narrower and far weaker than one just before.

    Parameters
    ----------
    events, near : arrays (n, EVENT), (m, EVENT)
        Both in the order of time, but for what two seconds share at their border.
    widest : float
        Greatest width in `near`.
    """
    following = 0
    for k in range(len(events)):
        centre, width, height = events[k, 0], events[k, 1], events[k, 2]
        while following < len(near) and near[following, 0] < centre:
            following += 1
        out[k] = False
        for i in range(following - 1, -1, -1):
            apart = centre - near[i, 0]
            if apart > RINGING * widest:
                break
            strong = width <= NARROWER * near[i, 1] and height <= WEAKER * near[i, 2]
            if strong and 0.0 < apart < RINGING * near[i, 1]:
                out[k] = True
                break


@njit(nogil=True)
def lobes(events, near, out):
    """Mark in `out` the events that may be the ringing of a filter beside a greater one.

    Parameters
    ----------
    events, near : arrays (n, EVENT), (m, EVENT)
        Both in the order of time, but for what two seconds share at their border.
    """
    first = 0
    for k in range(len(events)):
        while first < len(near) and near[first, 0] < events[k, 0] - LOBES:
            first += 1
        out[k] = False
        i = first
        while i < len(near) and near[i, 0] < events[k, 0] + LOBES:
            apart = np.abs(near[i, 0] - events[k, 0])
            out[k] |= events[k, 2] < 0.5 * near[i, 2] / (1.0 + 0.5 * apart)
            i += 1
