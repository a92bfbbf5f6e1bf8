"""Branches of periodic orbits, and their special points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..._showing import Shown, drawn_by

Kind = Literal["fold", "period doubling", "grazing"]


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A bifurcation or a grazing on a branch.

    Attributes
    ----------
    kind : {"fold", "period doubling", "grazing"}
        A multiplier is 1 and the branch turns back in the parameter; one is -1; an impact comes
        with no velocity, or a stop that was not hit is touched, and the branch ends.
    parameter : float
        Where.
    state : ndarray, shape (d,)
        State of the orbit there; of a grazing, of the last orbit before it.
    phase : float
        Phase of the section that this is on [rad].
    index : int
        Place on the branch of the orbit before it.
    """

    kind: Kind
    parameter: float
    state: np.ndarray
    phase: float
    index: int


@dataclass(frozen=True, eq=False, repr=False)
class Branch(Shown):
    """A branch of periodic orbits along a parameter, in the order of continuation.

    Attributes
    ----------
    periods, impacts : int
        n and m of period(m, n), the same along the branch; 1 and 0 for a flow.
    parameter : ndarray, shape (k,)
        Values of the parameter; not monotonic if the branch folds.
    state : ndarray, shape (k, d)
        State on the section, as in `PeriodicOrbit`, or a state on the orbit of a flow.
    phase : ndarray, shape (k,)
        Phase of the forcing at the section [rad], which is moved away from nearby impacts.
    period : ndarray, shape (k,)
        Period of the orbit [s].
    multipliers : ndarray of complex, shape (k, d)
        Floquet multipliers over the orbit.
    approach_velocity : ndarray, shape (k, m)
        Approach velocity of each impact.
    special : tuple of SpecialPoint
        Folds, period doublings and the grazing at its end, in order.
    status : str
        Why the branch ends: "end of range", "grazing", "most points", or "lost" if no further orbit
        was found.
    forced : bool or None
        For a flow, whether it is non-autonomous; otherwise one multiplier is 1 throughout.

    See Also
    --------
    continue_orbit, plot.branch

    Examples
    --------
    >>> from impactsig import continue_orbit, scenes
    >>> branch = continue_orbit(scenes.karpodinis, (22.1, 22.0))
    >>> branch.impacts, branch.periods, branch.status
    (1, 1, 'end of range')
    """

    periods: int
    impacts: int
    parameter: np.ndarray
    state: np.ndarray
    phase: np.ndarray
    period: np.ndarray
    multipliers: np.ndarray
    approach_velocity: np.ndarray
    special: tuple[SpecialPoint, ...]
    status: str
    forced: bool | None = None

    @property
    def stable(self) -> np.ndarray:
        """Whether each orbit is stable, shape (k,): all multipliers (but 1 of a flow) within 1."""
        sizes = np.abs(self.multipliers)
        if self.forced is False:
            sizes[np.arange(len(sizes)), np.abs(self.multipliers - 1).argmin(axis=1)] = 0.0
        return np.asarray(sizes.max(axis=1) < 1)

    def __len__(self) -> int:
        return len(self.parameter)

    plot = drawn_by("branch", "it over the parameter")

    def __repr__(self) -> str:
        told = "".join(f"; {point.kind} at {point.parameter:.9g}" for point in self.special)
        ends = f"{self.parameter[0]:.6g} to {self.parameter[-1]:.6g}"
        return (
            f"Branch(period({self.impacts}, {self.periods}), {len(self)} orbits from {ends}{told}; "
            f"{self.status})"
        )
