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


# reassoc: sums of products run in lanes; BLAS would wake its threads for so few.
@njit(nogil=True, fastmath={"reassoc", "nsz"})
def stand_out(waves, means, times, least, times_loud, loud, out):
    """Amplitudes of lines, 0 of those that do not stand out.

    Parameters
    ----------
    waves : array (6 n, b)
        Rows whose products with the b means are real amplitudes: of n lines, then of what is below
        and above each; then the imaginary ones.
    times, least : float
        Times the stronger one beside it that a line must be, and its least amplitude.
    times_loud, loud : float
        The same of a line that need not stand out as much, for being loud.
    out : array (n,), filled
    """
    n = len(out)
    parts = np.empty(6 * n)
    for k in range(6 * n):
        row, total = waves[k], 0.0
        for i in range(len(means)):
            total += row[i] * means[i]
        parts[k] = total
    for k in range(n):
        line = np.hypot(parts[k], parts[3 * n + k])
        below = np.hypot(parts[n + 2 * k], parts[4 * n + 2 * k])
        above = np.hypot(parts[n + 2 * k + 1], parts[4 * n + 2 * k + 1])
        beside = max(below, above)
        limit = min(max(times * beside, least), max(times_loud * beside, loud))
        out[k] = line if line > limit else 0.0


@njit(nogil=True, fastmath={"reassoc", "nsz"})
def normal_equations(design, sums, counts, ridge, normal, right):
    """Fill the normal matrix, and what it is to give, for sums of so many samples a block.

    Parameters
    ----------
    design : array (p, b)
    sums, counts : arrays (b,)
    ridge : float
        Of the mean of its diagonal, what is added to that of the matrix.
    normal, right : arrays (p, p) and (p,), filled
    """
    trace = 0.0
    weighted = np.empty(len(sums))
    for i in range(len(design)):
        row = design[i]
        total = 0.0
        for k in range(len(sums)):
            weighted[k] = row[k] * counts[k]
        for k in range(len(sums)):
            total += row[k] * sums[k]
        right[i] = total
        for j in range(i + 1):
            other = design[j]
            total = 0.0
            for k in range(len(sums)):
                total += weighted[k] * other[k]
            normal[i, j] = normal[j, i] = total
        trace += normal[i, i]
    for i in range(len(design)):
        normal[i, i] += ridge * trace / len(design)


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
