"""The rate, the names and the units that an instrument writes above or beside its samples.

The header of a text file is read as pairs of a key and a value, however they are set out: in two
cells, as ``key: value`` or ``key = value``, or with the value below its key. The tables in this
file say what the keys mean: a new instrument needs one more word in them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from .._units import is_unit, split_heading
from ..times.time_columns import FACTORS
from ..times.timebase import TimeBase, printed_step
from ._dialect import Dialect, is_number, split_line

# Words without spaces and signs, in lower case. Those after "with a unit" say too little alone.
_STEP = re.compile(
    "increment|(xaxis)?delta|[tx]incr?(ement)?|dt|delta([tx]|time)"
    "|sampl(e|ing)(interval|period|time)|time(increment|step|interval)|[hx]resolution|abtastintervall"
)
# Not "period": oscilloscopes write that of the signal, as they measure it.
_STEP_WITH_A_UNIT = re.compile("interval|step|resolution|clock")
_RATE = re.compile(
    "(default)?sampl(e|ing)(rate|frequency)|samplespersecond|(scan|data|acquisition)rate|fs"
    "|(abtast|mess)rate"
)
_RATE_WITH_A_UNIT = re.compile("rate|sampling|acquisition|sr|clock")
_START = re.compile("start(time)?|t0|tstart|x(start|zero|org|0|at0)|hoffset")
_NAMES = re.compile("channel(title|names?)|tracename|source|signalname|waveform")
_UNITS = re.compile("unitname|vunit|verticalunits|channelunits")

_AGREE = 0.01  # share by which two printed rates of one file may differ
_NUMBER = r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"(?:[A-Za-z]+\s?:\s?)?({_NUMBER})\s*([^\d\s].*)?")
_RATE_UNIT = re.compile(
    r"([kKMG]?)\s?(?:hz|hertz|s/s|sa/s|sps|samples/s(?:ec(?:ond)?)?|samples per second|1/s)", re.I
)
_MANY = {"": 1.0, "k": 1e3, "K": 1e3, "M": 1e6, "m": 1e6, "G": 1e9, "g": 1e9}
_APART = re.compile(r"(.*?[^\W\d_][^=:]*?)\s*[=:]\s*(.*)")
_NUMBER_AFTER = re.compile(rf"(\D*?[^\W\d_][\s)\]]+)({_NUMBER}(?:\s*[^\d\s].*)?)")


class Preamble(NamedTuple):
    """What the header of a file says of its samples.

    Attributes
    ----------
    base : TimeBase or None
        Rate and time of sample 0.
    key : str
        Where the rate stands.
    names, units : tuple of str
        Those of the channels, without the column of times.
    """

    base: TimeBase | None
    key: str
    names: tuple[str, ...]
    units: tuple[str, ...]


def read_preamble(dialect: Dialect, beside: Sequence[Sequence[str]] = ()) -> Preamble:
    """Read the lines above the data, and the cells `beside` it, row by row."""
    rows = [_cells(line, dialect.delimiter) for line in dialect.above]
    rows += [list(cells) for cells in beside]
    step = rate = None
    start = 0.0
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    for key, values in _pairs(rows, dialect.decimal):
        name, bracketed = split_heading(key)
        word = re.sub(r"[\W_]+", "", name).lower()
        if _NAMES.fullmatch(word):
            names = names or tuple(values)
        elif _UNITS.fullmatch(word):
            units = units or tuple(re.sub(r"\w+:", "", value) for value in values)
        elif not (quantity := _quantity(values, bracketed, dialect)):
            continue
        elif _START.fullmatch(word) and (not quantity[1] or quantity[1] in FACTORS):
            start = float(quantity[0]) * FACTORS[quantity[1]]
        elif (factor := _step_factor(word, quantity[1])) and step is None:
            step = f"{key}: {values[0]}", printed_step(quantity[0], 0.0, factor)
        elif (factor := _rate_factor(word, quantity[1])) and rate is None:
            hertz = float(quantity[0]) * factor
            if np.isfinite(hertz) and hertz > 0:
                rate = f"{key}: {values[0]}", TimeBase(hertz, 0.0)
    found = rate or step
    if found is None:
        return Preamble(None, "", names, units)
    key, base = found
    rates = [stated[1].rate for stated in (rate, step) if stated and stated[1].rate]
    if rate and step and abs(rates[-1] / rates[0] - 1) > _AGREE:
        base = TimeBase(None, 0.0, f"Its header contradicts itself: {rate[0]}, but {step[0]}")
    return Preamble(base._replace(start=start), key, names, units)


def _cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line of the header, which may be delimited otherwise than the data."""
    for way in dict.fromkeys((delimiter.strip(), "\t", ";", ",")):
        if way and way in line:
            return split_line(line, way)
    return [line.strip().strip('"')]


def _pairs(rows: list[list[str]], decimal: str) -> Iterator[tuple[str, list[str]]]:
    """Keys and what stands after them: in the same cell, in the next ones, or below."""
    for row, below in zip(rows, [*rows[1:], list[str]()], strict=False):
        for index, cell in enumerate(row):
            if apart := _APART.fullmatch(cell):
                after = [apart[2]] if apart[2] else _run(row[index + 1 :])
                yield apart[1], after
            elif index == 0 and len(_run(row)) > 1 and not is_number(cell, decimal):
                yield cell, _run(row[1:])
            elif index == 0 and len(row) == 1 and (spoken := _NUMBER_AFTER.fullmatch(cell)):
                yield spoken[1], [spoken[2]]
            if index < len(below) and is_number(below[index], decimal):
                yield cell, [below[index]]


def _run(cells: list[str]) -> list[str]:
    """The cells before the first empty one."""
    return cells[: cells.index("")] if "" in cells else cells


def _quantity(values: list[str], bracketed: str, dialect: Dialect) -> tuple[str, str] | None:
    """A number and its unit; None where there is none, or channels differ in it."""
    found = [_VALUE.fullmatch(value) for value in values]
    if not found or found[0] is None:
        return None
    # "50000 Hz. Sample values on linear scale."
    number, unit = found[0][1], (found[0][2] or "").partition(". ")[0].strip() or bracketed
    if (
        not unit
        and len(values) > 1
        and found[1] is None
        and (is_unit(values[1]) or _RATE_UNIT.fullmatch(values[1]))
    ):
        unit = values[1]
    each = [match[1] for match in found if match]
    if not all(is_number(one, dialect.decimal) for one in each):  # "10,10" is two
        return None
    others = {float(dialect.number(one)) for one in each}
    return (dialect.number(number), unit) if len(others) == 1 else None


def _step_factor(word: str, unit: str) -> float | None:
    """Seconds in the unit of a sampling step, if that is what the word means."""
    known = _STEP.fullmatch(word) or (_STEP_WITH_A_UNIT.fullmatch(word) and unit)
    return FACTORS.get(unit.lower()) if known else None


def _rate_factor(word: str, unit: str) -> float | None:
    """Hertz in the unit of a sampling rate, if that is what the word means."""
    if not (_RATE.fullmatch(word) or (_RATE_WITH_A_UNIT.fullmatch(word) and unit)):
        return None
    if not unit:
        return 1.0
    match = _RATE_UNIT.fullmatch(unit)
    return _MANY[match[1]] if match else None
