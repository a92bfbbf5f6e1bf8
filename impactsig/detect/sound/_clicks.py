"""Single samples that stand out of a sound: clicks of a cable or a lost word, no impacts.

With the sample that follows an attack replaced by the mean of its two neighbours, an impact goes on
to ring, and nothing is left of a click: of the samples within 2 ms, and of their differences of
second order, those after it have no more than twice the power of those before. The sample is
further from that mean than five times the RMS of the differences, and five times as far as its
neighbours are from each other: a sound that begins with a jump is no click.
"""

from __future__ import annotations

import numpy as np

from ..._compiled import njit

BESIDE = 2e-3  # [s]
SKIPPED = 3  # samples next to the click, which filters may smear it over
LEFT, STANDS_OUT = 2.0, 5.0  # power left, and distance in RMS of differences
APART = 5.0  # times as far from its neighbours as these are from each other
NEAR = 1  # samples about an attack in which the click may be
FEWEST = 5  # impacts beside which others are clicks
MOST = 3  # times as many as there are others: where nearly all impacts are so short, they are that


@njit(nogil=True)
def lone_samples(x, attacks, valid, beside, out):
    """out[k]: whether a single sample is all that stands out at attacks[k], between two samples."""
    for k in range(len(attacks)):
        out[k] = False
        for i in range(int(attacks[k]) + 1 - NEAR, int(attacks[k]) + 2 + NEAR):
            if i - beside < valid[0] + 1 or i + beside + 1 >= valid[1]:
                continue
            before = after = early = late = 0.0
            middle = 0.5 * (x[i - 1] + x[i + 1])
            for j in range(SKIPPED, beside):
                earlier = x[i - j - 1] - 2.0 * x[i - j] + x[i - j + 1]
                later = x[i + j - 1] - 2.0 * x[i + j] + x[i + j + 1]
                before += earlier * earlier
                after += later * later
                early += (x[i - j] - middle) ** 2
                late += (x[i + j] - middle) ** 2
            off = (x[i] - middle) ** 2
            most = max(before, after) / (beside - SKIPPED)
            rings = after > LEFT * before or late > LEFT * early
            if rings or off <= STANDS_OUT**2 * most:
                continue
            if off > APART**2 * (x[i + 1] - x[i - 1]) ** 2:
                out[k] = True


def are_clicks(lone: np.ndarray) -> np.ndarray:
    """Those that stand out as single samples, unless nearly all impacts do."""
    others = np.count_nonzero(~lone)
    few = others >= FEWEST and np.count_nonzero(lone) <= MOST * others
    return lone if few else np.zeros(len(lone), bool)
