"""Synthesis of recordings from impacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from ..._arguments import Seed, entries, instance, number, streams, whole
from ...errors import InvalidInput
from ...impacts import Impacts
from ...recording import Recording
from ..flows.course import OF_A_FLOW
from .measuring import strength_of
from .sensors import LoadCell, Microphone

Kind = Literal["force", "sound"]
SPEED_OF_SOUND = 343.0  # [m/s], in air at 20 degrees C
PINK_FROM = 20.0  # [Hz]; below it the room noise is white
SETTLING = 0.2  # [s] in which the filter of the room noise forgets how it was started

LONGEST = 2**36  # samples; no memory holds more


def synthesize(
    impacts: Impacts,
    sensor: Kind | LoadCell | Microphone | Sequence[Kind | LoadCell | Microphone] = "force",
    *,
    rate: float | None = None,
    start: float | None = None,
    duration: float | None = None,
    bits: int | None = None,
    full_scale: float | None = None,
    seed: Seed = None,
) -> Recording:
    """Synthesise the recording that an instrument would make of these impacts.

    Impacts may lie between samples: the waveform of each is evaluated at the sampling instants. No
    anti-aliasing filter is applied. Overlapping waveforms are added.

    Parameters
    ----------
    impacts : Impacts
        Measured or simulated impacts. Positive contact times are used; otherwise that of the
        sensor. The peak of a pulse is the peak of the impact; if unknown, it is computed from the
        impulse; if neither is known, it is proportional to the approach velocity; if nothing is
        known, all peaks are equal.
    sensor : {"force", "sound"}, LoadCell or Microphone
        "force" and "sound" are a load cell and a microphone with default settings. A sequence has
        one for each stop of `Impacts.stop_index`, for example for two stops that sound different in
        one microphone: the record is the sum of their signals, noise included.
    rate : float, optional
        Samples per second [Hz]; by default 50 000 for a load cell, 22 050 for a microphone.
    start, duration : float, optional
        Span of the record [s]; by default that of the run. Waveforms are cut at its ends.
    bits : int, optional
        Resolution of the converter, 2 to 32; samples are rounded to ``2 full_scale / 2**bits``.
    full_scale : float, optional
        Range of the converter, -full_scale to full_scale [unit]; the record saturates there.
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result; a Generator is advanced.

    Returns
    -------
    Recording
        float64, with `start` and the sensor's kind and unit.

    Raises
    ------
    InvalidInput
        If an argument is out of range, the record would hold no sample, `bits` come without
        `full_scale`, or all modes of the sound lie above half the rate.

    See Also
    --------
    measure, detect_impacts, LoadCell, Microphone

    Examples
    --------
    >>> from impactsig import Impacts, LoadCell, synthesize
    >>> train = Impacts.from_times([0.01, 0.06], start=0.0, duration=0.1)
    >>> recording = synthesize(train, LoadCell(noise=0.01, unit="V"), seed=1)
    >>> recording.rate, recording.duration, recording.units
    (50000.0, 0.1, ('V',))
    """
    remedy = f"Those of a motion are motion.impacts. {OF_A_FLOW}"
    instance("impacts", impacts, Impacts, "an Impacts", remedy)
    parts = _parts(impacts, sensor)
    first = parts[0][0]
    kind: Kind = "force" if isinstance(first, LoadCell) else "sound"
    rate = number("rate", _RATES[kind] if rate is None else rate, above=0)
    start = impacts.start if start is None else number("start", start)
    length = impacts.duration if duration is None else number("duration", duration, least=0)
    count = round(length * rate)
    if count > LONGEST:
        raise InvalidInput(
            "rate, duration", f"{rate:g} Hz, {length:g} s", f"{LONGEST} samples at most"
        )
    if count < 1:
        raise InvalidInput(
            "duration", length, f"a sample or more at {rate:g} Hz", "Give start and duration"
        )
    full_scale = _checked_converter(bits, full_scale)
    noise, phases = streams(seed, 2)
    samples = np.zeros(count)
    for one, own in parts:
        if isinstance(one, LoadCell):
            samples += _white(noise, one.noise, count)
            _add_disturbances(samples, one, rate, phases)
            _add_contacts(samples, one, own, start, rate)
        else:
            samples += _pink(noise, one.noise, count, rate)
            _add_sounds(samples, one, own, start, rate, phases)
    if full_scale is not None:
        _convert(samples, full_scale, bits)
    unit = first.unit or (impacts.unit if kind == "force" else "")
    return Recording(
        samples,
        rate,
        units=(unit,),
        start=start,
        recorded_at=impacts.recorded_at,
        source=impacts.source,
        sensor=kind,
    )


_DEFAULTS: dict[Any, LoadCell | Microphone] = {"force": LoadCell(), "sound": Microphone()}
_RATES = {"force": 50_000.0, "sound": 22_050.0}


def _parts(impacts: Impacts, sensor: Any) -> list[tuple[LoadCell | Microphone, Impacts]]:
    """Each sensor with the impacts that it records."""
    given = [sensor] if isinstance(sensor, (str, LoadCell, Microphone)) else sensor
    wanted = '"force", "sound", a LoadCell or a Microphone, or a sequence of one kind of them'
    sensors: list[Any] = [
        _DEFAULTS.get(one) if isinstance(one, str) else one
        for one in entries("sensor", given, wanted)
    ]
    cells = [isinstance(one, LoadCell) for one in sensors]
    if not sensors or not (all(cells) or all(isinstance(one, Microphone) for one in sensors)):
        raise InvalidInput("sensor", sensor, wanted)
    if given is not sensor:
        return [(sensors[0], impacts)]
    stops = impacts.stop_index
    if stops is None:
        raise InvalidInput(
            "sensor", sensor, "one sensor, as these impacts have no `stop_index`",
            "Simulated impacts have one",
        )  # fmt: skip
    if len(stops) and stops.max() >= len(sensors):
        raise InvalidInput("sensor", sensor, f"a sensor for each of {stops.max() + 1} stops")
    return [(one, impacts[stops == k]) for k, one in enumerate(sensors)]


def _add_contacts(
    samples: np.ndarray, cell: LoadCell, impacts: Impacts, start: float, rate: float
) -> None:
    from ._waveforms import add_decays, add_half_sines

    contact = np.full(len(impacts), cell.contact_time)
    if impacts.contact_time is not None:
        contact = np.where(impacts.contact_time > 0, impacts.contact_time, contact)
    peak = np.ones(len(impacts))
    strength = strength_of(impacts)
    if impacts.peak is None and impacts.impulse is not None:
        peak = np.pi * impacts.impulse / (2 * contact)  # the integral of a half-sine is 2 P T / pi
    elif strength is not None:
        peak = strength
    peak = cell.gain * peak
    touch = (impacts.time - start) * rate
    add_half_sines(samples, touch, contact * rate, peak)
    if cell.ringing and cell.ringing_frequency < rate / 2:
        add_decays(
            samples,
            touch + contact * rate,
            cell.ringing * peak,
            np.zeros(len(impacts)),
            2 * np.pi * cell.ringing_frequency / rate,
            cell.ringing_decay * rate,
        )


def _add_sounds(
    samples: np.ndarray,
    microphone: Microphone,
    impacts: Impacts,
    start: float,
    rate: float,
    phases: np.random.Generator,
) -> None:
    from ._waveforms import add_decays

    if all(frequency >= rate / 2 for frequency, _, _ in microphone.modes):
        raise InvalidInput("rate", rate, "more than twice the frequency of one of the modes [Hz]")
    strength = strength_of(impacts)
    loudness = np.ones(len(impacts)) if strength is None else strength
    loudness = microphone.gain / microphone.distance * loudness
    arrival = (impacts.time + microphone.distance / SPEED_OF_SOUND - start) * rate
    # Drawn for all modes, those left out as well: a record at another rate has the same sounds.
    phase = phases.uniform(0, 2 * np.pi, (len(microphone.modes), len(impacts)))
    if microphone.phases is not None:
        phase[:] = np.array(microphone.phases)[:, None]
    for number_of_mode, (frequency, decay, share) in enumerate(microphone.modes):
        if frequency < rate / 2:
            turn = 2 * np.pi * frequency / rate
            add_decays(
                samples,
                arrival,
                share * loudness,
                phase[number_of_mode],
                turn,
                decay * rate,
            )


def _add_disturbances(
    samples: np.ndarray, cell: LoadCell, rate: float, phases: np.random.Generator
) -> None:
    from ._waveforms import add_sinusoid

    drift, hum = phases.uniform(0, 2 * np.pi, 2)
    if cell.drift:
        add_sinusoid(samples, cell.drift, drift, 2 * np.pi / (cell.drift_period * rate))
    if cell.hum:
        add_sinusoid(samples, cell.hum, hum, 2 * np.pi * cell.hum_frequency / rate)


def _white(rng: np.random.Generator, deviation: float, count: int) -> np.ndarray:
    if not deviation:
        return np.zeros(count)
    samples = rng.standard_normal(count)
    samples *= deviation
    return samples


def _pink(rng: np.random.Generator, rms: float, count: int, rate: float) -> np.ndarray:
    """Noise of power 1/f: white noise through a chain of poles, and zeros half an octave above.

    Poles an octave apart with zeros halfway between make a slope of -1/2 in amplitude, to a
    fraction of a decibel, as far as the sections reach.
    """
    from ._waveforms import shape

    if not rms:
        return np.zeros(count)
    corner = PINK_FROM * 2.0 ** np.arange(40)
    corner = corner[np.sqrt(2) * corner < rate / 2]
    pole = np.exp(-2 * np.pi * corner / rate)
    zero = np.exp(-2 * np.pi * np.sqrt(2) * corner / rate)
    settling = round(SETTLING * rate)
    response = np.zeros(settling)
    response[:1] = 1.0
    shape(response, pole, zero, np.zeros(len(pole) + 1))
    deviation = rms / np.sqrt(np.sum(response**2))
    state = np.zeros(len(pole) + 1)
    shape(deviation * rng.standard_normal(settling), pole, zero, state)
    samples = _white(rng, deviation, count)
    shape(samples, pole, zero, state)
    return samples


def _checked_converter(bits: int | None, full_scale: float | None) -> float | None:
    """The range of the converter as a float, where there is one."""
    if bits is not None:
        whole("bits", bits, 2, 32)
        if full_scale is None:
            raise InvalidInput("full_scale", None, "the range of the converter, given with bits")
    return None if full_scale is None else number("full_scale", full_scale, above=0)


def _convert(samples: np.ndarray, full_scale: float, bits: int | None) -> None:
    """Round to the steps of a two's-complement converter, and saturate, in place."""
    if bits is None:
        np.clip(samples, -full_scale, full_scale, out=samples)
        return
    half = 2 ** (int(bits) - 1)
    samples *= half / full_scale
    np.rint(samples, out=samples)
    np.clip(samples, -half, half - 1, out=samples)
    samples *= full_scale / half
