"""Kernels that find and remove the lines of the mains."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import allocating, kernel, njit


@kernel
def mean_blocks(sums, counts, means, halved):
    """Means of blocks (0 for empty ones), and means of pairs of blocks."""
    for k in range(len(means)):
        means[k] = sums[k] / counts[k] if counts[k] > 0 else 0.0
    for k in range(len(halved)):
        halved[k] = 0.5 * (means[2 * k] + means[2 * k + 1])


# reassoc: sums of products run in lanes; BLAS would wake its threads for so few.
@njit(nogil=True, fastmath={"reassoc", "nsz"})
def stand_out(waves, means, times, least, times_loud, loud, out):
    """Amplitudes of lines, 0 for those that do not stand out.

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
    for k in range(n):
        line = _amplitude(waves, means, k)
        out[k] = 0.0
        if line > min(least, loud):  # the least that the limit can be
            below = _amplitude(waves, means, n + 2 * k)
            above = _amplitude(waves, means, n + 2 * k + 1)
            beside = max(below, above)
            if line > min(max(times * beside, least), max(times_loud * beside, loud)):
                out[k] = line


@njit(nogil=True, fastmath={"reassoc", "nsz"})
def _amplitude(waves, means, k):
    """Amplitude at the k-th frequency: the products of the means with two rows."""
    first, second = waves[k], waves[len(waves) // 2 + k]
    real = imaginary = 0.0
    for i in range(len(means)):
        real += first[i] * means[i]
        imaginary += second[i] * means[i]
    return np.hypot(real, imaginary)


@njit(nogil=True, fastmath={"reassoc", "nsz"})
def normal_equations(design, sums, counts, ridge, normal, right):
    """Normal equations of the design, for sums over blocks.

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


@allocating
def take_off(x, block, count, turns, fit):
    """Subtract the lines from x in place.

    Parameters
    ----------
    count : int
        Blocks of `block` samples that were fitted.
    turns : array (lines,)
        Frequencies in cycles a sample.
    fit : array (lines, 2) of complex
    """
    lines = len(turns)
    cosine, sine = np.empty((lines, block)), np.empty((lines, block))
    turn, phase = np.empty(lines, np.complex128), np.empty(lines, np.complex128)
    for line in range(lines):
        omega = 2.0 * np.pi * turns[line]
        for i in range(block):
            cosine[line, i], sine[line, i] = np.cos(omega * i), np.sin(omega * i)
        turn[line] = complex(np.cos(omega * block), np.sin(omega * block))
    for k in range((len(x) + block - 1) // block):
        part = x[k * block : min((k + 1) * block, len(x))]
        u = 2.0 * (k + 0.5) / count - 1.0
        for line in range(lines):
            if k % 64 == 0:  # or rounding would add up
                angle = 2.0 * np.pi * turns[line] * block * k
                phase[line] = complex(np.cos(angle), np.sin(angle))
            value = (fit[line, 0] + fit[line, 1] * u) * phase[line]
            a, b = value.real, value.imag
            for i in range(len(part)):
                part[i] -= a * cosine[line, i] - b * sine[line, i]
            phase[line] *= turn[line]
