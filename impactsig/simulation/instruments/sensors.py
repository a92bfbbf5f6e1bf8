"""Models of a load cell and a microphone: response to an impact, noise and faults."""

from __future__ import annotations

from dataclasses import dataclass

from ..._arguments import entries, number, text
from ...errors import InvalidInput

Modes = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class LoadCell:
    """A load cell behind the stop: a half-sine for every impact, noise and channel faults.

    With peak P and contact time T the record holds ``P sin(pi (t - touch) / T)`` while in contact,
    and after it the tail ``ringing P sin(2 pi f s) exp(-s / decay)``, s being the time since the
    contact ended. By default there are no disturbances.

    Parameters
    ----------
    contact_time : float
        Contact time of impacts without a measured one [s].
    gain : float
        Signal per unit of strength: of the peak, or of the approach velocity if impacts have no
        peak. An impact with neither, nor an impulse, has the peak `gain`.
    noise : float
        Standard deviation of white noise [unit].
    drift, drift_period : float
        Amplitude [unit] and period [s] of a slow sinusoidal drift.
    hum, hum_frequency : float
        Amplitude [unit] and frequency [Hz] of the mains hum.
    ringing : float
        Amplitude of the tail as a share of the peak.
    ringing_frequency, ringing_decay : float
        Frequency [Hz] and time constant [s] of the tail.
    unit : str
        Unit of the record; by default that of the impacts.

    Raises
    ------
    InvalidInput
        If a time or a frequency is not positive, or anything else is negative.

    See Also
    --------
    Microphone, synthesize

    Examples
    --------
    >>> from impactsig import Impacts, LoadCell, synthesize
    >>> train = Impacts.from_times([0.01, 0.06], start=0.0, duration=0.1)
    >>> recording = synthesize(train, LoadCell(gain=2.0), seed=1)
    >>> round(float(recording.samples.max()), 2)
    1.99
    """

    contact_time: float = 300e-6
    gain: float = 1.0
    noise: float = 0.0
    drift: float = 0.0
    drift_period: float = 60.0
    hum: float = 0.0
    hum_frequency: float = 50.0
    ringing: float = 0.0
    ringing_frequency: float = 6000.0
    ringing_decay: float = 0.5e-3
    unit: str = ""

    def __post_init__(self) -> None:
        text("unit", self.unit)
        for name in (
            "contact_time",
            "gain",
            "drift_period",
            "hum_frequency",
            "ringing_frequency",
            "ringing_decay",
        ):
            number(name, getattr(self, name), above=0)
        for name in ("noise", "drift", "hum", "ringing"):
            number(name, getattr(self, name), least=0)


@dataclass(frozen=True)
class Microphone:
    """A microphone near the beam: every impact excites the modes of the beam, in pink room noise.

    Sound arrives ``distance / 343 m/s`` after the impact, with ``gain * strength / distance`` times
    the sum of ``share sin(2 pi f s + phase) exp(-s / decay)`` over the modes, s being the time
    since it arrived. By default phases are random for every impact.

    Parameters
    ----------
    distance : float
        Distance from the stop to the microphone [m].
    modes : sequence of (frequency, decay, share)
        Frequency [Hz], time constant [s] and relative amplitude of each mode. Modes at or above
        half the rate are left out, as an anti-aliasing filter would.
    phases : sequence of float, optional
        Phase of each mode [rad]. If given, all impacts sound the same except for their strength, as
        for a structure that is always hit at the same point. By default every impact sounds
        different.
    gain : float
        Signal per unit of strength at 1 m; the strength is the peak, or else the approach velocity
        or the impulse, or else 1.
    noise : float
        RMS of the room noise [unit]: pink, 1/f in power from 20 Hz upwards.
    unit : str
        Unit of the record.

    Raises
    ------
    InvalidInput
        If there are no modes, or not as many phases, a time, distance or frequency is not positive,
        or anything else but a phase is negative.

    See Also
    --------
    LoadCell, synthesize

    Examples
    --------
    >>> from impactsig import Impacts, Microphone, synthesize
    >>> train = Impacts.from_times([0.1, 0.3], start=0.0, duration=0.5)
    >>> recording = synthesize(train, Microphone(distance=0.3), seed=1)
    >>> recording.sensor, recording.rate
    ('sound', 22050.0)
    """

    distance: float = 1.0
    modes: Modes = ((2140.0, 6e-3, 1.0), (3710.0, 4e-3, 0.6), (5930.0, 2e-3, 0.4))
    gain: float = 1.0
    noise: float = 0.0
    unit: str = ""
    phases: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        text("unit", self.unit)
        for name in ("distance", "gain"):
            number(name, getattr(self, name), above=0)
        number("noise", self.noise, least=0)
        required = "one (frequency, decay, share) or more"
        modes = tuple(
            entries("modes", one, required) for one in entries("modes", self.modes, required)
        )
        if not modes or any(len(one) != 3 for one in modes):
            raise InvalidInput("modes", self.modes, required)
        for frequency, decay, share in modes:
            number("modes frequency", frequency, above=0)
            number("modes decay", decay, above=0)
            number("modes share", share, least=0)
        object.__setattr__(self, "modes", modes)
        if self.phases is not None:
            phases = tuple(
                number("phases", one) for one in entries("phases", self.phases, "angles [rad]")
            )
            if len(phases) != len(modes):
                raise InvalidInput(
                    "phases", self.phases, f"one phase for each of {len(modes)} modes"
                )
            object.__setattr__(self, "phases", phases)
