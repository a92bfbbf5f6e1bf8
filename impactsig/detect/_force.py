"""Impacts in a force record of a load cell, strain gauge or accelerometer.

The record is gone through twice. The first pass surveys it: its range and its steepest stretches,
from which the direction of the pulses follows. The second goes from second to second
(`search/spans.py`): background, converter, hum, responses of many widths, events. There the events
become impacts or disturbances, and each impact is measured at its own width (`_force_stretch.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from ..impacts import Disturbance
from ._force_impacts import ForceImpacts, Found, stretches_of
from ._force_stretch import StretchSearch, Wanted
from .instrument.codes import find_codes, without_codes
from .instrument.coupling import time_constant
from .instrument.survey import survey
from .search.direction import direction
from .search.judging import LEAST_SAMPLES
from .search.span import NO_RUNS
from .signal.grid import Grid
from .signal.stream import FRAME, Piece, frames

LONGEST, LONGER = (0.03, 64.0), (1.0, 1024.0)
"""Longest contact unless the user says otherwise, and where no pulse is as short as that: so many
seconds or samples, whichever is more."""
MOST_SAMPLES = 1e6
"""Longest contact that may be asked for."""


def detect_force(
    pieces: Callable[[], Iterable[Piece]],
    rate: float,
    wanted: Wanted,
    *,
    in_memory: bool,
    others: ForceImpacts | None = None,
) -> ForceImpacts | None:
    """Detect and measure the impacts; None if the record is constant or too short.

    Parameters
    ----------
    pieces : callable
        Gives the record's stretches of finite samples, anew at each call.
    rate : float
        Samples a second.
    in_memory : bool
        The pieces are views that stay valid: no frame needs to be copied.
    others : ForceImpacts, optional
        Impacts that point the other way, whose pulses are left out.
    """
    record = survey(frames(pieces()), copy=not in_memory)
    if record.samples < LEAST_SAMPLES or record.lowest == record.highest:
        return None
    codes = find_codes(record, pieces()) if others is None else others.codes
    if codes:
        found = _without_codes(pieces, codes, rate, wanted, in_memory, others)
        # Otherwise they are the impacts, as in the record of a switch.
        if others is not None or (found is not None and len(found.columns)):
            return found
    greatest = max(abs(record.lowest), abs(record.highest))
    # A power of two changes no digit; squares of what is far from 1 would not be numbers.
    scale = 1.0 if 1e-60 < greatest < 1e60 else 2.0 ** -math.floor(math.log2(greatest))
    constant = time_constant(record.strong, scale) if others is None else others.constant
    left_out = NO_RUNS if others is None else stretches_of(others)
    size = max(length for _, length in record.segments) if in_memory else 16 * FRAME

    def search(longest: float, wanted: Wanted = wanted) -> ForceImpacts:
        grid = Grid(rate, longest * rate)
        sign, either = wanted.polarity, False
        if not sign:
            sign, either = direction(record, grid, scale, constant)
        limit = record.highest if sign > 0 else -record.lowest
        found = Found(longest, scale, constant, wanted.contact_level == 0)
        for frame in frames(pieces(), size):
            if frame.offset == 0:
                total = next(length for first, length in record.segments if first == frame.segment)
                stretch = StretchSearch(
                    grid,
                    total,
                    sign,
                    scale,
                    limit,
                    wanted,
                    found,
                    repeats=record.repeats,
                    left_out=left_out - frame.segment,
                )
            stretch.feed(frame)
        result = found.result(sign, record.highest if sign > 0 else record.lowest)
        return result._replace(either=either)

    if wanted.longest is not None:
        return search(wanted.longest)
    usual = max(LONGEST[0], LONGEST[1] / rate)
    found = search(usual)
    if len(found.columns) or not found.moves:
        return found
    # None is shorter; what a search for so long ones leaves of hum may look as if it were.
    longer = wanted._replace(shortest=max(wanted.shortest, usual))
    return search(max(LONGER[0], LONGER[1] / rate), longer)


def _without_codes(
    pieces: Callable[[], Iterable[Piece]],
    codes: tuple[float, ...],
    rate: float,
    wanted: Wanted,
    in_memory: bool,
    others: ForceImpacts | None,
) -> ForceImpacts | None:
    """As `detect_force`, with the nearest sample in place of error codes."""
    runs: list[Disturbance] = []
    found = detect_force(
        lambda: without_codes(pieces(), codes, runs),
        rate,
        wanted,
        in_memory=in_memory,
        others=others and others._replace(codes=()),
    )
    if found is None:
        return None
    together = sorted((*found.disturbances, *runs), key=lambda one: one.start)
    return found._replace(disturbances=together, codes=(*codes, *found.codes))
