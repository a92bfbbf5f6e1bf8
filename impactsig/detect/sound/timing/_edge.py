"""Band edge of a sound record: impulse response of its anti-aliasing filter.

A record at 8 kHz was sampled, or resampled, behind a low-pass filter of linear phase, which rings
before an impact as long as after it. Its response k(u), u in samples, is one of a few:

    e sinc(e u) cos^2(pi u / 48),  |u| < 24        a cliff at e times half the rate,
    sinc(u) I0(5 sqrt(1 - (u / 10)^2)) / I0(5)     a slope about half the rate,

the Chebyshev filter of `scipy.signal.decimate` forward and backward, or none: samples of the sound
itself. Three more do not ring before an impact. `step_modes` gives modes with an abrupt start
behind each of them.
"""

from __future__ import annotations

import functools

import numpy as np

from ._edge_kernels import PER_SAMPLE, whitening_taps

REACH, SLOPE_REACH = 24, 10  # samples to either side; of that of `resample_poly`
NO_FILTER = np.empty(0)
HIGH_PASS = 800.0  # [Hz]: room noise is strongest below
HIGH_PASS_REACH = 2e-3  # [s]
WHITENED = 1e-3  # [s], reach of the filter that whitens noise


def _places(reach: int) -> np.ndarray:
    """Places of the values of a response, from -reach to reach samples."""
    return np.arange(-reach * PER_SAMPLE, reach * PER_SAMPLE + 1) / PER_SAMPLE


def cliff(edge: float) -> np.ndarray:
    """The response with its -6 dB point at `edge` times half the rate."""
    u = _places(REACH)
    return edge * np.sinc(edge * u) * np.cos(0.5 * np.pi * u / REACH) ** 2


def slope() -> np.ndarray:
    """The response of a Kaiser window with beta 5, the default of `scipy.signal.resample_poly`."""
    u = _places(SLOPE_REACH)
    return np.sinc(u) * np.kaiser(len(u), 5.0)


def chebyshev() -> np.ndarray:
    """The response of `scipy.signal.decimate`: order 8, edge 0.8, forward and backward."""
    from scipy import signal

    impulse = np.zeros(2 * REACH * PER_SAMPLE + 1)
    impulse[REACH * PER_SAMPLE] = PER_SAMPLE
    return np.asarray(signal.sosfiltfilt(_chebyshev_sections(), impulse))


def _chebyshev_sections() -> np.ndarray:
    """Second-order sections of the filter of `scipy.signal.decimate`."""
    from scipy import signal

    return np.asarray(signal.cheby1(8, 0.05, 0.8 / PER_SAMPLE, output="sos"))


@functools.cache
def causal() -> tuple[np.ndarray, ...]:
    """Responses that do not ring before an impact, the greatest value of each at 0.

    That of `scipy.signal.decimate` forward alone, and those of a wider and of a gentler filter.
    """
    from scipy import signal

    wider = signal.cheby1(8, 0.05, 0.9 / PER_SAMPLE, output="sos")
    gentler = signal.butter(4, 0.75 / PER_SAMPLE, output="sos")
    impulse, found = np.zeros(3 * REACH * PER_SAMPLE), []
    impulse[0] = PER_SAMPLE
    for sections in (_chebyshev_sections(), wider, gentler):
        response = signal.sosfilt(sections, impulse)
        before = REACH * PER_SAMPLE - int(np.argmax(response))
        found.append(np.concatenate((np.zeros(before), response))[: len(_places(REACH))])
    return tuple(found)


@functools.cache
def responses() -> tuple[np.ndarray, ...]:
    """All candidate responses of linear phase, the most common one first."""
    return cliff(1.0), slope(), cliff(0.95), cliff(0.9), cliff(0.85), chebyshev()


@functools.lru_cache(maxsize=8)
def high_pass(rate: float) -> np.ndarray:
    """Taps of the linear-phase high-pass filter applied before comparing sounds."""
    reach = round(HIGH_PASS_REACH * rate)
    share = 2.0 * HIGH_PASS / rate
    taps = -share * np.sinc(share * np.arange(-reach, reach + 1)) * np.hamming(2 * reach + 1)
    taps[reach] += 1.0
    return taps - taps.mean()


@functools.lru_cache(maxsize=8)
def passed(rate: float) -> float:
    """The share of the power of white noise that passes this filter."""
    return float(np.sum(high_pass(rate) ** 2))


def whitening(quiet: np.ndarray, taps: np.ndarray, rate: float, error: float) -> np.ndarray:
    """The same number of taps that also whiten the noise in `quiet` (n, samples).

    They are symmetric as those of the high-pass filter `taps`, by which they leave out what is
    below HIGH_PASS. The spectrum of the noise is the median of n, smoothed; white noise of a power
    of `error` is added, for what models leave of sounds.
    """
    count, reach = quiet.shape[1], round(WHITENED * rate)
    taper, ends = _tapers(count, reach)
    white, spectra = np.empty(len(taps)), np.fft.rfft(quiet * taper)
    edge = HIGH_PASS * count / rate
    return white if whitening_taps(spectra, count, edge, error, taps, ends, white) else taps


@functools.lru_cache(maxsize=8)
def _tapers(count: int, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """That of quiet samples, whose squares add up to 1, and that of a filter."""
    taper = np.hanning(count + 2)[1:-1]
    return taper / np.sqrt(np.sum(taper**2)), np.hamming(2 * reach + 1)
