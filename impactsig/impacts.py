"""Impacts: a spike train, measured or simulated; the type that everything else meets in."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from ._arguments import entries, instance, number, text, texts
from ._showing import drawn_by, picture
from ._trains import impact_columns as table
from ._trains import impact_tables as files
from ._trains.disturbances import KINDS, Disturbance, disturbances
from ._trains.impact_flags import (
    CLIPPED,
    EDITED,
    FLAG_NAMES,
    INFERRED,
    OPEN_END,
    OPEN_START,
    UNRESOLVED,
    flag_names,
)
from ._trains.interval_errors import interval_covariance
from .errors import InvalidInput

if TYPE_CHECKING:
    import pandas as pd
    from scipy.sparse import dia_array

__all__ = [
    "CLIPPED",
    "EDITED",
    "FLAG_NAMES",
    "INFERRED",
    "KINDS",
    "OPEN_END",
    "OPEN_START",
    "UNRESOLVED",
    "Disturbance",
    "Impacts",
    "exact",
    "flag_names",
]


@dataclass(frozen=True, eq=False, repr=False)
class Impacts:
    """A train of impacts in order of time, with measured quantities and metadata of the run.

    Parameters
    ----------
    time : array_like, shape (n,)
        Instants of impact [s], ascending.
    contact_time : array_like, shape (n,), optional
        Time from first to last touch [s], or between the crossings of `contact_level` if the run
        has one. None if it was not measured (sound, hard stops, times from other sources).
    peak : array_like, shape (n,), optional
        Greatest value above the baseline [unit].
    impulse : array_like, shape (n,), optional
        Integral above the baseline over the contact [unit * s].
    rise_time : array_like, shape (n,), optional
        Time from first touch to peak [s].
    approach_velocity : array_like, shape (n,), optional
        Speed towards the stop at first touch, relative to it, for simulated impacts.
    time_error, contact_time_error, peak_error, impulse_error : array_like, shape (n,), optional
        Standard errors of these quantities, in their units; 0 if exact (simulated impacts), inf if
        unknown (inferred ones).
    shared_time_error : array_like, shape (n,), optional
        Part of `time_error` that is common to impacts within a second [s]: they are measured with
        one pulse shape, whose error shifts all of them equally. It cancels in short intervals.
    shared_peak_error : array_like, shape (n,), optional
        Part of `peak_error` that is common to impacts within a second [unit], for the same reason.
        It does not cancel in the mean of many peaks (`fit_calibration`).
    probability : array_like, shape (n,), optional
        Probability that it is an impact, 0 to 1.
    pulses : array_like of int, shape (n,), optional
        How many pulses were merged into each.
    stop_index : array_like of int, shape (n,), optional
        Index of the stop that was hit, -1 if unknown; for simulated impacts the index in
        `Oscillator.stops`.
    stop_probability : array_like, shape (n,), optional
        Probability that this stop was hit, 0 to 1, for impacts that `separate_stops` assigned by
        their sound. 0 if the stop is unknown.
    flags : array_like of uint8, shape (n,), optional
        Bits `OPEN_START`, `OPEN_END`, `CLIPPED`, `UNRESOLVED`, `INFERRED`,
        `EDITED`.
    start, duration : float
        Span of the run [s]; by default from the first to the last impact.
    unit : str
        Unit of peak and of the levels.
    threshold : float, optional
        Level of the response at which an impact is recognised [unit].
    noise : float, optional
        Noise level: standard deviation of the signal between impacts [unit].
    contact_level : float or str, optional
        Level above the baseline [unit] that `contact_time` refers to, or a share of each peak such
        as "10 %"; 0 is the touch itself.
    gaps : array_like, shape (g, 2), optional
        Spans [s] without valid samples; no interval is taken across one. Of several sensors, there
        may be impacts in one: those of stops whose sensors recorded.
    sensor, source : str
        Kind of sensor, and name of the source.
    recorded_at : datetime, optional
        Wall-clock time of the beginning of the source.
    settings : mapping
        Settings of the detection, and estimated properties of the instrument.
    reason : str
        Why there are no impacts, if there are none.
    notes : tuple of str
        What makes the impacts doubtful, in sentences.
    disturbances : tuple of Disturbance
        Disturbances that were separated from the impacts.

    Raises
    ------
    InvalidInput
        If the times are not finite and ascending, the arrays differ in length, an impact lies
        outside the run, an error is negative or less than its shared part, or a probability not
        between 0 and 1.

    See Also
    --------
    detect_impacts, results.Motion, compare

    Examples
    --------
    >>> from impactsig import Impacts
    >>> train = Impacts([0.1, 0.2, 0.4], peak=[1.0, 1.2, 0.9], unit="N")
    >>> train.intervals().round(3)
    array([0.1, 0.2])
    >>> train.between(0.15, 0.5).peak
    array([1.2])
    """

    time: np.ndarray
    contact_time: np.ndarray | None = None
    peak: np.ndarray | None = None
    impulse: np.ndarray | None = None
    rise_time: np.ndarray | None = None
    approach_velocity: np.ndarray | None = None
    time_error: np.ndarray | None = None
    contact_time_error: np.ndarray | None = None
    peak_error: np.ndarray | None = None
    impulse_error: np.ndarray | None = None
    shared_time_error: np.ndarray | None = None
    shared_peak_error: np.ndarray | None = None
    probability: np.ndarray | None = None
    pulses: np.ndarray | None = None
    stop_index: np.ndarray | None = None
    stop_probability: np.ndarray | None = None
    flags: np.ndarray = field(default_factory=lambda: np.empty(0, np.uint8))
    # Once made they are numbers; None only asks for the default.
    start: float = None  # type: ignore[assignment]
    duration: float = None  # type: ignore[assignment]
    unit: str = ""
    threshold: float | None = None
    noise: float | None = None
    contact_level: float | str | None = None
    gaps: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    sensor: str = ""
    source: str = ""
    recorded_at: datetime | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""
    notes: tuple[str, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()

    def __post_init__(self) -> None:
        time = table.instants(self.time)
        store: dict[str, Any] = {"time": time}
        for name in table.MEASURED:
            value = getattr(self, name)
            store[name] = None if value is None else table.column(name, value, len(time))
        for shared, whole in table.SHARED_ERRORS.items():
            table.require_part(shared, store[shared], store[whole])
        store["flags"] = table.flag_column(self.flags, len(time))
        store["gaps"] = table.spans(self.gaps)
        start, duration = table.run_span(time, self.start, self.duration)
        for array in store.values():
            if array is not None:
                array.flags.writeable = False
        store |= {"start": start, "duration": duration}
        instance("settings", self.settings, Mapping, "a mapping of names to values")  # type: ignore[type-abstract]
        store["settings"] = MappingProxyType(dict(self.settings))
        notes = entries("notes", self.notes, "sentences")
        store["notes"] = texts("notes", notes, len(notes), "a note")
        for name in ("unit", "sensor", "source", "reason"):
            text(name, getattr(self, name))
        for name in ("threshold", "noise", "contact_level"):
            level = getattr(self, name)
            if level is not None and not (name == "contact_level" and isinstance(level, str)):
                number(name, level)
        if self.recorded_at is not None:
            instance("recorded_at", self.recorded_at, datetime)
        store["disturbances"] = disturbances(self.disturbances)
        vars(self).update(store)  # it is frozen from here on

    def __reduce__(self) -> tuple[Any, ...]:
        """To other processes and back: what was given, the settings as a plain dict."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return partial(Impacts, **values | {"settings": dict(self.settings)}), ()

    @classmethod
    def from_times(
        cls, time: Any, *, start: float | None = None, duration: float | None = None, **known: Any
    ) -> Impacts:
        """Make a train from instants in any order, and optional quantities of each impact.

        Parameters
        ----------
        time : array_like, shape (n,)
            Instants of impact [s].
        start, duration : float, optional
            Span of the run [s]; by default from the first to the last impact.
        **known
            Any other parameter of `Impacts`; arrays are sorted with the times.
        """
        time = table.vector("time", time)
        order = np.argsort(time, kind="stable")
        for name in (*table.MEASURED, "flags"):
            if known.get(name) is not None:
                known[name] = np.asarray(known[name])[order]
        known |= {"start": start, "duration": duration}
        return cls(time[order], **known)

    # -- reading ---------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.time)

    @property
    def stop(self) -> float:
        """End of the run [s]."""
        return self.start + self.duration

    @overload
    def intervals(self, *, errors: Literal[False] = False) -> np.ndarray: ...
    @overload
    def intervals(self, *, errors: Literal[True]) -> tuple[np.ndarray, dia_array]: ...
    def intervals(self, *, errors: bool = False) -> np.ndarray | tuple[np.ndarray, dia_array]:
        """Interspike intervals [s]: differences of successive instants, none across a gap.

        Parameters
        ----------
        errors : bool
            Whether to return the covariance as well.

        Returns
        -------
        intervals : ndarray, shape (m,)
        covariance : scipy.sparse.dia_array, shape (m, m)
            With `errors`, covariance of their errors [s^2]. Successive intervals share an instant.
            With the error s_i of the i-th instant, ``C[i, i] = s_i^2 + s_{i+1}^2`` and
            ``C[i, i+1] = C[i+1, i] = -s_{i+1}^2`` for independent errors. The variance of
            `shared_time_error` contributes a fraction T / 1 s to an interval T < 1 s.

        Raises
        ------
        InvalidInput
            If `errors` are requested and the instants have none.
        """
        whole = ~self.interval_spans_gap()
        intervals = np.diff(self.time)[whole]
        if not errors:
            return intervals
        if self.time_error is None:
            raise InvalidInput(
                "time_error", None, "the standard errors of the instants",
                "Detected, simulated and measured trains have them; give others their own",
            )  # fmt: skip
        return intervals, interval_covariance(self, np.flatnonzero(whole), self.time_error)

    def interval_spans_gap(self) -> np.ndarray:
        """Whether a gap is in the interval after each impact but the last, shape (n - 1,)."""
        if len(self.time) < 2:
            return np.zeros(max(len(self.time) - 1, 0), bool)
        begun = np.searchsorted(np.sort(self.gaps[:, 0]), self.time)
        return (np.diff(begun) > 0) | self.in_gap()[:-1]

    def in_gap(self) -> np.ndarray:
        """Whether each impact is in a gap, as of one of several sensors, shape (n,)."""
        begun = np.searchsorted(np.sort(self.gaps[:, 0]), self.time)
        ended = np.searchsorted(np.sort(self.gaps[:, 1]), self.time, side="right")
        return begun > ended

    def time_in_contact(self) -> float:
        """Fraction of the run spent in contact (the time-of-contact measure of [Karpodinis]_).

        Raises
        ------
        InvalidInput
            If contact times were not measured, or the run has no duration.
        """
        if self.contact_time is None:
            raise InvalidInput(
                "contact_time", None, "measured contact times", "Sound and hard stops have none"
            )
        valid = self.duration - float(np.sum(self.gaps[:, 1] - self.gaps[:, 0]))
        if valid <= 0:
            raise InvalidInput("duration", self.duration, "a run longer than 0 s")
        return float(self.contact_time[~self.in_gap()].sum() / valid)

    def bursts(self, within: float) -> tuple[np.ndarray, np.ndarray]:
        """Group impacts that follow one another within a given interval.

        Parameters
        ----------
        within : float
            Longest interval inside a burst [s].

        Returns
        -------
        first : ndarray of int, shape (b,)
            Index of the first impact of each burst.
        size : ndarray of int, shape (b,)
            Number of impacts in each.
        """
        number("within", within, "a positive time [s]", above=0)
        if not len(self):
            return np.empty(0, np.intp), np.empty(0, np.intp)
        opens = (np.diff(self.time) > within) | self.interval_spans_gap()
        first = np.flatnonzero(np.concatenate(([True], opens)))
        return first, np.diff(np.append(first, len(self)))

    # -- choosing --------------------------------------------------------------------------

    def __getitem__(self, which: Any) -> Impacts:
        """Select impacts by a slice, a mask or ascending indices; the run stays the same."""
        if isinstance(which, (int, np.integer)):
            which = [which]
        return replace(
            self, **{name: column[which] for name, column in table.columns(self).items()}
        )

    def between(self, start: float | None = None, stop: float | None = None) -> Impacts:
        """Select the impacts with start <= time < stop [s]; the run becomes that span."""
        low = self.start if start is None else max(float(start), self.start)
        high = self.stop if stop is None else min(float(stop), self.stop)
        if not low < high:
            raise InvalidInput(
                "start, stop",
                f"{start}, {stop}",
                f"a span inside {self.start:g} to {self.stop:g} s",
            )
        inside = (self.time >= low) & ((self.time < high) | (stop is None))
        gaps = np.clip(self.gaps, low, high)
        gaps = gaps[gaps[:, 1] > gaps[:, 0]]
        return replace(self[inside], start=low, duration=high - low, gaps=gaps)

    # -- correcting ------------------------------------------------------------------------

    def edit(
        self,
        *,
        add: Iterable[float] = (),
        move: Mapping[float, float] | None = None,
        reject: Iterable[float] = (),
        by: str = "",
        comment: str = "",
    ) -> Impacts:
        """Add, move and reject impacts by hand; ``settings["corrections"]`` lists every change.

        Parameters
        ----------
        add : iterable of float
            Instants [s] of impacts to add. They have the flag `EDITED`, the probability 1, and, for
            unmeasured quantities, the mean of their neighbours with an infinite error.
        move : mapping of float to float
            Instants to move, and new instants [s].
        reject : iterable of float
            Instants of impacts to remove [s]. The impact nearest to each instant, at most 1 ms
            away, is removed.
        by, comment : str
            Name of the person, and reason for the corrections.

        Raises
        ------
        InvalidInput
            If there is no such impact, or an instant lies outside the run or is that of another.
        """
        from ._trains.corrections import edited

        return edited(self, add, move or {}, reject, by, comment)

    def write_corrections(self, recording: Any) -> Path:
        """Write the corrections beside a recording, where `detect_impacts` finds them again.

        Corrections that are there already are kept, such as those of other people and channels; to
        take one back, delete its line. The table has the SHA-256 of the recording's file.

        Parameters
        ----------
        recording : path-like
            File of the recording; the table is written to this name with ".corrections.csv"
            appended.

        Returns
        -------
        Path
            Path of the table, with the columns channel, action, instant, new instant, person, date
            and comment.

        Raises
        ------
        UnreadableFile
            If there is no such recording, or the table there cannot be read or belongs to another.
        UnwritableFile
            If the table cannot be written.
        """
        from ._trains.correction_files import write

        return write(self, recording)

    def apply_corrections(self, recording: Any) -> Impacts:
        """Apply the corrections that are stored beside the recording.

        `detect_impacts` does this if it is given the path of a recording, as do commands and
        reports. Corrections of other channels, or outside the run, are ignored.

        Parameters
        ----------
        recording : path-like
            The recording's file.

        Returns
        -------
        Impacts
            The corrected train, with a note on corrections that match no impact. If there is no
            table beside the recording, but one in its folder that was made for it under another
            name, a note names that table.

        Raises
        ------
        UnreadableFile
            If the table beside the recording cannot be read, or belongs to another recording.
        """
        from ._trains.correction_files import applied

        return applied(self, recording)

    # -- tables ----------------------------------------------------------------------------

    def to_frame(self) -> pd.DataFrame:
        """A pandas table: one row for each impact, one column for each measured quantity."""
        import pandas as pd

        return pd.DataFrame(table.columns(self))

    def to_csv(self, path: Any) -> None:
        """Write a CSV that `read_csv` reads back without loss; metadata are in its first line.

        Parameters
        ----------
        path : path-like or text file open for writing
            Path or file.

        Raises
        ------
        UnwritableFile
            If the file cannot be written; an existing file at `path` is then unchanged.
        """
        files.write_csv(self, path)

    @classmethod
    def read_csv(cls, path: Any) -> Impacts:
        """Impacts from a CSV written by `to_csv`, or from any CSV with a column `time` [s].

        Raises
        ------
        UnreadableFile
            If there is no such file, or it has no such column, or the column is not numeric.
        """
        return files.read_csv(cls, path)

    def to_parquet(self, path: Any) -> None:
        """Write a Parquet file that `read_parquet` reads back without loss (needs pyarrow)."""
        files.write_parquet(self, path)

    @classmethod
    def read_parquet(cls, path: Any) -> Impacts:
        """Impacts from a Parquet file written by `to_parquet` (needs pyarrow)."""
        return files.read_parquet(cls, path)

    # -- showing ---------------------------------------------------------------------------

    plot = drawn_by("spike_train", "the spike train")

    def __repr__(self) -> str:
        count = "1 impact" if len(self) == 1 else f"{len(self)} impacts"
        parts = [f"{count} in {self.duration:.6g} s"]
        intervals = self.intervals()
        if len(intervals):
            parts.append(f"median interval {np.median(intervals):.4g} s")
        if self.contact_time is not None and len(self):
            parts.append(f"median contact {np.median(self.contact_time):.3g} s")
        if self.threshold is not None:
            parts.append(f"threshold {self.threshold:.3g} {self.unit}".rstrip())
        if self.reason:
            parts.append(self.reason)
        return f"Impacts({'; '.join(parts)})"

    def _repr_html_(self) -> str:
        frame: Any = self.to_frame()
        line = f"<code>{html.escape(repr(self))}</code>"
        return f"{line}<br>{picture(self) if len(self) else ''}{frame._repr_html_()}"


def exact(count: int) -> dict[str, Any]:
    """Columns that hold for every simulated impact: no error of the instant, probability 1."""
    return {"time_error": np.zeros(count), "probability": np.ones(count)}
