"""Time bases of columns of dates and times of day, as loggers and measuring programs print them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from typing import Any

import numpy as np

from ..times.timebase import TimeBase, printed_resolution, time_base

_DAY_FIRST = r"(?P<day>\d{1,2})(?P<sign>[-./])(?P<month>\d{1,2}|[A-Za-z]{3})[-./](?P<year>\d{4})"
_MILLISECONDS = r"(:\d\d:\d\d):(\d+)$"  # behind a colon
_HALF_DAY = r"(\d\d?)(:\d\d(?::\d\d[.\d]*)?) ?([AaPp])\.?[Mm]\.?$"  # a clock of twelve hours
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")


def read_moments(
    cells: np.ndarray, last: Sequence[str]
) -> tuple[TimeBase, np.ndarray, datetime | None]:
    """Time base, times [s] from the first, and the first as a date, where that is certain.

    In 03/04/2020 nobody knows which is the month, so a recording of that day has no date; where
    midnight passes, the day that moves is the day.

    Parameters
    ----------
    cells : ndarray of object
        The column.
    last : sequence of str
        Its last cells as they stand: their digits tell how finely the times are printed.
    """
    import pandas as pd

    texts = pd.Series(cells).str.replace(",", ".", regex=False)
    if re.search(_MILLISECONDS, str(cells[0])):
        texts = texts.str.replace(_MILLISECONDS, r"\1.\2", regex=True)
        last = [re.sub(_MILLISECONDS, r"\1.\2", text) for text in last]
    if re.search(_HALF_DAY, str(cells[0])):
        texts = pd.Series([re.sub(_HALF_DAY, _of_day, str(text)) for text in texts], dtype=object)
    iso, certain = _as_iso(texts)
    moments: Any
    try:
        moments = pd.to_datetime(iso, format="ISO8601")
        begin = moments.iloc[0].to_pydatetime(warn=False) if certain else None
    except (ValueError, TypeError):
        try:
            moments, begin = pd.to_timedelta(texts), None
        except (ValueError, TypeError):
            problem = (
                f"The time column holds text that is no date or time, such as {cells[0]!r}; "
                "2024-05-31 14:02:03.250 and 31.05.2024 14:02:03.250 are read"
            )
            return TimeBase(None, 0.0, problem), np.empty(0), None
    seconds = (moments - moments.iloc[0]).dt.total_seconds().to_numpy(dtype=np.float64)
    digits = [re.search(r":(\d\d(?:[.,]\d+)?)(?!.*:\d\d[.,\d]*)", text) for text in last]
    printed = printed_resolution(match[1].replace(",", ".") for match in digits if match)
    return time_base(seconds, printed), seconds, begin


def _of_day(time: re.Match[str]) -> str:
    """The time of day of a clock of twelve hours."""
    hour = int(time[1]) % 12 + (12 if time[3] in "pP" else 0)
    return f"{hour:02d}{time[2]}"


def _as_iso(texts: Any) -> tuple[Any, bool]:
    """Dates with the day, or the month, first as those that begin with the year."""
    first = re.match(_DAY_FIRST, str(texts.iloc[0]))
    if first is None:
        # A zone behind a space.
        return texts.str.replace(r" ([-+]\d\d:?\d\d)$", r"\1", regex=True), True
    parts = texts.str.extract(_DAY_FIRST)
    day, month = parts["day"], parts["month"].str.lower()
    certain = first["sign"] == "." or first["month"].isalpha()
    if first["month"].isalpha():
        month = month.map({name: str(1 + i) for i, name in enumerate(_MONTHS)})
    elif not certain:
        days, months = day.astype(float), month.astype(float)
        certain = bool(days.max() > 12 or months.max() > 12)
        if months.max() > 12 or (not certain and days.nunique() < months.nunique()):
            day, month = month, day
    rest = texts.str.replace(_DAY_FIRST, "", n=1, regex=True)
    return parts["year"] + "-" + month.str.zfill(2) + "-" + day.str.zfill(2) + rest, certain
