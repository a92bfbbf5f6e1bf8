"""Logarithms, exponentials and sums of many numbers at once, in the processor's vector lanes.

Those of the system's library are called one by one. Here a number x = m 2^k, 1/2 <= m^2 < 2, has
its bits taken apart: ln x = k ln 2 + 2 artanh((m - 1) / (m + 1)), and exp x is the Taylor series of
x - k ln 2, at most half of ln 2, with k added to the bits of its exponent. Both are off by at most
two units in the last place. Numbers are added in any sequence.
"""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import njit
from ..signal.order_kernels import centre_of

fused = njit(nogil=True, error_model="numpy", fastmath={"contract"})
"""A kernel in which a product and a sum are rounded once: half as many instructions."""
reordered = njit(nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
"""The same, whose sums over a loop are added in any sequence, in lanes."""

FAINTEST = 1e-300  # energy whose reciprocal is finite
_MANTISSA = np.int64(52)  # bits
_ONE = np.int64(1023 << 52)  # bits of 1.0
_LEAST_M = np.float64(math.sqrt(0.5)).view(np.int64)
_WHOLE = 1.5 * 2.0**52  # beside which a number is rounded to a whole one, in its last bits
_WHOLE_BITS = np.float64(_WHOLE).view(np.int64)
_LOG2_E = 1.0 / math.log(2.0)
_LN2_HIGH = 6.93147180369123816490e-01  # ln 2 to 33 bits: times k it is exact
_LN2_LOW = 1.90821492927058770002e-10  # what that leaves
_SIGN, _BUT_SIGN = np.int64(63), np.int64(2**63 - 1)  # place of the sign, bits of all the rest
_LEAST = np.int64(-(2**63))
_LOWEST = -700.0  # exponentials of less are that of it, 1e-304


@fused
def logarithms(x):
    """Replace positive numbers by their natural logarithms; those below 1e-307 are not counted."""
    bits = x.view(np.int64)
    for i in range(np.uint64(len(x))):
        k = (bits[i] - _LEAST_M + _ONE) >> _MANTISSA
        m = np.int64(bits[i] - ((k - np.int64(1023)) << _MANTISSA)).view(np.float64)
        power = np.int64(k + _WHOLE_BITS).view(np.float64) - (_WHOLE + 1023.0)
        s = (m - 1.0) / (m + 1.0)
        z = s * s
        series = 1.0 / 19.0 + z * (1.0 / 21.0)
        series = 1.0 / 15.0 + z * (1.0 / 17.0 + z * series)
        series = 1.0 / 11.0 + z * (1.0 / 13.0 + z * series)
        series = 1.0 / 7.0 + z * (1.0 / 9.0 + z * series)
        series = z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * series))
        x[i] = power * _LN2_HIGH + (2.0 * s + (2.0 * s * series + power * _LN2_LOW))


@fused
def exponentials(x):
    """Replace numbers below 700 by their exponentials."""
    for i in range(np.uint64(len(x))):
        value = x[i] if x[i] > _LOWEST else _LOWEST
        shifted = value * _LOG2_E + _WHOLE
        power = shifted - _WHOLE
        r = value - power * _LN2_HIGH - power * _LN2_LOW
        series = 1.0 / 479001600.0 + r * (1.0 / 6227020800.0)
        series = 1.0 / 3628800.0 + r * (1.0 / 39916800.0 + r * series)
        series = 1.0 / 40320.0 + r * (1.0 / 362880.0 + r * series)
        series = 1.0 / 720.0 + r * (1.0 / 5040.0 + r * series)
        series = 1.0 / 24.0 + r * (1.0 / 120.0 + r * series)
        series = 0.5 + r * (1.0 / 6.0 + r * series)
        series = 1.0 + (r + r * r * series)
        bits = np.float64(series).view(np.int64)
        bits += np.float64(shifted).view(np.int64) << _MANTISSA
        x[i] = np.int64(bits).view(np.float64)


@njit(nogil=True)
def greatest_of(values):
    """The greatest of numbers, none of which is NaN.

    Bits of numbers, those of negative ones inverted but for the sign, are whole numbers in the same
    order, whose greatest is found in lanes.
    """
    bits, most = values.view(np.int64), _LEAST
    for i in range(np.uint64(len(bits))):
        most = max(most, np.int64(bits[i] ^ ((bits[i] >> _SIGN) & _BUT_SIGN)))
    return np.int64(most ^ ((most >> _SIGN) & _BUT_SIGN)).view(np.float64)


@njit(nogil=True, fastmath={"reassoc", "nsz"})
def sum_of(values):
    """Sum of numbers."""
    total = 0.0
    for i in range(np.uint64(len(values))):
        total += values[i]
    return total


@njit(nogil=True, fastmath={"reassoc", "nsz"})
def sum_of_squares(values):
    """Sum of their squares."""
    total = 0.0
    for i in range(np.uint64(len(values))):
        total += values[i] * values[i]
    return total


@reordered
def sum_of_products(values, others):
    """Sum of the products of numbers with the others, of which there may be more."""
    total = 0.0
    for i in range(np.uint64(len(values))):
        total += values[i] * others[i]
    return total


@fused
def median_energy(sounds, first, last):
    """Median over sounds (n, samples) of their energy from sample `first` to before `last`."""
    energy = np.empty(len(sounds))
    for i in range(len(sounds)):
        energy[i] = sum_of_squares(sounds[i, first:last])
    return centre_of(energy, len(energy))
