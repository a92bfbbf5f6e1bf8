"""Detectors to compare, each `(samples, rate) -> (instants [s], contact times [s] or None)`."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import product

import numpy as np
from scipy import signal

import impactsig

from .recordings import score

REPEATS = 5


def timed(find: Callable, samples: np.ndarray, rate: float):
    """What `find` returns, and the median time of some runs after one that is not counted [s]."""
    find(samples, rate)
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        found = find(samples, rate)
        times.append(time.perf_counter() - start)
    return found, float(np.median(times))


def tuned(
    make: Callable, grid: dict, truth, tolerance=1e-3, delays=(0.0,)
) -> tuple[Callable, dict]:
    """The member of a family of detectors with the best F1 on the truth itself."""
    best = max(
        (dict(zip(grid, values, strict=True)) for values in product(*grid.values())),
        key=lambda options: score(
            make(**options)(truth.samples, truth.rate)[0], truth.time, tolerance, delays
        )[0],
    )
    return make(**best), best


def by_impactsig(sensor: str, **options) -> Callable:
    def find(x, rate):
        found = impactsig.detect_impacts(impactsig.Recording(x, rate, sensor=sensor), **options)
        return found.time, found.contact_time

    return find


def find_peaks_above(level: Callable) -> Callable:
    return lambda x, rate: (signal.find_peaks(x, level(x))[0] / rate, None)


def passed(x, rate, low=300.0, high: float | None = 6000.0, level=5.0):
    """The filtered record and so many times its robust standard deviation; no `high`: high-pass.

    `high` is at most 0.45 times the rate.
    """
    band, kind = (low, "highpass") if high is None else ([low, min(high, 0.45 * rate)], "bandpass")
    y = signal.sosfiltfilt(signal.butter(2, band, kind, fs=rate, output="sos"), x)
    return y, level * np.median(np.abs(y)) / 0.6745


def find_peaks_passed(x, rate, distance=0.6e-3, **options):
    """Crests and 1.5 times their widths at half height: the contact times of half-sines."""
    y, level = passed(x, rate, **options)
    peaks, _ = signal.find_peaks(y, level, distance=max(int(distance * rate), 1))
    return peaks / rate, signal.peak_widths(y, peaks, 0.5)[0] * 1.5 / rate


def linear_crossings(x, rate):
    y, level = passed(x, rate)
    above = y >= level
    up = np.flatnonzero(~above[:-1] & above[1:])
    down = np.flatnonzero(above[:-1] & ~above[1:])
    down = down[np.searchsorted(down, up[0]) :][: len(up)]
    up = up[: len(down)]
    first = up + (level - y[up]) / (y[up + 1] - y[up])
    last = down + (y[down] - level) / (y[down] - y[down + 1])
    return first / rate, (last - first) / rate


def sta_lta(kind: str) -> Callable:
    from obspy.signal import trigger

    ratio = getattr(trigger, f"{kind}_sta_lta")

    def make(sta=3e-4, lta=0.03, on=5) -> Callable:
        def find(x, rate):
            y = x - x.mean()
            picks = trigger.trigger_onset(
                ratio(y, max(int(sta * rate), 1), int(lta * rate)), on, on / 2
            )
            picks = np.asarray(picks).reshape(-1, 2)
            return picks[:, 0] / rate, (picks[:, 1] - picks[:, 0]) / rate

        return find

    return make


def by_librosa(hop=512, delta=0.07) -> Callable:
    import librosa

    def find(x, rate):
        return librosa.onset.onset_detect(
            y=x.astype(np.float32), sr=int(rate), hop_length=hop, delta=delta, units="time"
        ), None

    return find


def by_aubio(method="hfc", threshold=0.3, hop=64) -> Callable:
    import aubio

    def find(x, rate):
        onset = aubio.onset(method, 512, hop, int(rate))
        onset.set_threshold(threshold)
        y = np.concatenate((x, np.zeros(-len(x) % hop))).astype(np.float32)
        return np.array(
            [onset.get_last_s() for k in range(0, len(y), hop) if onset(y[k : k + hop])[0]]
        ), None

    return find
