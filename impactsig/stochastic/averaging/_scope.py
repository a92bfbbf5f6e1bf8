"""Conditions for averaging, and the range of energies."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NoReturn

import numpy as np

from ..._arguments import choice
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ._cycles import IMPACTS, Orbits, exchange, orbits
from ._families import Family, families
from ._feeding import Band, band_of, fed
from ._well import Conservative, conservative, on_arrays

FAR = 100.0  # exponent below its greatest, from where on energies are left out
LITTLE = 1e-9  # change of the exponent in an e-fold of the energy, below which it is a power of it
LEAST = 1e-14  # of the greatest energy, where panels begin at the latest
SPACING = 0.4  # of the energies looked at first, in their logarithm
BEFORE = 6  # energies before the first that matters, where panels begin
HIGHEST = 1e60  # energy looked at where stops hold the mass on both sides
SADDLE = 1e-12  # of a saddle's energy, as near as which the orbits beside it are followed
FAR_OUT = 1e6  # displacement beyond which a well has no edge worth telling
AT_ZERO = 1e-12  # displacement that counts as 0
LATER = (0.731, 12.9)  # times at which a law must be what it is at 0


def check(oscillator: Oscillator, impact: str) -> None:
    """Refuse an oscillator that averaging does not apply to.

    Raises
    ------
    InvalidInput
        If the oscillator has such a part.
    """
    if not isinstance(oscillator, Oscillator):
        raise InvalidInput(
            "oscillator", oscillator, "an Oscillator with noise",
            "Orbits are averaged that close without control, of one displacement",
        )  # fmt: skip
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
    for stop in oscillator.stops:
        sticky = stop.law.rigid and stop.law.row().restitution == 0
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


def check_rest(oscillator: Oscillator) -> None:
    """Refuse what has no meaning, or no end, where the mass rests.

    Raises
    ------
    InvalidInput
        If the mass may rest against a stop whose loss is by its approach, against a rigid one under
        filtered noise, or where noise of the stiffness exerts no force.
    """
    assert oscillator.noise is not None
    part = conservative(oscillator)
    for inside in families(part).wells:
        if oscillator.noise.parametric and abs(inside.bottom) <= AT_ZERO:
            raise InvalidInput(
                "oscillator", oscillator.noise,
                "noise that is a force, or a mass that rests away from displacement 0",
                "Noise of the stiffness exerts no force at 0, so the mass may stay there for ever: "
                "its density has a pole at rest, or lies there as a whole; simulate an ensemble "
                "instead, or give it a load",
            )  # fmt: skip
        pressed = inside.bottom in (part.lower, part.upper)
        if oscillator.noise.correlation_time and pressed and inside.push(np.array(inside.bottom)):
            raise InvalidInput(
                "oscillator", f"a mass that is pressed against the rigid stop at {inside.bottom:g}",
                "white noise, or a soft stop",
                "The smaller its bounces, the sooner they follow each other, so noise with a "
                "correlation time cannot keep them up and the mass comes to rest: averaging gives "
                "no density; simulate an ensemble instead",
            )  # fmt: skip
        for own in part.contacts:
            if own.by_approach is not None and own.side * (inside.bottom - own.place) > 0:
                raise InvalidInput(
                    "oscillator", f"a mass that rests in the Hertz stop at {own.place:g}",
                    "a stop that the mass approaches, to have a loss by restitution",
                    "Give Hertz(damping=) instead: it needs no approach velocity",
                )  # fmt: skip


@lru_cache(maxsize=32)
def _fed_ladder(part: Conservative, which: int, band: Band) -> np.ndarray:
    """What noise feeds into the orbits of the ladder, roughly."""
    rough = ladder(part, which)
    family = families(part).walk()[which]
    with np.errstate(all="ignore"):
        return fed(part, family, band, rough.energy, rough.area, coarse=True)


@lru_cache(maxsize=32)
def ladder(part: Conservative, which: int) -> Orbits:
    """Orbits over all energies of a family, coarsely."""
    family = families(part).walk()[which]
    if family.children:
        first = SADDLE * family.foot
    else:
        (inside,) = family.wells
        first = max([1e-150, *(s.parts[0].potential[1] for s in inside.sides if s.reach)])
    last = min(family.edge, family.head, HIGHEST) - family.foot
    count = max(2, math.ceil(math.log(last / first) / SPACING))
    with np.errstate(all="ignore"):
        energy = family.foot + np.geomspace(first, last, count + 1)[:-1]
        return orbits(part, energy, coarse=True, family=family)


def rates(oscillator: Oscillator, which: int, impact: str) -> tuple[np.ndarray, ...]:
    """Energies of a family's ladder, and the exponent with its derivative by ln(energy).

    The logarithm is that of the energy above the bottom, or above the saddle where it begins.
    """
    assert oscillator.noise is not None
    part = conservative(oscillator)
    rough = ladder(part, which)
    energy = rough.energy
    above = energy - families(part).walk()[which].foot
    with np.errstate(all="ignore"):
        gain = exchange(oscillator, rough, impact).gain
        area = _fed_ladder(part, which, band_of(oscillator.noise))
        rate = above * gain / (oscillator.noise.intensity * area)
    known = np.isfinite(rate)
    count = len(rate) if known.all() else int(np.argmin(known))
    rate = rate[:count]
    exponent = (rate[1:] + rate[:-1]) / 2 * np.diff(np.log(above[:count]))
    return energy, rate, np.concatenate([[0.0], np.cumsum(exponent)])


def least_of(energy: np.ndarray, rate: np.ndarray, greatest: float) -> float:
    """Energy below which the density is that at the minimum of a well."""
    energy = energy[: len(rate)]
    changes = np.flatnonzero(np.abs(rate) > LITTLE)
    # An extremum is an extremum however little the density differs there from that of the bottom.
    turns = np.flatnonzero(np.sign(rate[1:]) != np.sign(rate[:-1]))
    first = min([*changes[:1], *turns[:1]], default=0)
    least = float(energy[max(first - BEFORE, 0)])
    return max(min(least, LEAST * greatest), float(energy[0]))


def greatest_of(
    oscillator: Oscillator, energy: np.ndarray, rate: np.ndarray, exponent: np.ndarray, most: float
) -> float:
    """Energy beyond which the density is negligible.

    Raises
    ------
    InvalidInput
        If it does not fall off at the energies that the wells hold.
    """
    near = np.flatnonzero(exponent >= max(float(exponent.max()), most) - FAR)
    if not np.any(np.abs(rate) > LITTLE) or (near.size and near[-1] == len(rate) - 1):
        unknown = float(energy[len(rate)]) if len(rate) < len(energy) else math.inf
        _unconfined(oscillator, families(conservative(oscillator)), unknown)
    return float(energy[near[-1] + 1] if near.size else energy[1])


def _unconfined(oscillator: Oscillator, root: Family, unknown: float) -> NoReturn:
    """Raise the error for a density that no energy confines."""
    if math.isfinite(unknown) and any(s.law.function is not None for s in oscillator.stops):
        raise InvalidInput(
            "restitution", f"none at energies above {unknown:.3g}",
            "a function whose values are from 0 to 1, and above 0",
            "The density reaches energies at which it gives no such number",
        )  # fmt: skip
    for inside, side in ((root.wells[0], 0), (root.wells[-1], 1)):
        end = inside.sides[side]
        if not end.stop and end.reach < FAR_OUT:
            edge = inside.bottom + end.sign * end.reach
            raise InvalidInput(
                "oscillator", f"a well that ends at {edge:.6g}", "a well that contains the motion",
                "The noise takes it over the edge: no density is stationary",
            )  # fmt: skip
    raise InvalidInput(
        "oscillator", "a motion whose energy grows without end", "damping at great energies",
        "It loses less than it gains: no density is stationary",
    )  # fmt: skip
