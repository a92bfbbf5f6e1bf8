"""Lyapunov exponents of the orbits that diagrams have come to, of many oscillators at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...oscillators import Oscillator
from ...simulation.basis.columns import columns_of_forms
from ...simulation.batches.moving import Moving
from ...simulation.exact.exact import piecewise_linear
from ...simulation.exact.modes import stacks, subset
from ...simulation.exact.starts import first_phases
from ..tangents.batches.spectra import carried
from ..tangents.batches.tangent_maps import maps_over
from ..tangents.lyapunov import lyapunov_spectrum
from ..tangents.tangent import TangentMap, tangent_map
from .settling.cells import CHATTER

Place = tuple[float, float, float]


def exponents_of(
    machines: Sequence[Oscillator], closed: Sequence[int], periods: int, at: Sequence[Place]
) -> list[np.ndarray]:
    """Exponents of the orbits of oscillators through points, each with the bits of one alone.

    Parameters
    ----------
    machines : sequence of Oscillator
    closed : sequence of int
        Periods of each orbit; 0 where it has not closed.
    periods : int
        How long to look there.
    at : sequence of tuple
        Displacement, velocity and phase.
    """
    found: dict[int, np.ndarray] = {}
    exact = [k for k, machine in enumerate(machines) if piecewise_linear(machine)]
    for which, columns in columns_of_forms([machines[k] for k in exact]):
        for stack in stacks(columns, CHATTER, True):
            own = np.array(exact)[which[stack.which]]
            places, after = np.array([at[k] for k in own]), np.array([closed[k] for k in own])

            def moving(some: np.ndarray, whole: Any = stack, starts: Any = places) -> Moving:
                return Moving(
                    subset(whole, some), starts[some, :2], first_phases(starts[some, 2])
                )  # fmt: skip

            back, open_ones = np.flatnonzero(after), np.flatnonzero(after == 0)
            maps = maps_over(moving(back), after[back].astype(float)) if len(back) else []
            for k, there in zip(back.tolist(), maps, strict=True):
                found[own[k]] = of_orbit(there, int(after[k]), float(stack.forcing.omega[k]))
            if len(open_ones):
                grown = carried(moving(open_ones), periods / 10, float(periods), False)[0]
                found.update(zip(own[open_ones].tolist(), grown, strict=True))
    return [
        found[k] if k in found else exponents_at(machines[k], closed[k], periods, at[k])
        for k in range(len(machines))
    ]


def exponents_at(system: Any, closed: int, periods: int, at: Any) -> np.ndarray:
    """Exponents of the orbit through a point; from its multipliers if it has closed."""
    if not closed:
        return lyapunov_spectrum(system, periods=periods, initial=at[:2], phase=at[2]).exponents
    there = tangent_map(system, periods=closed, initial=at[:2], phase=at[2])
    return of_orbit(there, closed, system.angular_forcing_frequency)


def of_orbit(over: TangentMap, closed: int, frequency: float) -> np.ndarray:
    """Exponents from the tangent map over an orbit of so many periods."""
    with np.errstate(divide="ignore"):
        grown = np.log(np.abs(over.multipliers))
    return grown * frequency / (2 * math.pi * closed)
