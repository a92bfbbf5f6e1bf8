"""Counter-based normal random numbers: a function of key and counter alone.

The generator is Philox4x32-10 [SalmonEtAl2011]_, the transformation Box and Muller's
[BoxMuller1958]_ with 53 bits for the radius, which reaches 8.6 standard deviations, and 53 for the
angle. Logarithm, sine and cosine are polynomials (fdlibm's, below one unit in the last place), so
that the loops are compiled to vector instructions, and give the same bits on every machine.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel

FORCE, BRIDGE, RUB, FORCE_ACROSS = range(4)  # what the numbers are for: a part of the counter
START = 0xFFFFF  # number of the pair that a path starts from
PI_4 = math.pi / 4
LN2 = math.log(2)
LOW = 0xFFFFFFFF
UPPER = 0xFFFFFFFE00000000
# Splits a double in (0, 1) so that the mantissa lies from sqrt(1/2) to sqrt(2).
LIFT = (0x3FF00000 - 0x3FE6A09E) << 32
FLOOR = 0x3FE6A09E << 32
MANTISSA = 0x000FFFFFFFFFFFFF


class Room(NamedTuple):
    """Work arrays for random numbers."""

    radius: np.ndarray  # uint64
    angle: np.ndarray  # uint64
    real: np.ndarray  # float64
    bits: np.ndarray  # the same as uint64
    pair: np.ndarray  # two normal numbers
    stack: np.ndarray  # shape (32, 3): parts of a step that are still to be looked at


def room(size: int) -> Room:
    """Allocate for `size` normal numbers, an even number."""
    real, words = np.empty(size // 2), np.empty((2, size // 2), np.uint64)
    return Room(words[0], words[1], real, real.view(np.uint64), np.empty(2), np.empty((32, 3)))


class Numbers(NamedTuple):
    """Normal numbers of a group of paths, with work arrays."""

    room: Room
    normal: np.ndarray  # shape (lanes, size)


def numbers(lanes: int, size: int) -> Numbers:
    """Allocate for `size` normal numbers of each of so many paths; `size` is even."""
    return Numbers(room(size), np.empty((lanes, size)))


@inlined
def answer(key, x0, x1, x2, x3):
    """Philox4x32-10 of one counter: words 0 and 1, and words 2 and 3."""
    low, half = np.uint64(LOW), np.uint64(32)
    k0, k1 = np.uint64(key[0]), np.uint64(key[1])
    for _ in range(10):
        p0, p1 = np.uint64(0xD2511F53) * x0, np.uint64(0xCD9E8D57) * x2
        x0, x1 = (p1 >> half) ^ x1 ^ k0, p1 & low
        x2, x3 = (p0 >> half) ^ x3 ^ k1, p0 & low
        k0 = (k0 + np.uint64(0x9E3779B9)) & low
        k1 = (k1 + np.uint64(0xBB67AE85)) & low
    return (x0 << half) | x1, (x2 << half) | x3


@inlined
def mix(key, c1, c3, left, right):
    """Philox outputs of the counters (left[i], c1, right[i], c3), in place."""
    for i in range(len(left)):
        left[i], right[i] = answer(key, left[i], np.uint64(c1), right[i], np.uint64(c3))


@kernel
def philox(key, first, c1, c2, c3, left, right):
    """Philox4x32-10 for the counters (first + i, c1, c2, c3): words 0, 1 and words 2, 3 of each."""
    for i in range(len(left)):
        left[i] = (np.uint64(first) + np.uint64(i)) & np.uint64(LOW)
        right[i] = c2
    mix(key, c1, c3, left, right)


@kernel
def philox_all(key, first, paths, c3, left, right):
    """The same for many paths: entry i * len(paths) + k is of counter first + i and path k."""
    lanes = len(paths)
    for i in range(len(left) // lanes):
        counter = (np.uint64(first) + np.uint64(i)) & np.uint64(LOW)
        for lane in range(lanes):
            left[i * lanes + lane] = counter
        for lane in range(lanes):
            right[i * lanes + lane] = paths[lane]
    mix(key, np.uint64(first) >> np.uint64(32), c3, left, right)


@inlined
def uniform(word):
    """Uniform number in (0, 1) from the 53 highest bits of a word."""
    return (np.float64(np.int64(word >> np.uint64(11))) + 0.5) * 2.0**-53


@inlined
def logarithm(power, mantissa):
    """-2 log of mantissa 2^(power - 1023), the mantissa from sqrt(1/2) to sqrt(2)."""
    exponent = np.float64(np.int64(power)) - 1023.0
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = 2.222219843214978396e-01 + w * 1.531383769920937332e-01
    even = w * (3.999999999940941908e-01 + w * even)
    odd = 1.818357216161805012e-01 + w * 1.479819860510658591e-01
    odd = 2.857142874366239149e-01 + w * odd
    odd = z * (6.666666666666735130e-01 + w * odd)
    square = 0.5 * f * f
    return -2.0 * (exponent * LN2 + (s * (square + even + odd) - square + f))


@inlined
def direction(word):
    """Cosine and sine of a random angle: 53 bits within an octant, 3 bits for the octant."""
    t = uniform(word) * PI_4
    z = t * t
    s = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    s = 2.75573137070700676789e-06 + z * s
    s = -1.98412698298579493134e-04 + z * s
    s = 8.33333333332248946124e-03 + z * s
    s = t + t * z * (-1.66666666666666324348e-01 + z * s)
    c = 2.08757232129817482790e-09 - z * 1.13596475577881948265e-11
    c = -2.75573143513906633035e-07 + z * c
    c = 2.48015872894767294178e-05 + z * c
    c = -1.38888888888741095749e-03 + z * c
    c = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * c)
    one, two = (s, c) if word & np.uint64(1) else (c, s)
    return -one if word & np.uint64(2) else one, -two if word & np.uint64(4) else two


@kernel
def logarithms(words, real, bits):
    """-2 log U for the uniform number U of each word, written to `real`; overwrites the words.

    One loop for each kind of operation: together they are not compiled to vector instructions.
    """
    n = len(words)
    for i in range(n):
        real[i] = uniform(words[i])
    for i in range(n):
        lifted = bits[i] + np.uint64(LIFT)
        words[i] = lifted >> np.uint64(52)
        bits[i] = (lifted & np.uint64(MANTISSA)) + np.uint64(FLOOR)
    for i in range(n):
        real[i] = logarithm(words[i], real[i])


@kernel
def normals(r, cosine, sine):
    """Two normal numbers for each pair of words in `r.radius` and `r.angle`."""
    n = len(cosine)
    angle, radius = r.angle, r.real
    logarithms(r.radius[:n], radius, r.bits)
    for i in range(n):
        radius[i] = math.sqrt(radius[i])
    for i in range(n):
        c, s = direction(angle[i])
        cosine[i] = radius[i] * c
        sine[i] = radius[i] * s


@kernel
def draw(r, key, path, block, out):
    """Fill `out` with the normal numbers of a block of a path's random force."""
    half = len(out) // 2
    first = np.uint64(block) * np.uint64(half)
    philox(key, first, first >> np.uint64(32), path, FORCE, r.radius, r.angle)
    normals(r, out[:half], out[half:])


@kernel
def draw_all(r, key, paths, block, purpose, out):
    """Fill `out`, shape (steps, lanes), with the normal numbers of many paths for a purpose.

    FORCE is for the noise, FORCE_ACROSS for the second component of one that oscillates.
    """
    half = len(out) // 2
    philox_all(key, np.uint64(block) * np.uint64(half), paths, purpose, r.radius, r.angle)
    flat = out.reshape(out.size)
    normals(r, flat[: len(r.radius)], flat[len(r.radius) :])


@kernel
def draw_coins(r, key, paths, block, out):
    """Fill `out`, shape (steps, lanes), with numbers for friction: -2 log U with a random sign.

    A number takes 32 bits: one for the sign, and 31 for U.
    """
    quarter, half = out.size // 4, out.size // 2
    first = np.uint64(block) * np.uint64(len(out) // 4)
    words, flat = r.radius, out.reshape(out.size)
    philox_all(key, first, paths, RUB, words[:quarter], words[quarter:])
    for part in range(2):
        for i in range(half):
            r.angle[i] = (words[i] << np.uint64(1)) & np.uint64(UPPER) | np.uint64(1 << 32)
        logarithms(r.angle, r.real, r.bits)
        for i in range(half):
            r.bits[i] |= words[i] & np.uint64(1 << 63)
            words[i] <<= np.uint64(32)
        for i in range(half):
            flat[part * half + i] = r.real[i]


@kernel
def draw_pair(r, key, path, step, number, out):
    """Fill `out` with a numbered pair of normal numbers within a step, for a bridge."""
    step, number = np.uint64(step), np.uint64(number)
    high = (step >> np.uint64(32)) << np.uint64(20) | number
    left, right = answer(key, step & np.uint64(LOW), high, np.uint64(path), np.uint64(BRIDGE))
    r.real[0] = uniform(left)
    lifted = r.bits[0] + np.uint64(LIFT)
    r.bits[0] = (lifted & np.uint64(MANTISSA)) + np.uint64(FLOOR)
    radius = math.sqrt(logarithm(lifted >> np.uint64(52), r.real[0]))
    c, s = direction(right)
    out[0], out[1] = radius * c, radius * s
