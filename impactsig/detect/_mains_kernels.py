"""Kernel that takes the lines of the mains off a record."""

from __future__ import annotations

import numpy as np

from .._compiled import njit


@njit(nogil=True)
def take_off(x, block, count, turns, fit):
    """Subtract the lines from x, in place.

    Parameters
    ----------
    count : int
        Blocks of `block` samples that were fitted.
    turns : array (lines,)
        Frequencies in cycles a sample.
    fit : array (lines, 2) of complex
    """
    cosine, sine = np.empty(block), np.empty(block)
    for line in range(len(turns)):
        omega = 2.0 * np.pi * turns[line]
        for i in range(block):
            cosine[i], sine[i] = np.cos(omega * i), np.sin(omega * i)
        turn = complex(np.cos(omega * block), np.sin(omega * block))
        phase = complex(1.0, 0.0)
        for k in range((len(x) + block - 1) // block):
            if k % 64 == 0:  # or rounding would add up
                angle = omega * block * k
                phase = complex(np.cos(angle), np.sin(angle))
            u = 2.0 * (k + 0.5) / count - 1.0
            value = (fit[line, 0] + fit[line, 1] * u) * phase
            a, b = value.real, value.imag
            part = x[k * block : min((k + 1) * block, len(x))]
            for i in range(len(part)):
                part[i] -= a * cosine[i] - b * sine[i]
            phase *= turn
