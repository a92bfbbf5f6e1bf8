"""Contacts of linear motions that cannot be missed, and impacts of whole machines in many digits.

Everything is told by the distance to the one boundary that matters: the gap to a stop, or the depth
in a soft one. Both are linear motions ``y'' + c y' + k y = load + a cos(omega t) + b sin(omega t)``
that start at y >= 0 and end where they come to 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import mpmath as mp
from numba import njit

NONE, CONTACT, UNDECIDED = range(3)


def coefficients(k, c, load, a, b, omega, phase, y, v, number=mp.mpf):
    """y = rest + p cos(phase + omega t) + q sin(...) + e^(-delta t)(f cos(nu t) + g sin(nu t)).

    Underdamped motions only. `number` is mp.mpf for as many digits as mpmath has, or float.
    """
    lib = mp if number is mp.mpf else math
    k, c, load, a, b, omega = (number(value) for value in (k, c, load, a, b, omega))
    delta = c / 2
    nu = lib.sqrt(k - delta**2)
    size = (k - omega**2) ** 2 + (c * omega) ** 2
    p = (a * (k - omega**2) - b * c * omega) / size
    q = (b * (k - omega**2) + a * c * omega) / size
    rest = load / k
    f = y - rest - p * lib.cos(phase) - q * lib.sin(phase)
    g = (v - omega * (q * lib.cos(phase) - p * lib.sin(phase)) + delta * f) / nu
    return rest, p, q, delta, nu, f, g


@njit
def moved(p, q, delta, nu, f, g, omega, phase, t):
    """y(t) - y(0), y'(t) and a bound of the rounding error of the first.

    Sums of terms that all vanish with t: no digit is lost for short times.
    """
    angle = phase + omega * t / 2
    half = math.sin(omega * t / 2)
    forced = -2 * half * (p * math.sin(angle) - q * math.cos(angle))
    co, si, lost = math.cos(nu * t), math.sin(nu * t), math.expm1(-delta * t)
    free = lost * (f * co + g * si) - 2 * f * math.sin(nu * t / 2) ** 2 + g * si
    speed = omega * (q * math.cos(angle + omega * t / 2) - p * math.sin(angle + omega * t / 2))
    speed += (1 + lost) * ((g * nu - delta * f) * co - (f * nu + delta * g) * si)
    swing = min(omega * t, 2.0) * (abs(p) + abs(q))
    swing += (min(delta * t, 1.0) + min(nu * t, 2.0)) * (abs(f) + abs(g))
    return forced + free, speed, 2e-15 * swing


@njit
def first_zero(known, omega, phase, y, v, end):
    """Whether y comes to 0 before `end`: NONE, CONTACT or UNDECIDED; and where, as a bracket.

    Marches in cells of which each is certified free of zeros: over a cell of width h,
    y >= min(y at both ends) - M h^2 / 8, with M >= |y''| from the cell's start on. Cells that fail
    are halved. What stops the march is a y as small as its rounding error; there, a y' that no
    |y''| within M can turn before y changes sign proves the zero. Where y' is too small for that,
    rounding decides whether the motion touches. A start at y = 0 with v > 0 leaves it, and cannot
    be back before 2 v / M.
    """
    _rest, p, q, delta, nu, f, g = known
    forced = omega**2 * math.hypot(p, q)
    free = (nu**2 + delta**2) * math.hypot(f, g)
    far = 0.5 / max(omega, nu, delta)
    low, least = 0.0, y
    if y == 0:
        low = v / (forced + free)
        d, _speed, error = moved(p, q, delta, nu, f, g, omega, phase, low)
        least = y + d - error
    h = far
    while low < end:
        most = 1.0000001 * (forced + free * math.exp(-delta * low))
        high = min(low + h, end)
        h = high - low
        d, _speed, error = moved(p, q, delta, nu, f, g, omega, phase, high)
        after = y + d - error
        if min(least, after) > most * h * h / 8:
            low, least = high, after
            h = min(2 * h, far)
            continue
        d, speed, error = moved(p, q, delta, nu, f, g, omega, phase, low)
        small = 8 * error + 4e-16 * y
        if y + d <= small or h < 4e-16 * low:
            width = 4 * (abs(y + d) + small) / abs(speed) if speed < 0 else math.inf
            if most * width < abs(speed):
                return CONTACT, max(low - width, 0.0), low + width
            return UNDECIDED, low, low
        h /= 2
    return NONE, end, end


def first_contact(zeta, amplitude, omega, phase, x, v, *, end):
    """`first_zero` for the gap of x'' + 2 zeta x' + x = amplitude cos(phase + omega t) to 1."""
    known = coefficients(1, 2 * zeta, 1, -amplitude, 0, omega, phase, 1 - x, -v, float)
    return first_zero(known, omega, phase, 1 - x, -v, end)


@dataclass(frozen=True)
class Machine:
    """y'' + damping y' + stiffness y = load + cosine cos(omega t) + sine sin(omega t) -+ friction.

    y is the gap to the one stop, so that it is hit at y = 0 with y' < 0. A rigid stop has a
    `restitution`; a soft one a stiffness and a damping, and is left at y = 0. Friction is static
    and kinetic alike.
    """

    stiffness: float
    damping: float
    load: float
    cosine: float
    sine: float
    omega: float
    restitution: float | None = None
    stop_stiffness: float = 0.0
    stop_damping: float = 0.0
    friction: float = 0.0

    def push(self, angle):
        """Load and forcing."""
        return self.load + self.cosine * mp.cos(angle) + self.sine * mp.sin(angle)


def one_sided(zeta, amplitude, omega, **stop):
    """The machine x'' + 2 zeta x' + x = amplitude cos(omega t), x < 1."""
    return Machine(1, 2 * zeta, 1, -amplitude, 0, omega, **stop)


def impacts(machine, count, *, gap=1, v=0, digits=40):
    """Instants and approach velocities of the first impacts, in `digits` digits, from t = 0."""
    with mp.workdps(digits):
        number = {
            name: None if value is None else mp.mpf(value) for name, value in vars(machine).items()
        }
        machine = replace(machine, **number)
        t, y, v = mp.mpf(0), mp.mpf(gap), mp.mpf(v)
        side = 1  # -1 in contact with a soft stop: side * y is the distance to its surface
        found = []
        while True:
            stiffness = machine.stiffness + (machine.stop_stiffness if side < 0 else 0)
            damping = machine.damping + (machine.stop_damping if side < 0 else 0)
            if machine.friction and v == 0:
                t, y, v = _set_off(machine, t, y, stiffness, damping)
            rub = -machine.friction * mp.sign(v)
            phase = mp.fmod(machine.omega * t, 2 * mp.pi)
            load, a, b, omega = machine.load + rub, machine.cosine, machine.sine, machine.omega
            gap_motion = (stiffness, damping, side * load, side * a, side * b, omega, phase,
                          side * y, side * v)  # fmt: skip
            kind, tau = _zero(gap_motion)
            stops = False
            if machine.friction:
                way = mp.sign(v)
                pull = machine.push(phase) + rub - stiffness * y - damping * v
                speed_motion = (stiffness, damping, 0, way * b * omega, -way * a * omega, omega,
                                phase, abs(v), way * pull)  # fmt: skip
                other, earlier = _zero(speed_motion)
                if other == CONTACT and (kind != CONTACT or earlier < tau):
                    kind, tau, stops = other, earlier, True
            if kind != CONTACT or t > 1e4:
                raise ValueError("no more impacts")
            place, speed = _state(gap_motion, tau)
            t, y, v = t + tau, side * place, side * speed
            if stops:
                v = mp.mpf(0)
                continue
            y = mp.mpf(0)
            if side > 0:
                found.append((t, -v))
                if len(found) == count:
                    return [t for t, _ in found], [v for _, v in found]
            if machine.restitution is None:
                side = -side
            else:
                v = -machine.restitution * v


def _state(motion, tau):
    rest, p, q, delta, nu, f, g = coefficients(*motion)
    omega, phase = motion[5], motion[6]
    angle, decay = phase + omega * tau, mp.exp(-delta * tau)
    co, si = mp.cos(nu * tau), mp.sin(nu * tau)
    place = rest + p * mp.cos(angle) + q * mp.sin(angle) + decay * (f * co + g * si)
    speed = omega * (q * mp.cos(angle) - p * mp.sin(angle))
    return place, speed + decay * ((g * nu - delta * f) * co - (f * nu + delta * g) * si)


def _zero(motion, end=200.0):
    """`first_zero`, polished by Newton's method in all digits."""
    known = tuple(float(value) for value in coefficients(*motion))
    omega, phase, y, v = (float(value) for value in motion[5:])
    kind, low, high = first_zero(known, omega, phase, y, v, end)
    if kind == UNDECIDED:
        raise ValueError("a contact that rounding decides about")
    tau = mp.mpf(low + high) / 2
    for _ in range(6 if kind == CONTACT else 0):
        place, speed = _state(motion, tau)
        tau -= place / speed
    return kind, tau


def _set_off(machine, t, y, stiffness, damping):
    """A moment after friction no longer holds a mass at rest, which is at once or later."""
    swing = mp.hypot(machine.cosine, machine.sine)
    lag = mp.atan2(machine.sine, machine.cosine)
    angle = machine.omega * t
    pull = machine.push(angle) - stiffness * y
    if abs(pull) <= machine.friction:
        turns = []
        for way in (1, -1):  # swing cos(angle - lag) = its limit, on its way beyond
            share = (stiffness * y - machine.load + way * machine.friction) / swing
            if abs(share) < 1:
                turns.append(((lag - way * mp.acos(share) - angle) % (2 * mp.pi), way))
        if not turns:
            raise ValueError("held for ever")
        wait, way = min(turns)
        t += wait / machine.omega
    else:
        way = mp.sign(pull)
    load, phase = machine.load - way * machine.friction, mp.fmod(machine.omega * t, 2 * mp.pi)
    moment = mp.mpf(1e-6) / machine.omega
    y, v = _state((stiffness, damping, load, machine.cosine, machine.sine, machine.omega, phase,
                   y, mp.mpf(0)), moment)  # fmt: skip
    assert way * v > 0
    return t + moment, y, v


def one_impact_orbit(zeta, amplitude, omega, restitution, digits=40):
    """Approach velocity and forcing phase of the orbit with one impact a period, in many digits.

    Shaw & Holmes (1983). Of the free part of the motion, (c, w) just after the impact, the flow
    over a period makes (c, w + (1 + r) V): it is V times a known vector. The forced part is what is
    left of (1, -r V); that its amplitude is known leaves a quadratic for V, and its argument the
    phase.
    """
    with mp.workdps(digits):
        zeta, amplitude, omega, r = (mp.mpf(n) for n in (zeta, amplitude, omega, restitution))
        period, damped = 2 * mp.pi / omega, mp.sqrt(1 - zeta**2)
        co, si = mp.cos(damped * period), mp.sin(damped * period) / damped
        flow = mp.exp(-zeta * period) * mp.matrix([[co + zeta * si, si], [-si, co - zeta * si]])
        c, w = mp.lu_solve(flow - mp.eye(2), mp.matrix([0, 1 + r]))
        response = amplitude / mp.mpc(1 - omega**2, 2 * zeta * omega)
        # |1 - c V - i (-r - w) V / omega| = |response|
        along = (r + w) / omega
        square, size = c**2 + along**2, 1 - abs(response) ** 2
        velocity = (c + mp.sqrt(c**2 - square * size)) / square
        phase = mp.arg(mp.mpc(1 - c * velocity, along * velocity) / response)
        return velocity, phase % (2 * mp.pi)
