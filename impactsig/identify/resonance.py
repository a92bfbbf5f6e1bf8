"""`identify_resonance`: natural frequency and damping from a decay or a record under noise."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from .._arguments import Seed, choice, instance, limits, streams
from .._showing import Shown, drawn_by
from ..errors import ImpactsigWarning, InvalidInput
from ..recording import Recording
from ._band import Band, band_of, log_decrement, padded, peak_and_width, smooth
from ._decay import Fit, fit_decay
from ._envelope import envelope_evidence
from ._noise import QUANTITIES, fit_noise

REPLICAS = 100
EVIDENCE = 10.0
"""Logarithm of the likelihood ratio below which a resonance is not believed."""
FEWEST = 16
MISFIT = 1e-3
CLEAN = 100.0  # dB


class Estimate(NamedTuple):
    """A value and its standard error."""

    value: float
    error: float


@dataclass(frozen=True, eq=False, repr=False)
class Resonance(Shown):
    """Natural frequency and damping of a machine.

    Attributes
    ----------
    natural_frequency, natural_frequency_error : float
        Undamped natural frequency and its standard error [Hz].
    damping_ratio, damping_ratio_error : float
        Damping as a fraction of critical damping, and its standard error.
    peak : Estimate
        Frequency of the greatest power density [Hz], interpolated.
    half_power : Estimate
        Damping ratio from the width at half the maximum power, ``(f2 - f1) / (2 f0)`` [Rao2017]_.
    log_decrement : Estimate or None
        Damping ratio by the logarithmic decrement delta of the swings, ``delta / sqrt(4 pi^2 +
        delta^2)``; of a decay only.
    kind : {"decay", "noise"}
        What was recorded.
    signal_to_noise : float
        Ratio of the power of the resonance to that of the instrument noise, over the span and up to
        half the rate [dB]; nan if the latter cannot be distinguished from the flanks of the peak in
        the band.
    start, duration : float
        Start and length of the span that was used [s].
    frequency, density : ndarray, shape (n,)
        The band [Hz] and the power spectral density in it [unit^2/Hz].
    model : ndarray, shape (n,)
        The density that was fitted.
    envelope_time, envelope : ndarray, shape (k,)
        Amplitude of the part of the signal in the band [unit], once or twice per cycle.
    unit, source : str
        Of the recording.
    p_value : float
        Probability that, for one mode in white noise, the residuals are as unevenly distributed
        over the band (Bartlett's test of the cumulative periodogram). For a decay, twice the
        smaller of this and of the probability that the envelope deviates as much from an
        exponential (Fisher's test).

    See Also
    --------
    identify_resonance, plot.resonance, plot.decay

    Notes
    -----
    `natural_frequency` and `damping_ratio` are maximum-likelihood estimates with the errors that
    the curvature of the likelihood gives; `peak`, `half_power` and `log_decrement` are textbook
    estimates from the same band, with errors from records that are simulated with the fitted
    values. An estimate that is not possible in the band is nan.

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Recording, identify_resonance
    >>> time = np.arange(10_000) / 1000
    >>> swings = np.exp(-0.7 * time) * np.cos(140 * time)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(10_000)
    >>> found = identify_resonance(Recording(swings + noise, 1000), "decay")
    >>> round(float(found.natural_frequency), 2), round(float(found.damping_ratio), 4)
    (22.28, 0.005)
    """

    natural_frequency: float
    natural_frequency_error: float
    damping_ratio: float
    damping_ratio_error: float
    peak: Estimate
    half_power: Estimate
    log_decrement: Estimate | None
    kind: Literal["decay", "noise"]
    signal_to_noise: float
    start: float
    duration: float
    frequency: np.ndarray
    density: np.ndarray
    model: np.ndarray
    envelope_time: np.ndarray
    envelope: np.ndarray
    unit: str
    source: str
    p_value: float

    @property
    def misfit(self) -> bool:
        """Whether the band contradicts one mode in white noise: `p_value` of 0.001 or less.

        A second mode, non-viscous damping, or an amplitude-dependent frequency are then more
        likely, and the stated errors are not valid. Above 100 dB the residuals are rounding errors.
        """
        return self.p_value <= MISFIT and not self.signal_to_noise > CLEAN

    @property
    def quality_factor(self) -> float:
        """Quality factor, 1 / (2 damping ratio)."""
        return 0.5 / self.damping_ratio

    plot = drawn_by("resonance", "the spectrum with the fit")

    def __repr__(self) -> str:
        return (
            f"Resonance({self.natural_frequency:.6g} ± {self.natural_frequency_error:.1g} Hz; "
            f"damping ratio {self.damping_ratio:.4g} ± {self.damping_ratio_error:.1g}; "
            f"from a {self.kind} of {self.duration:.4g} s"
            f"{'; misfit: one mode does not explain it' if self.misfit else ''})"
        )


def identify_resonance(
    recording: Recording,
    kind: Literal["decay", "noise"],
    *,
    band: tuple[float, float] | None = None,
    quantity: Literal["displacement", "velocity", "acceleration"] = "displacement",
    seed: Seed = None,
) -> Resonance:
    """Estimate natural frequency and damping ratio of one mode.

    A free decay, as after a tap, is far more informative than a record of the same length under
    random excitation. Under random excitation the relative errors are at least
    ``sqrt(zeta / (omega T))`` in frequency and ``1 / sqrt(zeta omega T)`` in damping, even with a
    noise-free instrument.

    Parameters
    ----------
    recording : Recording
        One channel. A decay that begins later than the record is used from one cycle after its
        maximum.
    kind : {"decay", "noise"}
        Whether the record is a free decay, or a response to approximately white noise.
    band : (float, float), optional
        Lowest and highest frequency [Hz] to fit. By default from a third to twice that of the
        highest peak; specify it if another mode, or hum, is stronger or near.
    quantity : {"displacement", "velocity", "acceleration"}
        The recorded quantity, which determines the flanks of the peak under noise. Strain and the
        force of a load cell count as displacement.
    seed : int, SeedSequence or Generator, optional
        Seed of the simulated records from which the errors of the textbook estimates are computed.
        The same seed gives the same result; a Generator is advanced.

    Returns
    -------
    Resonance

    Raises
    ------
    InvalidInput
        If an argument is out of its range, the record has missing samples or several channels, the
        band holds too few frequencies, or no resonance stands out in it.

    Warns
    -----
    ImpactsigWarning
        If one mode in white noise does not explain the band (`Resonance.misfit`).

    See Also
    --------
    scenes.cantilever, fit_oscillator, plot.resonance

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Recording, identify_resonance
    >>> time = np.arange(10_000) / 1000
    >>> swings = np.exp(-0.7 * time) * np.cos(140 * time)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(10_000)
    >>> found = identify_resonance(Recording(swings + noise, 1000), "decay")
    >>> round(float(found.natural_frequency), 2), round(float(found.damping_ratio), 4)
    (22.28, 0.005)
    """
    choice("kind", kind, ("decay", "noise"))
    choice("quantity", quantity, QUANTITIES)
    samples = _samples(recording)
    rate = recording.rate
    if band is None:
        peak = _greatest(samples, rate)
        low, high = peak / 3, min(2 * peak, 0.499 * rate)
    else:
        low, high = _limits(band, rate)
    found = _checked(band_of(samples, rate, low, high))
    begin = 0
    if kind == "decay":
        time, size = found.envelope()
        first = int(np.argmax(size[:-1]))  # the last wraps round to the beginning
        if first > 3:  # what begins with the record is greatest within three values
            begin = round((time[first] + time[1]) * rate)
            found = _checked(band_of(samples[begin:], rate, low, high))
    power = np.abs(found.values) ** 2
    middle = float(found.frequency[np.argmax(smooth(power, 5))])
    fit = fit_decay(found, middle) if kind == "decay" else fit_noise(found, middle, quantity)
    if not fit.evidence > EVIDENCE:
        raise InvalidInput(
            "recording", repr(recording), f"a resonance from {low:.4g} to {high:.4g} Hz",
            "No resonance exceeds the noise; give band=, or a longer record",
        )  # fmt: skip
    natural = math.hypot(fit.alpha, fit.omega)
    ratio = fit.alpha / natural
    cosine = fit.omega / natural
    along = np.array([ratio, cosine])  # of the natural frequency by alpha and omega
    across = np.array([cosine**2, -ratio * cosine]) / natural
    errors = [math.sqrt(max(row @ fit.covariance @ row, 0.0)) for row in (along, across)]
    readings = _textbook(found, fit, kind, seed)
    scale = 2 / (found.rate * found.count)
    model = np.abs(fit.model) ** 2 if kind == "decay" else fit.model
    if kind == "decay":
        model = model + fit.noise**2 * found.count
    left = np.abs(found.values - fit.model) ** 2 if kind == "decay" else power / fit.model
    envelope_time, envelope = found.envelope()
    start = recording.start + begin / rate
    chance = _unevenness(left)
    if kind == "decay":
        chance = min(1.0, 2 * min(chance, envelope_evidence(found, fit)))
    result = Resonance(
        natural / (2 * math.pi),
        errors[0] / (2 * math.pi),
        ratio,
        errors[1],
        readings[0],
        readings[1],
        readings[2] if kind == "decay" else None,
        kind,
        10 * math.log10(fit.ratio),
        start,
        found.duration,
        found.frequency,
        power * scale,
        model * scale,
        start + envelope_time,
        envelope,
        recording.unit,
        recording.source,
        chance,
    )
    if result.misfit:
        warnings.warn(
            f"one mode in viscous damping does not explain the {kind} (p = {chance:.1g}): the "
            "errors do not hold; identify_friction fits friction too, band= leaves out other modes",
            ImpactsigWarning,
            stacklevel=2,
        )
    return result


def _unevenness(left: np.ndarray) -> float:
    """p-value of the unevenness of exponential numbers over the band."""
    from scipy.special import kolmogorov

    total = float(left.sum())
    if total <= 0:
        return 1.0
    along = np.cumsum(left)[:-1] / total
    off = float(np.abs(along - np.arange(1, len(left)) / len(left)).max())
    return float(kolmogorov(off * math.sqrt(len(left))))


def _textbook(band: Band, fit: Fit, kind: str, seed: Seed) -> list[Estimate]:
    """Peak, half-power damping and log decrement, with their scatter over similar records."""
    values = _readings(band, band.values, fit, kind)
    rng = streams(seed, 1)[0]
    found = np.empty((REPLICAS, 3))
    noise = fit.noise * math.sqrt(band.count / 2)
    for k in range(REPLICAS):
        normal = rng.standard_normal((2, len(band.values)))
        drawn = normal[0] + 1j * normal[1]
        drawn *= noise if kind == "decay" else np.sqrt(fit.model / 2)
        like = fit.model + drawn if kind == "decay" else drawn
        found[k] = _readings(band, like, fit, kind)
    counted = np.isfinite(found).sum(axis=0)
    spread = np.full(3, math.nan)
    told = (counted > REPLICAS / 2) & np.isfinite(values)
    spread[told] = np.nanstd(found[:, told], axis=0)
    return [Estimate(float(v), float(error)) for v, error in zip(values, spread, strict=True)]


def _readings(band: Band, values: np.ndarray, fit: Fit, kind: str) -> np.ndarray:
    like = Band(values, band.first, band.count, band.rate)
    rate = math.nan
    if kind == "decay":
        frequency, power = padded(like)
        time, size = like.envelope()
        # The noise of a sample, by the share of it that the window lets by.
        left = fit.noise * math.sqrt(4 * float((like.window**2).sum()) / band.count)
        rate = log_decrement(time, size, left)
    else:
        width = fit.alpha / math.pi  # at half power [Hz]
        power = smooth(np.abs(values) ** 2, max(1, round(0.3 * width / band.step)) | 1)
        frequency = band.frequency
    peak, width = peak_and_width(frequency, power)
    return np.array([peak, width / (2 * peak), rate / math.hypot(rate, 2 * math.pi * peak)])


def _samples(recording: Recording) -> np.ndarray:
    instance("recording", recording, Recording, "a Recording", "Recording(samples, rate)")
    samples = recording.samples
    if samples.ndim == 2 and samples.shape[1] > 1:
        raise InvalidInput(
            "recording", f"{samples.shape[1]} channels", "one", "Choose with recording.channel(...)"
        )
    samples = np.asarray(samples, float).reshape(-1)
    if len(samples) < 64:
        raise InvalidInput("recording", f"{len(samples)} samples", "at least 64")
    if not np.isfinite(samples).all():
        raise InvalidInput(
            "recording", "missing samples", "none", "Choose a whole span with recording.between()"
        )
    if np.ptp(samples) == 0:
        raise InvalidInput("recording", "samples that are all the same", "a motion")
    return samples


def _greatest(samples: np.ndarray, rate: float) -> float:
    """Frequency of the highest peak [Hz], without drifts."""
    power = np.abs(np.fft.rfft(samples - samples.mean())) ** 2
    power = smooth(power, 5)
    power[:4] = 0.0
    return float(np.argmax(power) * rate / len(samples))


def _limits(band: tuple[float, float], rate: float) -> tuple[float, float]:
    required = f"two frequencies from 0 to {rate / 2:g} Hz, the lower first"
    return limits("band", band, required, least=0.0, most=rate / 2)


def _checked(band: Band) -> Band:
    if len(band.values) < FEWEST:
        raise InvalidInput(
            "recording", f"{band.duration:.4g} s", f"{FEWEST} frequencies in the band",
            f"It holds {len(band.values)}, {band.step:.3g} Hz apart; record for longer, or widen "
            "the band",
        )  # fmt: skip
    return band
