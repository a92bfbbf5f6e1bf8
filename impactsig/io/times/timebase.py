"""Sampling rate from a column of times, as far as its printed digits allow."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from ._rounded import step_bounds

JITTER = 0.01  # of a sampling step: how far a time may lie from the uniform grid
RARE = 0.01  # of the steps: fewer that differ by a printed digit are gaps, not rounding
DOUBTFUL = 1e-4  # relative uncertainty of a rate above which the user is warned

_WHOLE = 1e-6  # how far a whole number may be from one
_LEAST = 0.1  # of a step, or a digit, that the ends of rounded times may be off at least
# Times powers of ten: what oscilloscopes, analysers and sound cards can be set to.
_ROUND = (1.0, 1.25, 2.0, 2.5, 4.0, 5.0, 8.0, 10.0, 2.56, 5.12, 1.1025, 2.205, 4.41, 4.8)
_FAR, _NEAR = 1 << 20, 1 << 14  # times that are read at once, and that stay in the cache


class Times(Protocol):
    """A lazy column of times."""

    def __len__(self) -> int: ...

    def __getitem__(self, part: slice, /) -> np.ndarray: ...


class TimeBase(NamedTuple):
    """Rate [Hz] and first time [s] of a column of times.

    `problem` says why there is no rate; `doubt` what limits one that there is.
    """

    rate: float | None
    start: float
    problem: str = ""
    doubt: str = ""


class Printed(NamedTuple):
    """Resolution of printed times: a fixed digit, or a number of significant digits.

    Attributes
    ----------
    digit : float
        Value of the last digit; in case of `relative` as a share of the leading digit's.
    relative : bool
        As in 1.23E-02, so that times near zero are finer.
    """

    digit: float
    relative: bool = False

    def of(self, times: np.ndarray) -> np.ndarray:
        """Value of the last printed digit of each time."""
        if not self.relative:
            return np.full(len(times), self.digit)
        size = np.abs(times)
        leading = np.floor(np.log10(size, out=np.zeros(len(times)), where=size > 0))
        return np.where(size > 0, self.digit * 10.0**leading, 0.0)


def printed_digits(texts: Iterable[str], times: np.ndarray, factor: float = 1.0) -> Printed:
    """Resolution to which the times of a column are printed.

    Parameters
    ----------
    texts : iterable of str
        Some of the times as they stand in the file.
    times : ndarray, shape (n,)
        All of them, in the file's unit.
    factor : float, optional
        Seconds in that unit.
    """
    cells = [text.strip().lower() for text in texts]
    digit = printed_resolution(cells)
    largest = float(np.max(np.abs(times), initial=0.0))
    if digit and largest and np.log10(factor) % 1 == 0:  # else leading digits change elsewhere
        digits = max(len(re.sub(r"e.*|\D", "", cell).lstrip("0")) for cell in cells)
        relative = Printed(10.0 ** (1 - digits), relative=True)
        fixed = relative.of(np.array([largest]))
        if _in_digits(times, relative.of(times)) and not _in_digits(times, fixed):
            return relative
    return Printed(digit * factor)


def _in_digits(times: np.ndarray, digits: np.ndarray) -> bool:
    """Whether each time is a multiple of its last digit."""
    with np.errstate(divide="ignore", invalid="ignore"):
        multiples = times / digits
    return bool(np.all((times == 0) | (np.abs(multiples - np.round(multiples)) <= _WHOLE)))


def printed_resolution(texts: Iterable[str]) -> float:
    """Value of the last printed digit of numbers with a decimal point.

    The finest of them, because some writers drop trailing zeros.
    """
    finest = np.inf
    for text in texts:
        mantissa, _, exponent = text.strip().lower().partition("e")
        digits = len(mantissa.partition(".")[2])
        try:
            finest = min(finest, 10.0 ** (int(exponent or 0) - digits))
        except ValueError:
            continue
    return float(finest) if np.isfinite(finest) else 0.0


def time_base(times: Times, resolution: float | Printed = 0.0) -> TimeBase:
    """Rate of uniformly spaced times: (n - 1) / (last - first).

    Times count as uniform if each lies within `JITTER` steps of the grid from the first to the
    last, or within the resolution of the printed digits. Rounding makes steps of two lengths, both
    of them often; where fewer than `RARE` of the steps stand out, samples are missing there.

    Parameters
    ----------
    times : ndarray, shape (n,), or what is sliced like one
        Times [s].
    resolution : float or Printed, optional
        Value of the last printed digit [s]; 0 for binary numbers.
    """
    printed = resolution if isinstance(resolution, Printed) else Printed(resolution)
    count = len(times)
    if count < 2:
        return TimeBase(None, 0.0, "The time column has fewer than two times")
    for begin, piece in _pieces(times):
        bad = np.flatnonzero(~np.isfinite(piece))
        if len(bad):
            number = begin + bad[0]
            return TimeBase(None, 0.0, f"The time column has no number in sample {number}")
    first = float(times[:1][0])
    span = float(times[count - 1 : count][0]) - first
    if not span > 0:
        return TimeBase(None, first, "The time column does not rise from its first to last value")
    step = span / (count - 1)
    deviation, unevenness, largest = _from_uniform(times, first, step)
    rounding = max(float(printed.of(np.array([largest]))[0]), 4 * float(np.spacing(largest)))
    uneven = unevenness > 2 * JITTER * step + 1.01 * rounding
    stands_out = max(2 * JITTER * step, rounding / 2)
    gaps = False
    if 2 * unevenness > stands_out:  # else no step differs so much from any other
        steps = np.diff(times[:])
        odd = np.count_nonzero(np.abs(steps - np.median(steps)) > stands_out)
        if printed.relative:  # times near zero are finer: each is judged by its own digit
            digits = printed.of(times[:])
            allowed = 2 * JITTER * step + 1.01 * np.maximum(digits[1:], digits[:-1])
            odd = np.count_nonzero(np.abs(steps - step) > allowed)
        gaps = bool(0 < odd < RARE * len(steps))
    if uneven or gaps or deviation > max(JITTER * step, 1.01 * rounding):
        steps = np.diff(times[:])
        worst = int(np.argmax(np.abs(steps - step)))
        percent = 100 * abs(steps[worst] / step - 1)
        there = float(times[worst : worst + 1][0])
        return TimeBase(
            None,
            first,
            f"The time column is not uniform: its steps deviate by up to {percent:.3g} % from "
            f"their mean of {step:.6g} s (worst after sample {worst}, t = {there:.9g} s), "
            f"and its times by up to {deviation / step:.3g} steps from a uniform grid",
        )
    # Both ends may be off by what the rounding, or the deviation seen, allows.
    uncertainty = 2 * max(rounding / 2, deviation) / span
    if uncertainty > DOUBTFUL and printed.digit:
        # Rounded differently from sample to sample, all of them together say more than two.
        bounds = step_bounds(times[:], np.maximum(printed.of(times[:]) / 2, np.spacing(largest)))
        if bounds and (bounds[1] - bounds[0]) / step < uncertainty:  # half of what the ends leave
            high, low = 1 / bounds[0], 1 / bounds[1]
            # Times that hardly fit any grid would seem to fix it best.
            least = _LEAST * min(step, rounding) / span
            return _settled((low + high) / 2, max((high - low) / (low + high), least), first)
    return _settled((count - 1) / span, uncertainty, first, rounding < step)


def _from_uniform(times: Times, first: float, step: float) -> tuple[float, float, float]:
    """Deviation of times from a uniform grid, and of steps from each other; the largest time.

    In pieces that stay in the cache: this is a good part of the time that a text file takes.
    """
    deviation = unevenness = largest = 0.0
    for begin, piece in _pieces(times):
        grid = first + step * np.arange(begin, begin + len(piece))
        deviation = max(deviation, float(np.max(np.abs(piece - grid))))
        unevenness = max(unevenness, float(np.max(np.abs(np.diff(piece) - step), initial=0.0)))
        largest = max(largest, float(np.max(np.abs(piece))))
    return deviation, unevenness, largest


def _pieces(times: Times) -> Iterator[tuple[int, np.ndarray]]:
    """Short pieces of the times, overlapping by one, and where they begin."""
    for far in range(0, len(times), _FAR):
        long = times[far : far + _FAR + 1]
        for near in range(0, min(_FAR, len(long)), _NEAR):
            yield far + near, long[near : near + _NEAR + 1]


def rate_of_step(step: float) -> float:
    """Rate [Hz] from a step [s] in the file, rounded: 1 / 0.00002 is not quite 50 000."""
    rate = 1 / step
    whole = round(rate)
    return float(whole) if abs(rate - whole) <= 4 * np.spacing(rate) else rate


def printed_step(text: str, start: float = 0.0, factor: float = 1.0) -> TimeBase:
    """Rate from a printed sampling step, in units of `factor` seconds."""
    step = float(text) * factor
    if not (np.isfinite(step) and step > 0):
        return TimeBase(None, start, f"The sampling step is given as {text}")
    return _settled(1 / step, printed_resolution([text]) * factor / 2 / step, start, True)


def _settled(rate: float, uncertainty: float, start: float, exact: bool = False) -> TimeBase:
    """Round a rate to a whole number of hertz if the digits leave only one.

    Instruments are set to whole rates, and a step printed as 0.000977 s is 1024 Hz, not
    1023.54 Hz. Where several whole numbers are possible, none is better than the estimate, but for
    the few that the dial of an oscilloscope has. An `exact` one that is whole is so by no chance.
    """
    low, high = rate * (1 - uncertainty), rate * (1 + uncertainty)
    whole = round(rate)
    exact = exact or uncertainty < DOUBTFUL
    if exact and whole > 0 and abs(rate - whole) <= min(1e-9 * rate, _WHOLE):
        return TimeBase(float(whole), start)
    if np.floor(high) >= 1 and np.ceil(low) == np.floor(high):
        rate = float(np.floor(high))
    power = 10.0 ** np.floor(np.log10(high))
    rate = next((number * power for number in _ROUND if low <= number * power <= high), rate)
    doubt = ""
    if uncertainty > DOUBTFUL:
        doubt = (
            f"the printed digits of its times leave the rate between {low:.6g} and {high:.6g} Hz; "
            f"{rate:.6g} Hz is taken, give rate= (--rate) if you know it better"
        )
    return TimeBase(rate, start, doubt=doubt)
