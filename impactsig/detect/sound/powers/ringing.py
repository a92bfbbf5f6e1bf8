"""Sound that still rings when it is struck again, and the filter that predicts the ringing.

A part that rings for a few tenths of a second and is struck several times a second fills all time
with its modes. A strike raises their power by some decibels, as beats do; but a mode that has begun
can be predicted from its past, a strike cannot. So the octaves are read, and attacks are timed, in
the residual of linear prediction [Makhoul1975]_,

    e[n] = x[n] - sum_{k = 1}^{p} c_k x[n - k],

with the c_k that have the least mean square of e for the mean spectrum S of the record. S is the
mean of periodograms, each divided by its power in the octaves, so that loud sound counts no more
than what remains of it. p is PAST, which separates modes 170 Hz apart.

It is not known beforehand whether that is better. Prediction makes a knock that decays at once as
short as a sample and leaves its power in noise where the modes had raised it. Two measures tell:

- In the background, modes that do not decay between impacts are narrow bands above others. With the
  noise N_b of the bands b of an octave (`floor.py`), but at least COUNTS times the loudest nearby,
  ln mean N_b - mean ln N_b is what prediction gains there; it is 0 for white noise. Dense impacts,
  and cymbals, reach as much as ringing does.
- The autocorrelation r of the octaves tells these from ringing: between lags of 10 and 20 ms the
  mean of 2 r^2 is 1 / n for n modes of equal power that do not decay, and less than 0.015 for sound
  that has decayed by then, or that is noise. Machines that hit 50 to 100 times a second are as much
  correlated, by their periods; of these the first pass shows that they are no ringing.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable

import numpy as np

from .._kernels import GROUP, Scale
from .._windows import Window
from ._ringing_kernels import prediction_gain
from .bands import bands_at
from .filtering import Filter
from .hum import centres, lowest

GAIN = 0.1  # of prediction in the background of an octave [neper of power]
RINGS, LAGS = 0.02, (10e-3, 20e-3)  # squared correlation, and its lags [s]
OFTEN = 30.0  # [1/s], impacts that leave no time to ring
PAST = 6e-3  # [s] that is predicted from
SHORT, APART = 0.1, 0.34  # [s], frames that tell whether sound rings, and between these
LONG = 0.2  # [s], frames that lines are narrow enough in to be predicted
LINE, ABOVE = 2.0, 3.0  # coefficients of a line, and times the noise that it exceeds
LEAST = 1e-9  # of the power, white noise that is added for the equations to have a solution


def predictable(narrow: np.ndarray, rate: float, scale: Scale) -> bool:
    """Whether prediction may gain anything.

    `narrow` (cores, 2, bands) is the noise of narrow bands, and the greatest power within seconds.
    """
    if not len(narrow):
        return False
    return bool(prediction_gain(narrow, *octaves_at(rate, scale)) > GAIN)


@functools.lru_cache(maxsize=8)
def octaves_at(rate: float, scale: Scale) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gains of the narrow bands, where each octave begins among these, and their shares of it."""
    bands = bands_at(rate, GROUP * scale.hop)
    octave = np.floor(np.log2(centres(bands) / lowest(scale)))
    each = np.unique(octave[octave >= 0.0])
    edges = np.append(np.searchsorted(octave, each), len(octave))
    share = bands.gain.copy()
    for first, last in itertools.pairwise(edges):
        share[first:last] /= bands.gain[first:last].sum()
    return bands.gain, edges, share


def lasting(windows: Iterable[Window], rate: float, scale: Scale) -> float:
    """About how many modes of a record last; 0 if its sound does not."""
    heard = heard_of(spectrum_of(windows, rate, scale, SHORT, APART), scale)
    together = np.fft.irfft(heard)
    first, last = (round(lag * rate) for lag in LAGS)
    if 2.0 * np.mean(together[first:last] ** 2) > RINGS * together[0] ** 2:
        return modes_in(heard, scale)
    return 0.0


def prediction(
    windows: Iterable[Window], rate: float, scale: Scale, before: Filter | None, modes: float
) -> Filter | None:
    """The filter that leaves the residual of prediction of so many modes, behind another one.

    That one alone if the record is shorter than a frame.
    """
    from scipy import linalg

    spectrum = spectrum_of(windows, rate, scale, LONG, 0.5 * LONG)
    if before is not None:
        spectrum *= np.abs(np.fft.rfft(before.taps, 2 * len(spectrum) - 2)) ** 2
    together = np.fft.irfft(spectrum)[: round(PAST * rate) + 1]
    if not together[0] > 0.0:
        return before
    together[0] *= 1.0 + LEAST
    taps = np.append(1.0, -linalg.solve_toeplitz(together[:-1], together[1:]))
    if before is None:
        return Filter(taps, 0, True, modes)
    return Filter(np.convolve(before.taps, taps), before.delay, True, modes)


def heard_of(spectrum: np.ndarray, scale: Scale) -> np.ndarray:
    """What the octaves hear of a spectrum: they let frequencies below them through."""
    frequency = np.linspace(0.0, 0.5, len(spectrum))
    return np.asarray(spectrum * np.minimum(frequency / lowest(scale), 1.0) ** 4)


def modes_in(spectrum: np.ndarray, scale: Scale) -> float:
    """Number of lines of equal power that would have this spectrum; 1 at least."""
    noise = np.median(spectrum[round(2.0 * lowest(scale) * (len(spectrum) - 1)) :])
    lines = np.maximum(spectrum - ABOVE * noise, 0.0)
    squares = LINE * float(np.sum(lines**2))
    return max(float(lines.sum()) ** 2 / squares, 1.0) if squares > 0.0 else 1.0


def spectrum_of(
    windows: Iterable[Window], rate: float, scale: Scale, frame: float, every: float
) -> np.ndarray:
    """Mean spectrum of frames of a record, of at most so many seconds, and as far apart."""
    size, apart = 1 << int(np.log2(frame * rate)), round(every * rate)
    weights = hann(size)
    octaves = int(np.ceil(lowest(scale) * size))
    total = np.zeros(size // 2 + 1)
    for window in windows:
        x, core = window.beside(size)
        for first in range(core + -window.first % apart, core + len(window.core), apart):
            if first + size > len(x):
                break
            found = np.fft.rfft(weights * x[first : first + size])
            power = found.real**2 + found.imag**2
            heard = power[octaves:].sum()
            if heard > 0.0:
                total += power / heard
    return total


@functools.lru_cache(maxsize=4)
def hann(size: int) -> np.ndarray:
    """Weights of a frame."""
    return np.hanning(size)
