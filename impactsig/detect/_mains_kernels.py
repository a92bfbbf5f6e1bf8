"""Kernels that look for the lines of the mains in a record, and take them off."""

from __future__ import annotations

import numpy as np

from .._compiled import njit


@njit(nogil=True)
def mean_blocks(sums, counts, means, halved):
    """Means of blocks, 0 of none, and the means of two of them each."""
    for k in range(len(means)):
        means[k] = sums[k] / counts[k] if counts[k] > 0 else 0.0
    for k in range(len(halved)):
        halved[k] = 0.5 * (means[2 * k] + means[2 * k + 1])


@njit(nogil=True)
def stand_out(parts, times, least, out):
    """Amplitudes of lines, 0 of those that do not stand out.

    Parameters
    ----------
    parts : array (6 n,)
        Real amplitudes: of n lines, then of what is below and above each; then the imaginary ones.
    times, least : float
        Times the stronger one beside it that a line must be, and its least amplitude.
    out : array (n,), filled
    """
    n = len(out)
    for k in range(n):
        line = np.hypot(parts[k], parts[3 * n + k])
        below = np.hypot(parts[n + 2 * k], parts[4 * n + 2 * k])
        above = np.hypot(parts[n + 2 * k + 1], parts[4 * n + 2 * k + 1])
        out[k] = line if line > max(times * max(below, above), least) else 0.0


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
