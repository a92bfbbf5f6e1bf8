"""A beam before a stop, mode by mode with an integrator for any equation: slow, and to compare."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from impactsig import BaseMotion, Force, Rigid


def simulate_beam(beam, stop, modes, forcing, damping_ratio, duration, initial):
    """Impact times and approach velocities, final state, and the loss at the stop.

    An impact is where the integrator's event function says; there must be no chatter.
    """
    m = beam.modal_mass
    w = 2 * math.pi * beam.frequencies(modes)
    side = 1 if stop.side == "upper" else -1

    def base(t):
        if isinstance(forcing, BaseMotion):
            angle = forcing.angular_frequency * t + forcing.phase
            b = forcing.amplitude * math.cos(angle)
            v = -forcing.amplitude * forcing.angular_frequency * math.sin(angle)
            return b, v, -(forcing.angular_frequency**2) * b
        return 0.0, 0.0, 0.0

    def carried(t):
        b, v, _a = base(t)
        return (0.0, 0.0) if isinstance(forcing, BaseMotion) and forcing.stops else (b, v)

    def push(t):
        if isinstance(forcing, Force):
            return forcing.amplitude * math.cos(forcing.angular_frequency * t + forcing.phase) / m
        return -beam.participation(modes) * base(t)[2]

    def rates(contact):
        def function(t, y):
            q, v = y[:modes], y[modes:]
            a = push(t) - w**2 * q - 2 * damping_ratio * w * v
            if contact:
                b, bv = carried(t)
                depth = q.sum() + b - stop.position
                a = a - (stop.law.stiffness * depth + stop.law.damping * (v.sum() + bv)) / m
            return np.concatenate([v, a])

        return function

    def gap(t, y):
        return side * (stop.position - y[:modes].sum() - carried(t)[0])

    gap.terminal = True
    rigid = isinstance(stop.law, Rigid)
    t, y = 0.0, np.concatenate([np.pad(np.atleast_1d(part), (0, modes - np.size(part)))
                                for part in initial]).astype(float)  # fmt: skip
    contact, times, speeds, lost = False, [], [], 0.0
    while t < duration:
        gap.direction = 1 if contact else -1
        step = 0.3 / w[-1]  # so that no event is stepped over
        run = solve_ivp(rates(contact), (t, duration), y, "DOP853", rtol=1e-12, atol=1e-16,
                        events=gap, max_step=step)  # fmt: skip
        t, y = run.t[-1], run.y[:, -1].copy()
        if run.status != 1:
            break
        if not contact:
            speed = side * (y[modes:].sum() + carried(t)[1])
            times.append(t)
            speeds.append(speed)
        if rigid:
            y[modes:] -= side * (1 + stop.law.restitution) * speed / modes
            lost += m / modes / 2 * (1 - stop.law.restitution**2) * speed**2
        else:
            contact = not contact
    return np.array(times), np.array(speeds), y, lost
