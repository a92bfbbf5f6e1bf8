"""Gain and offset of a sensor from known loads."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ._arguments import flag, reals, text
from ._numerics.straight_line import fit_line
from ._showing import Shown
from .errors import InvalidInput
from .recording import Recording


@dataclass(frozen=True, eq=False)
class Calibration(Shown):
    """``load = scale * reading + offset``, fitted to known loads.

    Attributes
    ----------
    scale, offset : float
        Gain [unit of the load / unit of the reading] and offset [unit of the load].
    covariance : ndarray, shape (2, 2)
        Covariance of scale and offset; its diagonal has the squares of their standard errors.
    residual : ndarray, shape (n,)
        Known load minus fitted load.
    unit : str
        Unit of the load.

    See Also
    --------
    fit_calibration, Recording.calibrate

    Examples
    --------
    >>> from impactsig import Recording, fit_calibration
    >>> found = fit_calibration([0.0, 1.0, 2.0], [0.1, 2.1, 4.1], unit="N")
    >>> loads = found.apply(Recording([0.0, 1.5], rate=10.0, units="V"))
    >>> loads.samples.round(6), loads.units
    (array([0.1, 3.1]), ('N',))
    """

    scale: float
    offset: float
    covariance: np.ndarray = field(repr=False)
    residual: np.ndarray = field(repr=False)
    unit: str = ""

    def apply(self, recording: Recording) -> Recording:
        """Convert a recording to the unit of the load."""
        return recording.calibrate(self.scale, self.offset, self.unit or None)

    def error(self, reading: Any) -> np.ndarray:
        """Standard error of the load by those of scale and offset, shape of `reading`."""
        at = np.stack([np.asarray(reading, float), np.ones(np.shape(reading))])
        return np.sqrt(np.einsum("i...,ij,j...->...", at, self.covariance, at))

    def __str__(self) -> str:
        of_scale, of_offset = np.sqrt(np.diag(self.covariance))
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"scale {self.scale:.6g} ± {of_scale:.1g}, offset {self.offset:.6g} ± {of_offset:.1g}"
            f"{unit}; {len(self.residual)} loads"
        )


LEAST_ERROR = 1e-140  # squares of errors must be numbers


def fit_calibration(
    reading: Any,
    load: Any,
    *,
    reading_error: Any = None,
    load_error: Any = None,
    shared_reading_error: Any = None,
    shared_load_error: Any = None,
    through_zero: bool = False,
    unit: str = "",
) -> Calibration:
    """Fit gain and offset of a sensor to pairs of reading and known load.

    A straight line is fitted to pairs with errors in both values, by maximum likelihood
    [York2004]_. If no errors are given, the readings are taken as exact and all loads to have the
    same error, estimated from the residuals.

    Parameters
    ----------
    reading, load : array_like, shape (n,)
        Reading of the sensor and known load: weights, or, for an impact hammer, its mass times the
        integral of its acceleration, with the impulse that the sensor recorded. Peaks can be used
        as well, if the error that they share because of the pulse shape is given too.
    reading_error, load_error : float or array_like, shape (n,), optional
        Standard errors.
    shared_reading_error, shared_load_error : float or array_like, shape (n,), optional
        Parts of these that are common to all readings, or to all loads, as
        `Impacts.shared_peak_error`. With five or more impacts per second each second has its own
        part, and the stated error of the scale is too large.
    through_zero : bool
        Whether the reading without load is exactly 0, as after the baseline has been subtracted.
    unit : str
        Unit of the load.

    Returns
    -------
    Calibration

    Raises
    ------
    InvalidInput
        If there are fewer than three pairs (two through zero), an error is not positive or less
        than its shared part, or all readings are equal.

    See Also
    --------
    Recording.calibrate, Impacts.shared_peak_error

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import fit_calibration
    >>> weights = np.array([0.0, 9.81, 19.62, 29.43])
    >>> found = fit_calibration(0.5 * weights, weights, unit="N")
    >>> round(float(found.scale), 6), round(abs(float(found.offset)), 6)
    (2.0, 0.0)
    """
    x, y = _numbers("reading", reading), _numbers("load", load)
    least = 2 if flag("through_zero", through_zero) else 3
    if x.shape != y.shape or len(x) < least:
        raise InvalidInput(
            "reading, load",
            f"{len(x)} and {len(y)} values",
            f"as many of both, {least} or more",
        )
    of_x, of_y = (
        np.zeros(len(x)) if given is None else _errors(name, given, len(x))
        for name, given in (("reading_error", reading_error), ("load_error", load_error))
    )
    if np.ptp(x) == 0 and not (through_zero and x[0]):
        raise InvalidInput(
            "reading", float(x[0]), "readings that differ", "Add the reading of another load"
        )
    text("unit", unit)
    known = reading_error is not None or load_error is not None
    if not known:
        of_y = np.ones(len(x))
    shared = (
        _shared("shared_reading_error", shared_reading_error, of_x),
        _shared("shared_load_error", shared_load_error, of_y if known else np.zeros(len(x))),
    )
    scale, offset, covariance = fit_line(x, y, of_x, of_y, through_zero, shared)
    residual = y - scale * x - offset
    if not known:
        covariance *= float(residual @ residual) / (len(x) - (1 if through_zero else 2))
    return Calibration(scale, offset, covariance, residual, unit)


def _numbers(name: str, given: Any) -> np.ndarray:
    required = "finite numbers, shape (n,)"
    values = reals(name, given, required)
    if values.ndim != 1 or not np.isfinite(values).all():
        raise InvalidInput(name, given, required)
    return values.copy()


def _errors(name: str, given: Any, count: int) -> np.ndarray:
    required = f"one positive standard error, or {count}"
    values = reals(name, given, required)
    fits = values.shape in ((), (1,), (count,))
    if not fits or not ((values > LEAST_ERROR) & (values < 1 / LEAST_ERROR)).all():
        raise InvalidInput(name, given, required)
    return np.broadcast_to(values, (count,))


def _shared(name: str, given: Any, whole: np.ndarray) -> np.ndarray:
    """Shared parts of standard errors; none if not given."""
    if given is None:
        return np.zeros(len(whole))
    required = f"{name.removeprefix('shared_')}, and no more than it, 0 or greater"
    values = reals(name, given, required)
    if values.shape not in ((), (1,), whole.shape) or not ((values >= 0) & (values <= whole)).all():
        raise InvalidInput(name, given, required)
    return np.broadcast_to(values, whole.shape)
