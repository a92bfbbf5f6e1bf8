"""Least-squares orbit through measured instants and strengths, by Gauss-Newton.

Between impacts the flow is known. An orbit has at every impact an instant tau, in forcing periods,
and an approach velocity v; a leg from one impact to the next is off by

    g_1 = p_1 + C z + S w - 1,    g_2 = p'_1 - S z + (C - 2 zeta S) w - v_1,

with p the forced response, z = 1 - p_0 and w = -r v_0 - p'_0 the free motion after the impact: the
position and the velocity that the flow has at the second instant, less those of an impact. A second
stop, on the other side, is at -far in place of 1; from a soft one the flight begins where the
contact ends (`_contact_kernels`). With
measured instants x and strengths s of noise sigma_t and sigma_v s, the orbit is where

    sum (x - tau)^2 / sigma_t^2 + (s / c - v)^2 / (sigma_v s / c)^2 + |g|^2 / slack^2

is least; as the slack vanishes it obeys the oscillator. No root is sought and nothing is divided by
a velocity, so weak impacts do no harm; a missed or spurious impact harms two legs at most. The
normal matrix is block tridiagonal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import njit
from ._contact_kernels import MOVED, STEP, TURN, bounce

kernel = njit(nogil=True, error_model="numpy")

STRENGTH, OWN = 5, 6
"""After restitution coefficient, logarithms of damping, amplitude and natural frequency, and phase:
the logarithms of the strength of an impact of velocity 1, and of what only one kind of machine has,
the position of a second stop or the stiffness of a soft one."""
PARAMETERS = OWN + 1
FARTHEST = 3.0  # sigma_t that an instant moves in one iteration
FASTEST, LEAST = 0.5, 0.05  # share of a velocity that it moves by, and the least bound of that


class Machine(NamedTuple):
    """The oscillator in units of its gap and of 1 / omega_n."""

    restitution: float
    damping: float
    root: float  # sqrt(1 - damping^2)
    frequency: float  # of the forcing
    phase: float  # of the forcing where the instants are 0
    response: complex
    by_damping: complex  # derivatives of the response
    by_frequency: complex
    far: float  # the second stop is at -far
    contact: np.ndarray  # `_contact_kernels.contacts`; without rows the stops are rigid


class Noise(NamedTuple):
    """Standard deviations of the measured quantities."""

    instant: float  # forcing periods
    strength: float  # share


class Smoothed(NamedTuple):
    """Result of fitting the orbit."""

    objective: float
    squares: np.ndarray  # of instants, and of strengths as shares: sums over joined impacts
    freedom: np.ndarray  # what these would be on average if the noise were 1
    release: np.ndarray  # by what each leg's release would lower the objective, shape (n - 1,)


@kernel
def leg(machine, s0, t0, v0, s1, t1, v1, off, slopes, full):
    """Residual of a flight between two impacts, and its derivatives.

    `s0` and `s1` are the sides that these are on, 1 or -1. `off`, shape (2, 5): derivatives by t0,
    v0, t1, v1, then the misfit itself. `slopes`, shape (2, PARAMETERS), if `full`: derivatives by
    the parameters.
    """
    r, zeta, root, omega = machine.restitution, machine.damping, machine.root, machine.frequency
    unit = TURN / omega
    from0, to1 = (1.0 if s0 > 0 else -machine.far), (1.0 if s1 > 0 else -machine.far)
    soft, begin, away = machine.contact.shape[0] > 0, t0, -r * s0 * v0
    late_turn = away_turn = late_v = away_v = 0.0
    if soft:
        late, away, late_turn, away_turn, late_v, away_v = bounce(
            machine.contact[0], TURN * t0 + machine.phase, v0
        )
        begin += late
    h = unit * (t1 - begin)
    angle = TURN * begin + machine.phase
    turn0 = complex(math.cos(angle), math.sin(angle))
    angle = TURN * t1 + machine.phase
    turn1 = complex(math.cos(angle), math.sin(angle))
    r0, r1 = machine.response * turn0, machine.response * turn1
    p0, q0, p1, q1 = r0.real, -omega * r0.imag, r1.real, -omega * r1.imag
    z, w = from0 - p0, away - q0
    decay = math.exp(-zeta * h)
    swing = decay * math.cos(root * h)
    s = decay * math.sin(root * h) / root
    c = swing + zeta * s
    ds = c - 2 * zeta * s
    dds = -s - 2 * zeta * ds
    speed, change = -s * z + ds * w, -ds * z + dds * w  # of the free motion
    a0, a1 = omega * omega * p0, omega * omega * p1
    begin0 = unit * (-c * q0 + s * a0 - speed)
    begin1 = unit * (s * q0 + ds * a0 - change)
    if soft:
        off[0, 0] = begin0 * (1 + TURN * late_turn) + s * TURN * away_turn
        off[1, 0] = begin1 * (1 + TURN * late_turn) + ds * TURN * away_turn
        off[0, 1], off[1, 1] = begin0 * late_v + s * away_v, begin1 * late_v + ds * away_v
    else:
        off[0, 0], off[1, 0] = begin0, begin1
        off[0, 1], off[1, 1] = -r * s0 * s, -r * s0 * ds
    off[0, 2], off[1, 2] = unit * (q1 + speed), unit * (change - a1)
    off[0, 3], off[1, 3] = 0.0, -s1
    off[0, 4], off[1, 4] = p1 + c * z + s * w - to1, q1 + speed - s1 * v1
    if not full:
        return
    slopes[0, 0], slopes[1, 0] = -s * s0 * v0, -ds * s0 * v0
    s_zeta = -h * s - zeta / (root * root) * (h * swing - s)
    c_zeta = -h * swing + h * zeta * s + s + zeta * s_zeta
    ds_zeta = c_zeta - 2 * s - 2 * zeta * s_zeta
    d0, d1 = machine.by_damping * turn0, machine.by_damping * turn1
    dp, dq = d0.real, -omega * d0.imag
    slopes[0, 1] = zeta * (d1.real - c * dp - s * dq + c_zeta * z + s_zeta * w)
    slopes[1, 1] = zeta * (-omega * d1.imag + s * dp - ds * dq - s_zeta * z + ds_zeta * w)
    slopes[0, 2], slopes[1, 2] = p1 - c * p0 - s * q0, q1 + s * p0 - ds * q0
    d0, d1 = machine.by_frequency * turn0, machine.by_frequency * turn1
    dp, dq, dh = d0.real, -omega * d0.imag - r0.imag, -h / omega
    slopes[0, 3] = -omega * (d1.real - c * dp - s * dq + speed * dh)
    slopes[1, 3] = -omega * (-omega * d1.imag - r1.imag + s * dp - ds * dq + change * dh)
    dp, dq = -r0.imag, -omega * r0.real
    slopes[0, 4], slopes[1, 4] = -r1.imag - c * dp - s * dq, -omega * r1.real + s * dp - ds * dq
    here = (0.0 if s0 > 0 else -machine.far), (0.0 if s1 > 0 else -machine.far)
    slopes[0, OWN], slopes[1, OWN] = c * here[0] - here[1], -s * here[0]
    if soft:
        slopes[0, 0] = slopes[1, 0] = 0.0
        slopes[0, 4] += begin0 * late_turn + s * away_turn
        slopes[1, 4] += begin1 * late_turn + ds * away_turn
        for n in range(len(MOVED)):
            more = bounce(machine.contact[1 + 2 * n], TURN * t0 + machine.phase, v0)
            less = bounce(machine.contact[2 + 2 * n], TURN * t0 + machine.phase, v0)
            late, away = (more[0] - less[0]) / (2 * STEP), (more[1] - less[1]) / (2 * STEP)
            slopes[0, MOVED[n]] += begin0 * late + s * away
            slopes[1, MOVED[n]] += begin1 * late + ds * away


@kernel
def _assemble(machine, scale, noise, slack, seen, joined, node, matrix, beside, right, legs, own):
    """Assemble the normal equations; returns the objective.

    `right` has -J^T residual in its first column and, where it has more, -J^T times the derivatives
    by the parameters; `own` then gets the products of these derivatives with each other, and with
    the residual in its last column.
    """
    n = len(node)
    full = right.shape[2] > 1
    slopes = np.zeros((2, PARAMETERS))
    weight = 1 / (slack * slack)
    instant = 1 / noise.instant**2
    objective = 0.0
    own[:] = 0
    matrix[:] = 0
    right[:] = 0
    for k in range(n):
        strength = 1 / (noise.strength * seen[k, 2] / scale) ** 2
        early, hard = seen[k, 0] - node[k, 0], seen[k, 1] / scale - node[k, 1]
        matrix[k, 0, 0], matrix[k, 1, 1] = instant, strength
        right[k, 0, 0], right[k, 1, 0] = instant * early, strength * hard
        objective += instant * early**2 + strength * hard**2
        if full:  # the residual is (s - c v) / (c * ...): its derivative by log c is -v / ...
            right[k, 1, 1 + STRENGTH] = -strength * node[k, 1]
            own[STRENGTH, STRENGTH] += strength * node[k, 1] ** 2
            own[STRENGTH, PARAMETERS] -= strength * node[k, 1] * hard
    for k in range(n - 1):
        if not joined[k]:
            continue
        off = legs[k]
        leg(
            machine, seen[k, 3], node[k, 0], node[k, 1],
            seen[k + 1, 3], node[k + 1, 0], node[k + 1, 1], off, slopes, full,
        )  # fmt: skip
        for m in range(2):
            objective += weight * off[m, 4] ** 2
            for i in range(2):
                for j in range(2):
                    matrix[k, i, j] += weight * off[m, i] * off[m, j]
                    matrix[k + 1, i, j] += weight * off[m, 2 + i] * off[m, 2 + j]
                right[k, i, 0] -= weight * off[m, i] * off[m, 4]
                right[k + 1, i, 0] -= weight * off[m, 2 + i] * off[m, 4]
        for i in range(2):
            for j in range(2):
                beside[k, i, j] = weight * (off[0, i] * off[0, 2 + j] + off[1, i] * off[1, 2 + j])
        if not full:
            continue
        for m in range(2):
            for j in range(PARAMETERS):
                for i in range(2):
                    right[k, i, 1 + j] -= weight * off[m, i] * slopes[m, j]
                    right[k + 1, i, 1 + j] -= weight * off[m, 2 + i] * slopes[m, j]
                for i in range(PARAMETERS):
                    own[i, j] += weight * slopes[m, i] * slopes[m, j]
                own[j, PARAMETERS] += weight * slopes[m, j] * off[m, 4]
    return objective


@kernel
def _eliminate(matrix, beside, right, joined, inverse):
    """Forward elimination in place; `inverse` receives the inverted diagonal blocks."""
    n = len(matrix)
    for k in range(n):
        one, both, other = matrix[k, 0, 0], matrix[k, 0, 1], matrix[k, 1, 1]
        det = one * other - both * both
        inverse[k, 0, 0], inverse[k, 1, 1] = other / det, one / det
        inverse[k, 0, 1] = inverse[k, 1, 0] = -both / det
        if k == n - 1 or not joined[k]:
            continue
        for i in range(2):
            m0 = beside[k, 0, i] * inverse[k, 0, 0] + beside[k, 1, i] * inverse[k, 1, 0]
            m1 = beside[k, 0, i] * inverse[k, 0, 1] + beside[k, 1, i] * inverse[k, 1, 1]
            for j in range(2):
                matrix[k + 1, i, j] -= m0 * beside[k, 0, j] + m1 * beside[k, 1, j]
            for j in range(right.shape[2]):
                right[k + 1, i, j] -= m0 * right[k, 0, j] + m1 * right[k, 1, j]


@kernel
def _move(inverse, beside, right, joined, noise, node):
    """Back substitution; updates the orbit and returns the largest change, in sigma_t."""
    n = len(node)
    farthest = d0 = d1 = 0.0
    for k in range(n - 1, -1, -1):
        b0, b1 = right[k, 0, 0], right[k, 1, 0]
        if k < n - 1 and joined[k]:
            b0 -= beside[k, 0, 0] * d0 + beside[k, 0, 1] * d1
            b1 -= beside[k, 1, 0] * d0 + beside[k, 1, 1] * d1
        d0 = inverse[k, 0, 0] * b0 + inverse[k, 0, 1] * b1
        d1 = inverse[k, 1, 0] * b0 + inverse[k, 1, 1] * b1
        farthest = max(farthest, abs(d0) / noise.instant)
        bound = FARTHEST * noise.instant
        node[k, 0] += min(max(d0, -bound), bound)
        bound = max(FASTEST * abs(node[k, 1]), LEAST)
        node[k, 1] += min(max(d1, -bound), bound)
    return farthest


@kernel
def _judge(scale, noise, slack, seen, joined, node, inverse, beside, legs, result):
    """Sums of squares, degrees of freedom and releases, from the inverse near the diagonal."""
    n = len(node)
    spread, cross, late = np.empty((2, 2)), np.empty((2, 2)), inverse[n - 1].copy()
    gain, cov = np.empty((2, 2)), np.empty((2, 2))
    for k in range(n - 1, -1, -1):
        before = k > 0 and joined[k - 1]
        after = k < n - 1 and joined[k]
        spread[:] = inverse[k]
        if after:
            off = legs[k]
            for i in range(2):
                for j in range(2):
                    gain[i, j] = inverse[k, i, 0] * beside[k, 0, j]
                    gain[i, j] += inverse[k, i, 1] * beside[k, 1, j]
            for i in range(2):
                for j in range(2):
                    cross[i, j] = -gain[i, 0] * late[0, j] - gain[i, 1] * late[1, j]
            for i in range(2):
                for j in range(2):
                    spread[i, j] -= cross[i, 0] * gain[j, 0] + cross[i, 1] * gain[j, 1]
            for i in range(2):
                for j in range(2):
                    known = 0.0
                    for a in range(2):
                        for b in range(2):
                            known += off[i, a] * spread[a, b] * off[j, b]
                            known += off[i, 2 + a] * late[a, b] * off[j, 2 + b]
                            known += off[i, a] * cross[a, b] * off[j, 2 + b]
                            known += off[i, 2 + b] * cross[a, b] * off[j, a]
                    cov[i, j] = -known
                cov[i, i] += slack * slack
            det = cov[0, 0] * cov[1, 1] - cov[0, 1] ** 2
            lower = off[0, 4] ** 2 * cov[1, 1] + off[1, 4] ** 2 * cov[0, 0]
            lower -= 2 * off[0, 4] * off[1, 4] * cov[0, 1]
            # Where rounding has eaten the determinant, nothing is left that the leg would explain.
            result.release[k] = lower / det if det > 0 and lower >= 0 else np.inf
        if before or after:
            size = seen[k, 2] / scale
            result.squares[0] += (seen[k, 0] - node[k, 0]) ** 2
            result.squares[1] += ((seen[k, 1] / scale - node[k, 1]) / size) ** 2
            result.freedom[0] += 1 - spread[0, 0] / noise.instant**2
            result.freedom[1] += 1 - spread[1, 1] / (noise.strength * size) ** 2
        late[:] = spread


@kernel
def smooth(machine, scale, noise, slack, seen, joined, node, most, close):
    """Move an orbit to its least-squares fit.

    Parameters
    ----------
    machine : Machine
    scale : float
        Strength of an impact of velocity 1.
    noise : Noise
    slack : float
        Of every leg, in gaps and in gaps times omega_n.
    seen : ndarray, shape (n, 4)
        Instants in forcing periods, strengths, what the noise of these is a share of, and the side
        of the stop, 1 or -1.
    joined : ndarray of bool, shape (n - 1,)
        Which legs count.
    node : ndarray, shape (n, 2)
        The orbit: instants and approach velocities. Changed in place.
    most : int
        Iterations.
    close : float
        Farthest move, in sigma_t, at which they end.

    Returns
    -------
    Smoothed
    """
    n = len(node)
    matrix, beside, inverse = np.empty((n, 2, 2)), np.zeros((n, 2, 2)), np.empty((n, 2, 2))
    legs = np.zeros((n, 2, 5))
    own = np.zeros((PARAMETERS, PARAMETERS + 1))
    right = np.empty((n, 2, 1))
    for _ in range(most):
        _assemble(
            machine, scale, noise, slack, seen, joined, node, matrix, beside, right, legs, own
        )
        _eliminate(matrix, beside, right, joined, inverse)
        if _move(inverse, beside, right, joined, noise, node) < close:
            break
    objective = _assemble(
        machine, scale, noise, slack, seen, joined, node, matrix, beside, right, legs, own
    )
    _eliminate(matrix, beside, right, joined, inverse)
    result = Smoothed(objective, np.zeros(2), np.zeros(2), np.zeros(n - 1))
    _judge(scale, noise, slack, seen, joined, node, inverse, beside, legs, result)
    return result


@kernel
def project(machine, scale, noise, slack, seen, joined, node):
    """Derivatives of the objective by the parameters, with the orbit eliminated.

    Returns
    -------
    gradient : ndarray, shape (PARAMETERS,)
        Half of that of the objective, where the orbit is nearest.
    information : ndarray, shape (PARAMETERS, PARAMETERS)
    """
    n = len(node)
    matrix, beside, inverse = np.empty((n, 2, 2)), np.zeros((n, 2, 2)), np.empty((n, 2, 2))
    legs = np.zeros((n, 2, 5))
    own = np.zeros((PARAMETERS, PARAMETERS + 1))
    right = np.empty((n, 2, 1 + PARAMETERS))
    _assemble(machine, scale, noise, slack, seen, joined, node, matrix, beside, right, legs, own)
    _eliminate(matrix, beside, right, joined, inverse)
    gradient = own[:, PARAMETERS].copy()
    information = own[:, :PARAMETERS].copy()
    for k in range(n):
        for a in range(2):
            for b in range(2):
                for i in range(PARAMETERS):
                    part = right[k, a, 1 + i] * inverse[k, a, b]
                    gradient[i] -= part * right[k, b, 0]
                    for j in range(PARAMETERS):
                        information[i, j] -= part * right[k, b, 1 + j]
    return gradient, information
