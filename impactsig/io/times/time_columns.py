"""Recognise columns of times by their headings."""

from __future__ import annotations

import re

# In lower case, with spaces for underscores and signs.
_PLAIN = frozenset(("t", "time", "times", "zeit", "temps", "tiempo", "tempo", "x value", "xdata"))
_SPOKEN = frozenset(
    (
        *("timestamp", "time stamp", "elapsed", "elapsed time", "time elapsed", "seconds elapsed"),
        *("relative time", "time relative", "time since start", "test time", "running time"),
        *("zeitstempel", "messzeit"),
    )
)
_AS_UNIT = frozenset(("s", "sec", "second", "seconds", "ms", "msec", "us", "µs", "milliseconds"))
_COUNTED = frozenset(("microseconds", "millis", "micros"))
_AXIS = frozenset(("", "x", "x axis"))  # with a unit of time
_NAMES = _PLAIN | _SPOKEN | _AS_UNIT | _COUNTED
# "elapsed_ms": the unit is the last word. "Run 1: Time", "Time Run 1": one of several runs.
_ENDING = re.compile(r"(t|time|timestamp|zeit|elapsed|elapsed time) ?(s|ms|us|µs|ns)")
_RUN = re.compile(r"(run ?\d+|latest) | (run ?\d+)")
# catman numbers its columns of times; loggers of telephones have one for each sensor.
_NUMBERED = re.compile(r"(time|zeit) \d+ .*|.*timestamp.*")
_EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))  # counted since 1970: 1e11 s is the year 5138
FACTORS = {
    "": 1.0,
    "s": 1.0,
    "sec": 1.0,
    "secs": 1.0,
    "second": 1.0,
    "seconds": 1.0,
    "sekunden": 1.0,
    "ms": 1e-3,
    "msec": 1e-3,
    "milliseconds": 1e-3,
    "millis": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "usec": 1e-6,
    "microseconds": 1e-6,
    "micros": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
    "h": 3600.0,
}


def time_factor(name: str, unit: str) -> float | None:
    """Seconds in one unit of a column with this name; None if it is not a column of times."""
    if name.strip() in ("T", "S"):  # temperature, strain: capital letters are other quantities
        return None
    plain = re.sub(r"[^\w]+|_", " ", name.lower()).strip()
    plain = _RUN.sub("", plain)
    unit = unit.strip().lower()
    if ending := _ENDING.fullmatch(plain):
        plain, unit = ending[1], unit or ending[2]
    if unit in FACTORS and unit and (plain in _AXIS or _NUMBERED.fullmatch(plain)):
        return FACTORS[unit]
    if plain not in _NAMES or (unit not in FACTORS):
        return None
    return FACTORS[unit or (plain if plain in FACTORS else "")]


def epoch_factor(first: float) -> float:
    """Seconds in the unit of times that count since 1970, judged by their size."""
    return next((factor for least, factor in _EPOCHS if abs(first) >= least), 1.0)
