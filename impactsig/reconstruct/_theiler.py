"""The Theiler window, which excludes neighbours that are close merely in time."""

from __future__ import annotations

import numpy as np

from .._arguments import whole
from ._series import known


def theiler_window(theiler: int | None, x: np.ndarray) -> int:
    """The window given, or the default [steps].

    The greatest of two mean periods, a period being the time from one rise through the mean to the
    next, and of the first lag at which the autocorrelation is not positive; but no more than a
    tenth of the series. Of a sampled flow either spans the time in which it forgets where it was
    [Theiler1986]_. Intervals forget within one or two of their own, while vectors of one orbit are
    still neighbours in time: there the periods, which count intervals, span two orbits.

    Parameters
    ----------
    theiler : int or None
        What the user gave.
    x : ndarray, shape (n,)
        As `series` returns it; nothing is followed across a gap.
    """
    if theiler is not None:
        return whole("theiler", theiler, 0)
    values = known(x)
    most = len(values) // 10
    # Scaled first, because squares of large numbers overflow and of small ones vanish.
    centred = x / (np.abs(values).max() or 1.0)
    centred -= np.nanmean(centred)
    above, below = centred > 0, centred <= 0
    rises = int(np.count_nonzero(below[:-1] & above[1:]))
    return min(max(2 * len(values) // max(rises, 1), _decorrelated(centred, most)), most)


def _decorrelated(centred: np.ndarray, most: int) -> int:
    """First lag with a non-positive autocorrelation, or `most`."""
    filled = np.nan_to_num(centred / (np.nanmax(np.abs(centred)) or 1.0))
    power = np.abs(np.fft.rfft(filled, 2 * len(filled))) ** 2
    correlation = np.fft.irfft(power)[1:most]
    return 1 + int(np.argmax(correlation <= 0)) if np.any(correlation <= 0) else most
