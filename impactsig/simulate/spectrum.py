"""The power spectrum of a motion, from samples that are exact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .._arguments import choice, number
from ..errors import InvalidInput
from ._frame import swings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .motion import Motion

PER_PERIOD = 128
"""Samples in a period of the first force unless a rate is given."""


@dataclass(frozen=True, eq=False)
class PowerSpectrum:
    """One-sided power spectral density of a displacement or a velocity about its mean.

    Attributes
    ----------
    frequency : ndarray, shape (n,)
        Frequencies [Hz], from 0 to half the rate.
    density : ndarray, shape (n,)
        Power spectral density [unit^2/Hz], of the unit of `quantity` in the oscillator's units.
    quantity : {"displacement", "velocity"}
        Whose it is.
    rate : float
        Samples per second [Hz].
    segments : int
        Spans averaged over, each overlapping half of the next.
    forcing_frequency : float or None
        One over the forcing period [Hz].
    source : str
        What moved.
    in_seconds : bool
        Whether frequencies are in Hz, and not in the unit of an oscillator that tells no seconds.
    """

    frequency: np.ndarray
    density: np.ndarray
    quantity: Literal["displacement", "velocity"]
    rate: float
    segments: int
    forcing_frequency: float | None
    source: str
    in_seconds: bool = True

    @property
    def resolution(self) -> float:
        """Distance of neighbouring frequencies [Hz]; a line takes three of them."""
        return float(self.frequency[1])

    def power(self, low: float = 0.0, high: float = math.inf) -> float:
        """Mean square of what lies from `low` to `high` [Hz], in the square of the unit."""
        inside = (self.frequency >= low) & (self.frequency <= high)
        return float(self.density[inside].sum() * self.resolution)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw it; see `impactsig.plot.power_spectrum`."""
        from .. import plot

        return plot.power_spectrum(self, ax)


def power_spectrum(
    motion: Motion,
    quantity: Literal["displacement", "velocity"] = "displacement",
    *,
    rate: float | None = None,
    segments: int = 8,
) -> PowerSpectrum:
    """Power spectral density of a motion, by the mean of Hann-windowed spans [Welch1967]_.

    Each span is a whole number of forcing periods long, so that the lines of the forcing and of
    its harmonics stand on frequencies of the spectrum; those of period(m, n) do where n divides
    that number. The mean is taken away from each span. The sum over all frequencies of density
    times resolution is the mean square of the quantity about its mean; of a periodic motion
    exactly.

    Parameters
    ----------
    motion : Motion
        What moved, with all kept.
    quantity : {"displacement", "velocity"}
        Against the ground.
    rate : float, optional
        Samples per second [Hz]; by default 128 in a period of the first force, or else of the
        base, and in a natural period without forcing. There is no filter: power from above half
        the rate is folded back. The power of a velocity that jumps falls with the square of the
        frequency only.
    segments : int
        Spans to average over, each overlapping half of the next: more make the density of a
        chaotic motion steadier, fewer resolve closer lines.

    Returns
    -------
    PowerSpectrum

    Raises
    ------
    InvalidInput
        If the motion is too short for so many segments, or only counts were kept, or there is no
        period to choose a rate by.
    """
    choice("quantity", quantity, ("displacement", "velocity"))
    if isinstance(segments, bool) or not isinstance(segments, (int, np.integer)) or segments < 1:
        raise InvalidInput("segments", segments, "a positive whole number")
    forcing, period = motion.oscillator.forcing_period, _period(motion)
    if rate is None:
        if period is None:
            raise InvalidInput("rate", rate, "samples per second: the motion has no period")
        rate = PER_PERIOD * swings(motion.oscillator) / period
    elif not number("rate", rate, "a positive number [Hz]") > 0:
        raise InvalidInput("rate", rate, "a positive number [Hz]")
    period = period or 1 / rate
    # A run of whole periods ends a rounding before or after the last of them.
    span = 2 * motion.duration / (segments + 1)
    size = 2 * int(math.floor(span / period * (1 + 1e-9)) * period * rate / 2 * (1 + 1e-9))
    if size < 8:
        raise InvalidInput(
            "segments", segments, "fewer, or a longer motion", f"A span would be {span:.3g} s"
        )

    from scipy.signal import welch

    count = size // 2 * (segments + 1)
    time = motion.start + np.arange(count) / rate
    values = motion.sample(time)[quantity == "velocity"]
    frequency, density = welch(values, rate, "hann", size, detrend="constant")
    own = motion.oscillator
    return PowerSpectrum(
        frequency, density, quantity, float(rate), segments, forcing and 1 / forcing, own.name,
        own.in_seconds,
    )  # fmt: skip


def _period(motion: Motion) -> float | None:
    """The forcing's, or else the natural period [s]."""
    own: Any = motion.oscillator.natural_frequency
    natural = 2 * math.pi / own * motion.oscillator.time_unit if own else None
    return motion.oscillator.forcing_period or natural
