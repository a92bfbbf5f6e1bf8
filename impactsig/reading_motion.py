"""Read a motion from a recorded displacement or velocity, and its phase from the forcing."""

from __future__ import annotations

import math

import numpy as np

from ._arguments import instance, number
from ._numerics.smoothing import converter_step, gain, half_width, noise_of, smoothed
from .errors import InvalidInput
from .recorded import TURN, RecordedMotion
from .recording import Recording, channel_index, chosen_channel


def recorded_motion(
    recording: Recording,
    displacement: str | int | None = None,
    *,
    velocity: str | int | None = None,
    forcing: str | int | None = None,
    forcing_period: float | None = None,
    smoothing: float | None = None,
) -> RecordedMotion:
    """Estimate displacement and velocity from a recorded displacement or velocity.

    For a recorded displacement, x and v are value and slope of cubics fitted in windows around each
    sample [SavitzkyGolay1964]_. Each window is the widest of a sequence whose bias, estimated from
    the difference to the next narrower one, is within its noise [Lepskii1991]_. Impacts are
    smoothed; use `RecordedMotion.restitution` for velocities before and after impacts.

    For a recorded velocity, the displacement is its integral minus the best-fitting straight line.
    Its mean is 0, and its noise accumulates along the record.

    Parameters
    ----------
    recording : Recording
        With a channel of displacement or velocity.
    displacement, velocity, forcing : str or int, optional
        Channels. By default the only channel is the displacement; if only `velocity` is given,
        there is no recorded displacement.
    forcing_period : float, optional
        Period of the forcing [s], if it was not recorded; phase 0 is then at time 0 of the
        recording.
    smoothing : float, optional
        Length of both windows [s], for a recorded displacement.

    Returns
    -------
    RecordedMotion

    Raises
    ------
    InvalidInput
        If there are several channels and none is chosen, one is given twice, samples are not
        finite, the record is too short, the forcing does not vary, both `forcing` and
        `forcing_period` are given, or `smoothing` beside a velocity.

    See Also
    --------
    results.RecordedMotion, plot.phase_portrait

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Recording, recorded_motion
    >>> time = np.arange(2000) / 1000
    >>> swing = Recording(np.sin(2 * np.pi * 3 * time), 1000.0, units="mm")
    >>> motion = recorded_motion(swing, forcing_period=1 / 3.0)
    >>> motion.x.shape, motion.unit
    ((2000,), 'mm')
    """
    instance("recording", recording, Recording, "a Recording", "impactsig.read makes one")
    if forcing is not None and forcing_period is not None:
        raise InvalidInput(
            "forcing, forcing_period", f"{forcing!r}, {forcing_period!r}", "one of the two"
        )
    if smoothing is not None and velocity is not None:
        raise InvalidInput("smoothing", smoothing, "its default where the velocity was recorded")
    given = {"displacement": displacement, "velocity": velocity, "forcing": forcing}
    _refuse_twice(recording, {name: one for name, one in given.items() if one is not None})
    if displacement is not None or velocity is None:
        chosen = chosen_channel(recording, displacement, "displacement")
    else:
        chosen = recording.channel(velocity)
    rate, unit = recording.rate, chosen.unit
    if velocity is None:
        samples = _finite(chosen.samples, "displacement")
        x, v, noises, windows = _of_displacement(samples, rate, smoothing)
    else:
        v = _finite(recording.channel(velocity).samples, "velocity")
        of_v = noise_of(v, converter_step(v))
        windows = (0.0, 0.0)
        if displacement is None:
            samples, x = v, _integrated(v, rate)
            unit = unit.removesuffix("/s")
            # Of Brownian motion on [0, 1] without its best straight line, the mean variance.
            noises = (of_v / rate * math.sqrt(len(v) / 15.0), of_v)
        else:
            samples, x = v, _finite(chosen.samples, "displacement")
            noises = (noise_of(x, converter_step(x)), of_v)
    time = recording.time
    phase = None
    if forcing is not None:
        phase = _phase(_finite(recording.channel(forcing).samples, "forcing"))
    elif forcing_period is not None:
        phase = TURN * time / number("forcing_period", forcing_period, above=0)
    return RecordedMotion(
        time, x, v, samples, rate, *noises, *windows, phase, unit, recording.source
    )


def _refuse_twice(recording: Recording, given: dict[str, str | int]) -> None:
    """Refuse to use one channel for two quantities."""
    taken: dict[int, str] = {}
    for name, which in given.items():
        index = channel_index(recording.channels, which, name)
        if index in taken:
            raise InvalidInput(
                name, which, f"another channel than the {taken[index]}",
                "A velocity alone is read with displacement=None",
            )  # fmt: skip
        taken[index] = name


def _of_displacement(
    samples: np.ndarray, rate: float, smoothing: float | None
) -> tuple[np.ndarray, np.ndarray, tuple[float, float], tuple[float, float]]:
    """Smoothed displacement and its slope, their noise, and the lengths of the windows."""
    noise = noise_of(samples, converter_step(samples))
    if smoothing is None:
        halves = [half_width(samples, noise, derivative) for derivative in (0, 1)]
    else:
        most = (len(samples) - 1) // 2
        half = round(0.5 * number("smoothing", smoothing, above=0) * rate)
        if not 2 <= half <= most:
            raise InvalidInput(
                "smoothing", smoothing, f"{5 / rate:g} to {(2 * most + 1) / rate:g} s"
            )
        halves = [half, half]
    of_x, of_v = halves
    return (
        smoothed(samples, of_x, 0),
        smoothed(samples, of_v, 1) * rate,
        (noise * gain(of_x, 0), noise * rate * gain(of_v, 1)),
        ((2 * of_x + 1) / rate, (2 * of_v + 1) / rate),
    )


def _integrated(v: np.ndarray, rate: float) -> np.ndarray:
    """Integral of a velocity, less the straight line that fits it best."""
    x = np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1])))) / rate
    at = np.linspace(-1.0, 1.0, len(x))
    line: np.ndarray = x.mean() + at * float(at @ x) / float(at @ at)
    return x - line


def _finite(samples: np.ndarray, name: str) -> np.ndarray:
    values = np.asarray(samples, float)
    if not np.isfinite(values).all():
        where = int(np.argmin(np.isfinite(values)))
        raise InvalidInput(name, f"{values[where]} at sample {where}", "finite samples")
    if len(values) < 16:
        raise InvalidInput(name, f"{len(values)} samples", "16 or more")
    return values


def _phase(forcing: np.ndarray) -> np.ndarray:
    """Unwrapped phase of the strongest line in the spectrum, filtered to an octave."""
    count = len(forcing)
    if not np.ptp(forcing):
        raise InvalidInput(
            "forcing", f"{forcing[0]:g} throughout", "a channel that varies with the forcing"
        )
    spectrum = np.fft.fft(forcing - forcing.mean())
    line = int(np.argmax(np.abs(spectrum[1 : count // 2]))) + 1
    k = np.arange(count)
    spectrum[(k < line / np.sqrt(2)) | (k > line * np.sqrt(2))] = 0.0
    phase = np.unwrap(np.angle(np.fft.ifft(spectrum)))
    return np.maximum.accumulate(phase)
