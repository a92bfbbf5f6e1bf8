"""What can be averaged, and over which energies."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NoReturn

import numpy as np

from ..._arguments import choice
from ...errors import InvalidInput
from ...oscillators import Oscillator, Rigid
from ._cycles import IMPACTS, Orbits, exchange, orbits
from ._well import Conservative, Well, on_arrays, well

FAR = 100.0  # exponent below its greatest, from where on energies are left out
LITTLE = 1e-9  # change of the exponent in an e-fold of the energy, below which it is a power of it
LEAST = 1e-14  # of the greatest energy, where panels begin at the latest
SPACING = 0.4  # of the energies looked at first, in their logarithm
BEFORE = 6  # energies before the first that matters, where panels begin
HIGHEST = 1e60  # energy looked at where stops hold the mass on both sides
FAR_OUT = 1e6  # displacement beyond which a well has no edge worth telling
LATER = (0.731, 12.9)  # times at which a law must be what it is at 0


def check(oscillator: Oscillator, impact: str) -> None:
    """Refuse what cannot be averaged.

    Raises
    ------
    InvalidInput
        If the oscillator has such a part.
    """
    if not isinstance(oscillator, Oscillator):
        raise InvalidInput("oscillator", oscillator, "an Oscillator")
    choice("impact", impact, IMPACTS)
    if oscillator.forces or oscillator.base:
        part = oscillator.forces[0] if oscillator.forces else oscillator.base
        raise InvalidInput(
            "oscillator", part, "an oscillator without forcing",
            "Its energy must be a slow variable; simulate an ensemble instead",
        )  # fmt: skip
    noise = oscillator.noise
    if noise is None or noise.intensity == 0:
        raise InvalidInput(
            "oscillator", noise, "noise of positive intensity", "Give it noise=Noise(intensity)"
        )
    if noise.correlation_time > 0:
        raise InvalidInput(
            "oscillator", noise, "white noise, of correlation time 0",
            "Simulate an ensemble, or take it as white where it is short against a cycle",
        )  # fmt: skip
    for stop in oscillator.stops:
        sticky = isinstance(stop.law, Rigid) and stop.law.restitution == 0
        if impact == "logarithmic" and sticky:
            raise InvalidInput(
                "oscillator", stop, "a restitution coefficient above 0",
                'A mass that sticks to its stop has no cycles; or take impact="exact"',
            )  # fmt: skip
    if oscillator.law is not None:
        law = on_arrays(oscillator.law)
        x, v = np.meshgrid([-1.3, -0.4, 0.0, 0.6, 1.7], [-0.9, 0.0, 1.1])
        now = law(0.0, x, v)
        if any(not np.array_equal(now, law(t, x, v), equal_nan=True) for t in LATER):
            raise InvalidInput(
                "oscillator", getattr(oscillator.law, "__name__", oscillator.law),
                "a law that does not depend on time",
            )  # fmt: skip


def check_well(part: Conservative, inside: Well) -> None:
    """Refuse a loss that is measured by an approach where there is none.

    Raises
    ------
    InvalidInput
        If the mass rests against such a stop.
    """
    for own in part.contacts:
        if own.restitution is not None and own.side * (inside.bottom - own.place) > 0:
            raise InvalidInput(
                "oscillator", f"a mass that rests in the Hertz stop at {own.place:g}",
                "a stop that the mass approaches, to have a loss by restitution",
                "Give Hertz(damping=) instead: it needs no approach velocity",
            )  # fmt: skip


def highest(inside: Well) -> float:
    """Energy that the well holds."""
    return min((side.top for side in inside.sides if not side.stop), default=math.inf)


@lru_cache(maxsize=16)
def ladder(part: Conservative) -> Orbits:
    """Orbits of all energies that the well holds, roughly."""
    inside = well(part)
    first = max([1e-150, *(side.parts[0].potential[1] for side in inside.sides if side.reach)])
    last = min(highest(inside), HIGHEST)
    count = max(2, math.ceil(math.log(last / first) / SPACING))
    with np.errstate(all="ignore"):
        return orbits(part, np.geomspace(first, last, count + 1)[:-1], coarse=True)


def span(oscillator: Oscillator, part: Conservative, impact: str) -> tuple[float, float]:
    """Energies from where the density is that of the bottom to where it is none.

    Raises
    ------
    InvalidInput
        If it does not fall off at the energies that the well holds.
    """
    assert oscillator.noise is not None
    rough = ladder(part)
    energy = rough.energy
    with np.errstate(all="ignore"):
        gain = exchange(oscillator, rough, impact).gain
        rate = energy * gain / (oscillator.noise.intensity * rough.area)
    known = np.isfinite(rate)
    unknown = float(energy[np.argmin(known)]) if not known.all() else math.inf
    energy, rate = energy[energy < unknown], rate[energy < unknown]
    changes = np.flatnonzero(np.abs(rate) > LITTLE)
    spacing = np.diff(np.log(energy))
    exponent = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * spacing)])
    near = np.flatnonzero(exponent >= exponent.max() - FAR)
    if not changes.size or near[-1] == len(energy) - 1:
        _unconfined(oscillator, well(part), unknown)
    # An extremum is an extremum however little the density differs there from that of the bottom.
    turns = np.flatnonzero(np.sign(rate[1:]) != np.sign(rate[:-1]))
    least = float(energy[max(min([changes[0], *turns[:1]]) - BEFORE, 0)])
    greatest = float(energy[near[-1] + 1])
    return max(min(least, LEAST * greatest), float(energy[0])), greatest


def _unconfined(oscillator: Oscillator, inside: Well, unknown: float) -> NoReturn:
    """Say why no energy holds the density, the last of which nothing is known given."""
    if math.isfinite(unknown) and any(callable(stop.law.restitution) for stop in oscillator.stops):  # type: ignore[union-attr]
        raise InvalidInput(
            "restitution", f"none at energies above {unknown:.3g}",
            "a function whose values are from 0 to 1, and above 0",
            "The density reaches energies at which it gives no such number",
        )  # fmt: skip
    for side in inside.sides:
        if not side.stop and side.reach < FAR_OUT:
            edge = inside.bottom + side.sign * side.reach
            raise InvalidInput(
                "oscillator", f"a well that ends at {edge:.6g}", "a well that holds the motion",
                "The noise takes it over the edge: no density is stationary",
            )  # fmt: skip
    raise InvalidInput(
        "oscillator", "a motion whose energy grows without end", "damping at great energies",
        "It loses less than it gains: no density is stationary",
    )  # fmt: skip
