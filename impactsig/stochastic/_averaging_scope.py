"""What can be averaged, and over which energies."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InvalidInput
from ..oscillators import Oscillator, Rigid
from ._averaging_cycles import IMPACTS, cycles
from ._averaging_well import Well, on_arrays

FAR = 100.0  # exponent below its greatest, from where on energies are left out
NOTHING = 1e-11  # change of the exponent in an e-fold of the energy, below which it is constant
LEAST = 1e-18  # of the greatest energy, where panels begin at the latest
SPACING = 0.4  # of the energies looked at first, in their logarithm
HIGHEST = 1e60  # energy looked at where stops hold the mass on both sides
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
    if impact not in IMPACTS:
        raise InvalidInput("impact", impact, '"logarithmic", "exact" or "linearised"')
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
        if not isinstance(stop.law, Rigid):
            raise InvalidInput(
                "oscillator", stop, "rigid stops",
                "KelvinVoigt has an equal Rigid: see stop_restitution",
            )  # fmt: skip
        if impact == "logarithmic" and stop.law.restitution == 0:
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


def highest(well: Well) -> float:
    """Energy that the well holds."""
    return min((side.top for side in well.sides if side.restitution is None), default=math.inf)


def span(oscillator: Oscillator, well: Well, impact: str) -> tuple[float, float]:
    """Energies from where the density is that of the bottom to where it is none.

    Raises
    ------
    InvalidInput
        If it does not fall off at the energies that the well holds.
    """
    assert oscillator.noise is not None
    first = max(side.potential[1] for side in well.sides if side.reach)
    first = max(first, 1e-150)
    last = min(highest(well), HIGHEST)
    count = max(2, math.ceil(math.log(last / first) / SPACING)) if last > first else 2
    energy = np.geomspace(first, last, count + 1)[:-1]
    with np.errstate(all="ignore"):
        found = cycles(oscillator, well, energy, impact, coarse=True)
        rate = energy * found.balance / oscillator.noise.intensity
    known = np.isfinite(rate)
    if not known.all():
        energy, rate = energy[: np.argmin(known)], rate[: np.argmin(known)]
    changes = np.flatnonzero(np.abs(rate) > NOTHING)
    exponent = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * SPACING)])
    near = np.flatnonzero(exponent >= exponent.max() - FAR)
    if not changes.size or near[-1] == len(energy) - 1:
        barrier = [side for side in well.sides if side.restitution is None and math.isfinite(side.top)]
        where = well.bottom + barrier[0].sign * barrier[0].reach if barrier else math.inf
        if barrier and abs(where) < 1e6:
            raise InvalidInput(
                "oscillator", f"a well that ends at {where:.6g}", "a well that holds the motion",
                "The noise takes it over the edge: no density is stationary",
            )  # fmt: skip
        raise InvalidInput(
            "oscillator", "a motion whose energy grows without end", "damping at great energies",
            "It loses less than it gains: no density is stationary",
        )  # fmt: skip
    greatest = float(energy[near[-1] + 1])
    # An extremum is an extremum however little the density differs there from that of the bottom.
    turns = np.flatnonzero(np.sign(rate[1:]) != np.sign(rate[:-1]))
    first_needed = min([changes[0], *turns[:1]]) - 1
    least = min(float(energy[max(first_needed, 0)]), LEAST * greatest)
    return max(least, float(energy[0])), greatest
