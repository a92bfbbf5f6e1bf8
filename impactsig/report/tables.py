"""Tables of the impacts of a report: the columns it shows, and all columns for download."""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .._trains.impact_columns import ERRORS, MEASURED, SHARED_ERRORS
from ..impacts import flag_names
from .contents import printable

if TYPE_CHECKING:
    from ..impacts import Impacts

PLAIN_TABLE, PACKED_TABLE = 400_000, 800_000
"""Bytes up to which the table is held as it is, and up to which it is held compressed."""
LEAST_PACKED_ROW = 10
"""Bytes of a compressed row at least: its digits are noise. More rows are not even tried."""
DASH = "\N{EN DASH}"


@dataclass(frozen=True)
class Download:
    """Table of all impacts embedded in the page; `source` is empty if it would be too large."""

    source: str
    filename: str


@dataclass(frozen=True)
class Table:
    """Heads and cells, as text."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Column(NamedTuple):
    """One column of the page; `form` is a format, "stop", or empty for an error."""

    head: str
    values: np.ndarray
    form: str


def columns_shown(impacts: Impacts) -> list[Column]:
    """The columns in suitable units, each beside its standard errors."""
    columns = [Column("time [s]", impacts.time, ".6f")]
    columns += _errors(impacts.time_error, "µs", 1e6)
    if len(impacts) > 1:
        columns.append(Column("interval before [ms]", intervals_before(impacts) * 1e3, ".4f"))
    if impacts.contact_time is not None:
        columns.append(Column("contact time [ms]", impacts.contact_time * 1e3, ".4f"))
        columns += _errors(impacts.contact_time_error, "µs", 1e6)
    unit = f" [{impacts.unit}]" if impacts.unit else ""
    if impacts.peak is not None:
        columns.append(Column(f"peak{unit}", impacts.peak, ".4g"))
        columns += _errors(impacts.peak_error)
    if impacts.impulse is not None:
        name = f"impulse [{impacts.unit} s]" if unit else "impulse [s]"
        columns.append(Column(name, impacts.impulse, ".4g"))
        columns += _errors(impacts.impulse_error)
    if impacts.rise_time is not None:
        columns.append(Column("rise time [ms]", impacts.rise_time * 1e3, ".4f"))
    if impacts.probability is not None:
        columns.append(Column("probability", impacts.probability, ".3f"))
    if impacts.stop_index is not None:
        columns.append(Column("stop", impacts.stop_index, "stop"))
    if impacts.stop_probability is not None:
        columns.append(Column("stop probability", impacts.stop_probability, ".3f"))
    return [column._replace(head=printable(column.head)) for column in columns]


def intervals_before(impacts: Impacts) -> np.ndarray:
    """The interval that ends at each impact [s]; NaN at the first and across a gap."""
    before = np.full(len(impacts), np.nan)
    if len(impacts) > 1:
        before[1:] = np.diff(impacts.time)
        before[1:][impacts.interval_spans_gap()] = np.nan
    return before


def table(impacts: Impacts, count: int) -> Table:
    """The first impacts as text."""
    columns = columns_shown(impacts)
    rows = tuple(
        (
            str(i + 1),
            *(_cell(column.values[i], column.form) for column in columns),
            flag_names(int(impacts.flags[i])),
        )
        for i in range(min(count, len(impacts)))
    )
    return Table(("impact", *(column.head for column in columns), "flags"), rows)


def _cell(value: float, form: str) -> str:
    """One number of the table; a dash if it was not measured."""
    if form == "stop":
        return str(value) if value >= 0 else DASH
    if not np.isfinite(value):
        return DASH
    return format(value, form) if form else rounded(value)


def _errors(values: np.ndarray | None, unit: str = "", factor: float = 1.0) -> list[Column]:
    """The column of standard errors, in the unit of the column before it unless one is given."""
    return [] if values is None else [Column(f"± [{unit}]" if unit else "±", values * factor, "")]


def rounded(error: float) -> str:
    """A standard error to one significant digit; a dash if it was not measured."""
    if not np.isfinite(error):
        return DASH
    text = f"{error:.0e}"
    return f"{float(text):.5g}" if 1e-4 <= error < 1e5 or error == 0 else text


def download(impacts: Impacts, stem: str) -> Download:
    """All impacts as CSV in a data URI.

    Times to the nanosecond, standard errors to three digits, the rest to seven.
    """
    if len(impacts) * LEAST_PACKED_ROW > PACKED_TABLE:
        return Download("", "")
    columns = {"time": [f"{value:.9f}" for value in impacts.time]}
    for name in MEASURED:
        values = getattr(impacts, name)
        if values is not None:
            digits = 3 if name in (*ERRORS, *SHARED_ERRORS) else 7
            columns[name] = [f"{value:.{digits}g}" for value in values]
    columns["flags"] = [str(flags) for flags in impacts.flags]
    lines = (",".join(row) for row in (columns, *zip(*columns.values(), strict=True)))
    plain = "".join(f"{line}\r\n" for line in lines).encode()
    if len(plain) <= PLAIN_TABLE:
        return Download(_data_uri("text/csv", plain), f"{stem}-impacts.csv")
    packed = gzip.compress(plain, mtime=0)
    if len(packed) <= PACKED_TABLE:
        return Download(_data_uri("application/gzip", packed), f"{stem}-impacts.csv.gz")
    return Download("", "")


def _data_uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
