"""Shape of a joint density: peaks, craters and ridges, from its extrema."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..._arguments import number
from ..._showing import Shown
from ...errors import InvalidInput


@dataclass(frozen=True)
class DensityShape(Shown):
    """The extrema of an averaged joint density of displacement and velocity.

    Such a density is a function of the energy alone. Over the plane its extrema are therefore the
    bottom of the well and whole orbits: a *ridge* is an orbit on which the density has a maximum, a
    closed ring about the bottom or, with a stop, an arc from stop to stop.

    Attributes
    ----------
    energy : numpy.ndarray, shape (n,)
        Energies of the extrema above the bottom [J], ascending from 0, the bottom itself. Maxima
        and minima alternate, and the last is a maximum.
    maximum : numpy.ndarray of bool, shape (n,)
        Whether each is a maximum.
    height : numpy.ndarray, shape (n,)
        Joint density at each.
    lower, upper : float
        Potential at the stops, infinite without a stop.

    See Also
    --------
    p_bifurcation, results.AveragedDensity

    Examples
    --------
    >>> from impactsig import p_bifurcation, scenes
    >>> found = p_bifurcation(scenes.van_der_pol_duffing, [0.9, 0.99])
    >>> len(found.shapes), bool(found.shapes[-1].maximum[-1])
    (2, True)
    """

    energy: np.ndarray
    maximum: np.ndarray
    height: np.ndarray = field(repr=False)
    lower: float
    upper: float

    @property
    def centre(self) -> bool:
        """Whether the density has a peak at the bottom."""
        return bool(self.maximum[0])

    @property
    def ridges(self) -> int:
        """Number of orbits on which the density is greatest."""
        return int(self.maximum[1:].sum())

    @property
    def name(self) -> str:
        """The class: "peak", "crater", "crater with peak", or the number of ridges.

        "peak" has a single maximum at the bottom; "crater" a minimum there and a ridge around it;
        "crater with peak" a peak at the bottom and a ridge, with a minimum between them.
        """
        if not self.ridges:
            return "peak"
        rim = "crater" if self.ridges == 1 else f"{self.ridges} ridges"
        return f"{rim} with peak" if self.centre else rim

    def peaks(self, section: Literal["velocity", "displacement"] = "velocity") -> int:
        """Number of peaks in a cut of the joint density through the bottom of the well.

        Along the velocity, at the displacement of the bottom, each ridge is cut twice: a peak has
        one peak, a crater two, a crater with peak three, the "one", "two" and "three peaks" of the
        papers (with `least` as in `p_bifurcation`). Along the displacement, at rest, a ridge is cut
        on both sides, unless a stop is in front of it; the end of the cut at a stop is a peak if
        the density decreases from there.

        Raises
        ------
        InvalidInput
            If the section is neither.
        """
        if section == "velocity":
            return self.centre + 2 * self.ridges
        if section != "displacement":
            raise InvalidInput("section", section, '"velocity" or "displacement"')
        count = int(self.centre)
        for top in (self.lower, self.upper):
            if top == 0:  # the bottom is at the stop
                continue
            within = self.maximum & (self.energy > 0) & (self.energy < top)
            # Cut off while it rises, the density has a peak at the stop.
            beyond = np.flatnonzero(self.energy >= top)
            count += int(within.sum()) + bool(beyond.size and self.maximum[beyond[0]])
        return count

    def visible(self, least: float) -> DensityShape:
        """The shape without peaks that are lower than the share `least` of the highest.

        Each removed peak takes with it the higher of the two minima beside it. Where the peak at
        the bottom of the well is removed, the bottom counts as a minimum.

        Raises
        ------
        InvalidInput
            If the share is not from 0 to 1.
        """
        least = number("least", least, least=0.0, most=1.0)
        energy, maximum, height = list(self.energy), list(self.maximum), list(self.height)
        floor = least * max(height)
        while True:
            low = [(h, k) for k, h in enumerate(height) if maximum[k] and h < floor]
            if not low:
                break
            _, k = min(low)
            if k == 0:
                maximum[0], height[0] = False, min(height[0], height[1])
                gone = [1]
            else:
                beside = [j for j in (k - 1, k + 1) if j < len(height)]
                other = max(beside, key=lambda j: height[j])
                gone = [k, other or k + 1]  # the bottom stays
            energy, maximum, height = (
                [item for j, item in enumerate(items) if j not in gone]
                for items in (energy, maximum, height)
            )
        return DensityShape(
            np.array(energy), np.array(maximum, bool), np.array(height), self.lower, self.upper
        )
