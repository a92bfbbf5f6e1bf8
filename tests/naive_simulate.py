"""Impacts of the one-sided oscillator in many digits, and a search that cannot miss a contact."""

from __future__ import annotations

import mpmath as mp
import numpy as np


def free_and_forced(zeta, amplitude, omega, phase, x, v, number=mp.mpf):
    """x(tau), x'(tau) after the state (x, v) at `phase`; x'' + 2 zeta x' + x = amplitude cos.

    `number` is mp.mpf for as many digits as mpmath has, or float for arrays of tau.
    """
    lib = mp if number is mp.mpf else np
    zeta, amplitude, omega = number(zeta), number(amplitude), number(omega)
    size = (1 - omega**2) ** 2 + (2 * zeta * omega) ** 2
    in_phase = amplitude * (1 - omega**2) / size
    behind = amplitude * 2 * zeta * omega / size
    damped = lib.sqrt(1 - zeta**2)
    c = x - in_phase * lib.cos(phase) - behind * lib.sin(phase)
    w = v - omega * (behind * lib.cos(phase) - in_phase * lib.sin(phase))
    s = (w + zeta * c) / damped

    def at(tau):
        angle = phase + omega * tau
        decay = lib.exp(-zeta * tau)
        co, si = lib.cos(damped * tau), lib.sin(damped * tau)
        place = in_phase * lib.cos(angle) + behind * lib.sin(angle) + decay * (c * co + s * si)
        speed = omega * (behind * lib.cos(angle) - in_phase * lib.sin(angle))
        speed += decay * ((s * damped - zeta * c) * co - (c * damped + zeta * s) * si)
        return place, speed

    return at


def first_contact(zeta, amplitude, omega, phase, x, v, *, end, after=0.0):
    """A bracket of the first contact with x = 1, or None: no crossing can hide in it.

    Of a cell of width h with gaps g1, g2 > 0 at its ends, min(g1, g2) > M h^2 / 8 with
    M >= |x''| certifies that there is no crossing inside; other cells are halved until one end is
    beyond the stop or they are 1e-9 wide.
    """
    at = free_and_forced(zeta, amplitude, omega, phase, x, v, float)
    size = np.hypot(1 - omega**2, 2 * zeta * omega)
    free = np.hypot(x, v) + amplitude / size * (1 + omega)
    most = 2 * free / (1 - zeta) + amplitude / size * omega**2
    grid = np.linspace(after, end, 2 + int((end - after) * max(1.0, omega) * 50))
    cells = np.stack([grid[:-1], grid[1:]], axis=1)
    while len(cells):
        gap = 1 - at(cells)[0]
        width = cells[:, 1] - cells[:, 0]
        open_ = (gap > 0).all(axis=1) & (gap.min(axis=1) > most * width**2 / 8)
        beyond = gap[:, 1] <= 0
        # Cells after the first certain crossing do not matter.
        if beyond.any():
            cells, gap, width, open_ = (
                item[: np.argmax(beyond) + 1] for item in (cells, gap, width, open_)
            )
        cells, width = cells[~open_], width[~open_]
        if not len(cells) or width[0] < 1e-9:
            return tuple(cells[0]) if len(cells) else None
        middle = cells.mean(axis=1)
        cells = np.stack([cells[:, 0], middle, middle, cells[:, 1]], axis=1).reshape(-1, 2)
    return None


def impacts(zeta, amplitude, omega, restitution, count, *, x=0, v=0, digits=40):
    """Instants and approach velocities of the first impacts, in `digits` digits."""
    with mp.workdps(digits):
        t, x, v = mp.mpf(0), mp.mpf(x), mp.mpf(v)
        found = []
        while len(found) < count:
            phase = mp.fmod(mp.mpf(omega) * t, 2 * mp.pi)
            at = free_and_forced(zeta, amplitude, omega, phase, x, v)
            after = 0.0
            if found:
                # Just after an impact the gap grows from 0: no contact before 2 v / M.
                after = float(-v) / (10 * float(amplitude) + 10)
            bracket = first_contact(
                zeta, amplitude, omega, float(phase), float(x), float(v), end=60.0, after=after
            )
            tau = mp.mpf(sum(bracket) / 2)
            for _ in range(8):
                place, speed = at(tau)
                tau += (1 - place) / speed
            t, x, v = t + tau, mp.mpf(1), at(tau)[1]
            found.append((t, v))
            v = -mp.mpf(restitution) * v
        return [t for t, _ in found], [v for _, v in found]
