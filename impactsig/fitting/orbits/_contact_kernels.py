"""Contact with a soft stop that carries a spring and a damper: when it ends, and how fast.

In units of the gap and of 1 / omega_n the depth u obeys, while the stop is touched,

    u'' + 2 d u' + k u = A cos(omega t) - 1,    u(0) = 0,    u'(0) = v,

with k = 1 + stiffness and d the damping ratio plus half of the stop's damping, which is linear, so
that u is known; it ends where u is 0 again ("gap" of `KelvinVoigt`). The stop is given by its
stiffness and by the restitution coefficient of one free contact, ``exp(-pi b / sqrt(1 - b^2))``
with the damping ``2 b sqrt(stiffness)``.
"""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import njit

kernel = njit(nogil=True, error_model="numpy")

TURN = 2 * math.pi
MOVED = (0, 1, 2, 3, 6)  # parameters that a contact depends on, besides the phase
EXTRA = 5  # place of the logarithm of the stiffness
STEP = 1e-6  # of their differences
NONE = np.zeros((0, 6))
ITERATIONS, CLOSE = 12, 1e-13
LEAST = 1e-3  # of the velocity at the end, that is divided by


def contacts(theta: np.ndarray) -> np.ndarray:
    """What `bounce` needs, at parameters and a `STEP` up and down in each of `MOVED`.

    `theta`: restitution; logarithms of damping, amplitude, natural frequency; the phase, which is
    not used; the logarithm of the stiffness.
    """
    rows = [_row(theta)]
    for place in (0, 1, 2, 3, EXTRA):
        for step in (STEP, -STEP):
            moved = np.array(theta, float)
            moved[place] += step
            rows.append(_row(moved))
    return np.array(rows)


def _row(theta: np.ndarray) -> list[float]:
    omega, stiffness = math.exp(-theta[3]), math.exp(theta[EXTRA])
    loss = -math.log(max(theta[0], 1e-12))
    d = math.exp(theta[1]) + loss / math.hypot(math.pi, loss) * math.sqrt(stiffness)
    k = 1 + stiffness
    response = math.exp(theta[2]) / (k - omega**2 + 2j * d * omega)
    return [d, math.sqrt(max(k - d * d, 1e-12)), omega, response.real, response.imag, k]


@kernel
def bounce(row, angle, v):
    """Duration of a contact in forcing periods, velocity at its end, and their derivatives.

    Those of both by the phase of the forcing `angle` at which it begins, then by its velocity `v`.
    """
    d, root, omega, response, k = row[0], row[1], row[2], complex(row[3], row[4]), row[5]
    at0 = response * complex(math.cos(angle), math.sin(angle))
    z, w = 1 / k - at0.real, v + omega * at0.imag
    h = math.pi / root
    at1, s, ds, depth, speed, pull = at0, 0.0, 0.0, 0.0, -LEAST, 0.0
    for _ in range(ITERATIONS):
        turn = angle + omega * h
        at1 = response * complex(math.cos(turn), math.sin(turn))
        decay = math.exp(-d * h)
        s = decay * math.sin(root * h) / root
        c = decay * math.cos(root * h) + d * s
        ds = c - 2 * d * s
        depth = at1.real - 1 / k + c * z + s * w
        speed = -omega * at1.imag - k * s * z + ds * w
        pull = -omega * omega * at1.real - k * ds * z + (-k * s - 2 * d * ds) * w
        if speed > -LEAST:
            speed = -LEAST
        step = depth / speed
        h -= min(max(step, -0.5 * h), 0.5 * h)
        if abs(step) < CLOSE:
            break
    turned = -at1.imag + c * at0.imag + s * omega * at0.real
    turned_speed = -omega * at1.real - k * s * at0.imag + ds * omega * at0.real
    unit = omega / TURN
    late_turn, late_v = -turned / speed, -s / speed
    return (
        unit * h, speed, unit * late_turn, turned_speed + pull * late_turn,
        unit * late_v, ds + pull * late_v,
    )  # fmt: skip
