"""Power spectrum of a motion, from samples that are exact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arguments import choice, number, whole
from .._showing import Shown, drawn_by
from ..errors import InvalidInput
from ..oscillators import Cantilever
from ..oscillators.flows import Flow
from .basis.frame import swings
from .flows.course import coordinate_of

QUANTITIES = ("displacement", "velocity")
PER_PERIOD = 128
"""Samples in a period of the first force unless a rate is given."""
MOST = 2**27  # samples, of which some ten arrays are held at a time


@dataclass(frozen=True, eq=False)
class PowerSpectrum(Shown):
    """One-sided power spectral density of a displacement or a velocity about its mean.

    Attributes
    ----------
    frequency : ndarray, shape (n,)
        Frequencies [Hz], from 0 to half the rate.
    density : ndarray, shape (n,)
        Power spectral density [unit^2/Hz], of the unit of `quantity` in the oscillator's units.
    quantity : str
        The quantity: "displacement", "velocity" or a coordinate of a flow.
    rate : float
        Samples per second [Hz].
    segments : int
        Number of segments averaged, with an overlap of one half.
    forcing_period : float or None
        Period of the forcing [s]; None where there is none.
    source : str
        The simulated system.
    in_seconds : bool
        Whether frequencies are in Hz; False for an oscillator without a unit of time.

    See Also
    --------
    results.Motion.power_spectrum, plot.power_spectrum

    Examples
    --------
    >>> from impactsig import Force, Oscillator, simulate
    >>> motion = simulate(Oscillator(damping=0.2, forces=(Force(1.0, 0.9),)), periods=200)
    >>> spectrum = motion.power_spectrum("displacement")
    >>> line = 1 / spectrum.forcing_period
    >>> spectrum.power(line - 0.01, line + 0.01) / spectrum.power() > 0.99
    True
    """

    frequency: np.ndarray
    density: np.ndarray
    quantity: str
    rate: float
    segments: int
    forcing_period: float | None
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

    plot = drawn_by("power_spectrum", "the spectral density")


def power_spectrum(
    motion: Any,
    quantity: str | int | None = None,
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
    motion : Motion, BeamMotion, NoisyMotion or FlowMotion
        What `simulate` returned, with all kept.
    quantity : {"displacement", "velocity"}, optional
        Of an oscillator or of a cantilever's tip, against the ground; the displacement unless
        given. Of a flow the name or number of a coordinate, the first unless given.
    rate : float, optional
        Samples per second [Hz]; by default 128 in a period of the first force, or else of the
        base, and in a natural period without forcing, and of a cantilever at least 4 in a period of
        its highest mode. Of a path under noise it is that at which it was looked at; a flow has no
        default. There is no filter: power from above half the rate is folded back. The power of a
        velocity that jumps falls with the square of the frequency only.
    segments : int
        Spans to average over, each overlapping half of the next: more make the density of a
        chaotic motion steadier, fewer resolve closer lines.

    Returns
    -------
    PowerSpectrum

    Raises
    ------
    InvalidInput
        If the motion is too short for so many segments, or so long that its samples would fill
        gigabytes, or only counts were kept, or there is no period to choose a rate by.
    """
    own = motion.system
    segments = whole("segments", segments, 1)
    name, column = _quantity(own, quantity)
    period = _period(own)
    start = motion.start
    if rate is not None:
        rate = number("rate", rate, "a positive number [Hz]", above=0)
    elif hasattr(motion, "time"):
        if len(motion.time) < 2:
            raise InvalidInput("motion", repr(motion), "a path of two instants or more")
        start, rate = motion.time[0], 1 / (motion.time[1] - motion.time[0])
    elif period is None:
        raise InvalidInput("rate", rate, "samples per second: the motion has no period")
    elif isinstance(own, Cantilever):
        rate = max(PER_PERIOD / period, 4 * motion.frequencies[-1])
    else:
        rate = PER_PERIOD * swings(own) / period
    period = period or 1 / rate
    # A run of whole periods ends a rounding before or after the last of them.
    span = 2 * (motion.stop - start) / (segments + 1)
    size = 2 * int(math.floor(span / period * (1 + 1e-9)) * period * rate / 2 * (1 + 1e-9))
    if size < 8:
        raise InvalidInput(
            "segments", segments, "fewer, or a longer motion", f"A span would be {span:.3g} s"
        )
    count = size // 2 * (segments + 1)
    if count > MOST:
        raise InvalidInput(
            "rate", rate, f"one at which the motion is at most {MOST} samples",
            f"It would be {count:.3g}: give a lower one, or a shorter motion",
        )  # fmt: skip

    from scipy.signal import welch

    states = motion.sample(start + np.arange(count) / rate)
    values = states[column] if isinstance(states, tuple) else states[:, column]
    frequency, density = welch(values, rate, "hann", size, detrend="constant")
    return PowerSpectrum(
        frequency, density, name, float(rate), segments, own.forcing_period,
        getattr(own, "name", ""), own.in_seconds,
    )  # fmt: skip


def _quantity(system: Any, asked: str | int | None) -> tuple[str, int]:
    """Name and index of the coordinate whose spectrum is asked for."""
    if isinstance(system, Flow):
        column = 0 if asked is None else coordinate_of(system, asked)
        return system.coordinates[column], column
    name: Any = "displacement" if asked is None else asked
    return name, QUANTITIES.index(choice("quantity", name, QUANTITIES))


def _period(system: Any) -> float | None:
    """Forcing period, or else natural period [s]; None for a flow."""
    if system.forcing_period is not None or isinstance(system, Flow):
        return system.forcing_period
    if isinstance(system, Cantilever):
        return 1 / float(system.frequencies(1)[0])
    own = system.angular_natural_frequency
    return 2 * math.pi / own * system.time_unit if own else None
