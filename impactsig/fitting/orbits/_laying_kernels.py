"""Fit an orbit to impacts with decreasing slack, leaving out contradictory flights."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import njit
from .orbit_kernels import Machine, Noise, Smoothed, smooth  # noqa: F401

kernel = njit(nogil=True, error_model="numpy")

ITERATIONS, CLOSE = 20, 1e-4
CUT = 16.0  # chi squared of 2 degrees of freedom that a leg may cost: one in 3000 does by chance
BESIDE = 3  # legs on either side that a contradiction spreads to: the worst of them is left out
PASSES = 12
MEDIAN = 2 * math.log(2)  # of that chi squared


@kernel
def lay(machine, scale, noise, slacks, seen, joined, node):
    """Fit an orbit, slack by slack; returns the last result of `smooth`.

    The arguments are those of `smooth`. Legs are taken out of `joined` in place.
    """
    found = smooth(machine, scale, noise, slacks[0], seen, joined, node, ITERATIONS, CLOSE)
    for k in range(len(slacks)):
        for again in range(PASSES):
            if k + again > 0:
                found = smooth(
                    machine, scale, noise, slacks[k], seen, joined, node, ITERATIONS, CLOSE
                )
            if not leave_out(found.release, joined):
                break
    return found


@kernel
def leave_out(release, joined):
    """Remove the worst of each run of contradictory flights from `joined`."""
    if not joined.any():
        return False
    # Parameters that are off make all legs worse than chance would.
    usual = max(1.0, np.median(release[joined]) / MEDIAN)
    bad = np.zeros(len(joined), np.bool_)
    for k in range(len(joined)):
        if joined[k] and release[k] > CUT * usual:
            bad[k] = True
            for near in range(max(k - BESIDE, 0), min(k + BESIDE + 1, len(joined))):
                if joined[near] and not release[near] <= release[k]:
                    bad[k] = False
    for k in range(len(joined)):
        if bad[k]:
            joined[k] = False
    return bad.any()
