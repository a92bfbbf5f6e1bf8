"""What spans tell each other of the shapes of pulses.

What noise hides in one span may show in others: each tells the next of the spread of shapes, and of
the rest that the family leaves.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import kernel
from ._shared_shape_kernels import AGREES, ALONE, FORGOTTEN, SHAPES

OF_REST = SHAPES
"""Column, after those of the shape, of what is told of its rest."""


def nothing_told() -> np.ndarray:
    """What spans tell of shapes: all before in rows 0 and 1, the last one alone in 2 and 3.

    Of the variance of each parameter, and of the mean square of the rest, the information, times
    the most likely value and alone.
    """
    return np.zeros((4, SHAPES + 1))


def told_by_last(told: np.ndarray) -> np.ndarray:
    """What the last span told alone, to tell it to another."""
    alone = nothing_told()
    alone[:ALONE] = told[ALONE:]
    return alone


@kernel
def with_told(left, error, told):
    """Mean square of the rest and its error, with what the spans before tell of it.

    Unless this one shows more; that it shows less says little, for the family may follow the pulses
    of one second. What the span tells by itself is put into `told`.
    """
    seen = error**-2.0 if error > 0.0 else 0.0
    told[ALONE, OF_REST], told[ALONE + 1, OF_REST] = seen * left, seen
    known = told[1, OF_REST]
    if known > 0.0 and seen > 0.0:
        apart = left - told[0, OF_REST] / known
        if apart > AGREES * math.sqrt(1.0 / known + 1.0 / seen):
            told[:ALONE, OF_REST] = 0.0
    known = told[1, OF_REST] + seen
    if not known > 0.0:
        return 0.0, np.inf
    return (told[0, OF_REST] + seen * left) / known, known**-0.5


@kernel
def learn(learnt, told):
    """Add what a span tells of shapes, and forget some of what those before told."""
    for k in range(ALONE):
        for m in range(SHAPES + 1):
            told[ALONE + k, m] = learnt[ALONE + k, m]
            told[k, m] = (1.0 - FORGOTTEN) * learnt[k, m] + learnt[ALONE + k, m]
