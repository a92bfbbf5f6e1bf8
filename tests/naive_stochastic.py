"""Slow readable twins of the stochastic kernels."""

from __future__ import annotations

import cmath
import math

import numpy as np

WORD = 0xFFFFFFFF


def philox(counter, key):
    """Philox4x32-10 of one counter of four words [SalmonEtAl2011]."""
    x0, x1, x2, x3 = counter
    k0, k1 = key
    for _ in range(10):
        p0, p1 = 0xD2511F53 * x0, 0xCD9E8D57 * x2
        x0, x1, x2, x3 = (p1 >> 32) ^ x1 ^ k0, p1 & WORD, (p0 >> 32) ^ x3 ^ k1, p0 & WORD
        k0, k1 = (k0 + 0x9E3779B9) & WORD, (k1 + 0xBB67AE85) & WORD
    return x0, x1, x2, x3


def pair(words):
    """Box and Muller's two normal numbers of four words."""
    left, right = words[0] << 32 | words[1], words[2] << 32 | words[3]
    radius = math.sqrt(-2 * math.log(((left >> 11) + 0.5) * 2.0**-53))
    angle = ((right >> 11) + 0.5) * 2.0**-53 * math.pi / 4
    c, s = math.cos(angle), math.sin(angle)
    if right & 1:
        c, s = s, c
    return radius * (-c if right & 2 else c), radius * (-s if right & 4 else s)


def normals(key, path, block, size=64, purpose=0):
    """A block of the normal numbers of a path."""
    both = [
        pair(philox((block * size // 2 + i, 0, path, purpose), [int(word) for word in key]))
        for i in range(size // 2)
    ]
    return np.concatenate(np.transpose(both))


def bridge_pair(key, path, step, number):
    """The pair of that number within a step."""
    return pair(philox((step, number, path, 1), [int(word) for word in key]))


def coins(key, path, block, size=64):
    """A block of a path's pairs for friction: -ln of a uniform number, and a sign."""
    drawn = [
        philox((block * size // 4 + i, 0, path, 2), [int(word) for word in key])
        for i in range(size // 4)
    ]
    words = [word for part in (0, 2, 1, 3) for word in np.transpose(drawn)[part].tolist()]
    return [(-math.log((word % 2**31 + 0.5) / 2**31), -1 if word >> 31 else 1) for word in words]


def rub(v, friction, h, deviation, noise, coin):
    """Velocity after v' = -friction sgn v + white noise over h: a reflected Brownian motion."""
    sign = math.copysign(1, v)
    size, end = abs(v), abs(v) - friction * h + sign * noise
    exponential, side = coin
    least = (size + end - math.sqrt((end - size) ** 2 + 2 * deviation**2 * exponential)) / 2
    if least > 0:
        return sign * end
    return math.copysign(end - least, side)


def filtered(sigma, tau, frequency, h, key, path, blocks):
    """A force of deviation sigma at 0, h, 2 h, ...: a complex number that turns and shrinks."""
    z = complex(*bridge_pair(key, path, 0, 0xFFFFF)) * sigma
    share = cmath.exp((-1 / tau + 1j * frequency) * h)
    fresh = sigma * math.sqrt(1 - abs(share) ** 2)
    out = [z.real]
    for block in range(blocks):
        one, other = normals(key, path, block), normals(key, path, block, purpose=3)
        for k in range(len(one)):
            z = share * z + fresh * complex(one[k], other[k])
            out.append(z.real)
    return np.array(out)


def split(
    force, deviation, noise, tossed, restitution, friction, x, v, h, key, path, times=lambda x: 1.0
):
    """The splitting of a unit mass above a rigid stop at 0: states at h, 2 h, ...

    `force` is a function of t, x and v, `noise` the normal numbers of the steps, `tossed` those for
    friction, `times` what the noise is multiplied by.
    """
    seen = []
    half = h / 4 * force(0.0, x, v)
    deviation, size = deviation * times(x), deviation
    kick = deviation / math.sqrt(2) * bridge_pair(key, path, 0, 0xFFFFF)[1]
    if friction:
        one, two = bridge_pair(key, path, 0, 0)
        coin = (one**2 + two**2) / 2, math.copysign(1, one)
        v = half + rub(v + half, friction, h / 2, deviation / math.sqrt(2), kick, coin)
    else:
        v += 2 * half + kick
    for step, number in enumerate(noise):
        # The flight, in which impacts are under the force at the stop.
        a = force((step + 0.5) * h, 0.0, 0.0)
        end, after, left, u = x + v * h, v, h, v - a * h / 2
        while end < 0:
            out = math.sqrt(max(u * u - 2 * a * x, 0.0))
            flight = 2 * x / (-u + out) if u < 0 else (out + u) / -a
            x, left = 0.0, left - flight
            u = restitution * out
            end = u * left + a * left**2 / 2
            if end < 0 and 2 * u < -a * (1 - restitution) * left:
                end = u = left = 0.0  # what is left of the rebounds ends within the step
            after = u + a * (left - h / 2)
        x, v = end, after

        deviation = size * times(x)
        t, kick = (step + 1) * h, deviation * number
        here = force(t, x, v)
        a = (here + force(t, x, v + h * here + kick)) / 2
        before = v + a * h / 2
        if friction:
            after = rub(before, friction, h, deviation, kick, tossed[step])
        else:
            after = before + kick
        v = after + a * h / 2
        middle = before if step % 2 else after
        pull = a - (math.copysign(friction, middle) if friction else 0)
        seen.append((abs(x + pull * h * h / 8), middle))
    return np.array(seen)
