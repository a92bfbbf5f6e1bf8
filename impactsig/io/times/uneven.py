"""Interpolation of unevenly sampled signals to a uniform grid."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike

import numpy as np

from ..._arguments import number
from ...errors import InvalidInput
from .._source import Source

_MOST = 1 << 28
"""Samples of a channel that are made at most."""

_GAP = 5.0  # times the usual step: longer ones are bridged, and named


def resampled(source: Source, rate: float, path: str | PathLike[str]) -> Source:
    """Interpolate the signals of `source` to a uniform `rate` [Hz].

    Interpolated by piecewise cubic polynomials that rise and fall where the samples do, so that
    no pulse is made (Fritsch and Carlson). Of rows with the same time the first is kept; rows
    without a number are left out.
    """
    number("resample", rate, "a positive number [Hz]", above=0)
    if source.times is None:
        rates = sorted({signal.rate for signal in source.signals if signal.rate})
        found = ", ".join(f"{known:g} Hz" for known in rates) or "no column of times"
        raise InvalidInput(
            "resample",
            rate,
            f"a file with uneven times; {path} has {found}",
            "Use rate= (--rate) where the rate is missing",
        )
    times = source.times()
    kept = np.append(True, np.diff(times) > 0)
    if np.any(np.diff(times) < 0):
        back = int(np.flatnonzero(np.diff(times) < 0)[0])
        raise InvalidInput(
            "resample",
            rate,
            f"times that rise; {path} goes from {times[back]:.9g} s back to "
            f"{times[back + 1]:.9g} s",
            "Read the part before and the part after it one by one, by start= and stop=",
        )
    first, last = float(times[0]), float(times[-1])
    samples = int(np.floor((last - first) * rate * (1 + 1e-12))) + 1
    if samples > _MOST or samples < 2:
        raise InvalidInput(
            "resample", rate, f"a rate that makes 2 to {_MOST} samples of {last - first:.6g} s"
        )
    grid = first + np.arange(samples) / rate

    def read(channels: list[int], begin: int, end: int) -> np.ndarray:
        from scipy.interpolate import PchipInterpolator

        held = source.read(channels, 0, len(times)).astype(np.float64, copy=False)
        columns = []
        for column in held.T:
            there = kept[: len(column)] & np.isfinite(column)
            if np.count_nonzero(there) < 2:
                columns.append(np.full(end - begin, np.nan))
                continue
            curve = PchipInterpolator(times[: len(column)][there], column[there], extrapolate=False)
            columns.append(curve(grid[begin:end]))
        return np.column_stack(columns)

    steps = np.diff(times[kept])
    usual, longest = float(np.median(steps)), int(np.argmax(steps))
    note = (
        f"its times are uneven: steps of {usual:.4g} s (median) scatter by {np.std(steps):.3g} s "
        f"(rms), the longest is {steps[longest]:.4g} s after t = {times[kept][longest]:.9g} s; "
        f"resampled to {rate:g} Hz"
    )
    gaps = int(np.count_nonzero(steps > _GAP * usual))
    if gaps:
        note += f", {gaps} gaps bridged"
    signals = tuple(
        replace(signal, rate=float(rate), length=samples, start=first, no_rate="")
        for signal in source.signals
    )
    return replace(source, signals=signals, read=read, notes=(*source.notes, note), times=None)
