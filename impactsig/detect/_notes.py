"""Notes on what makes a force detection doubtful."""

from __future__ import annotations

import numpy as np

from ..impacts import CLIPPED, UNRESOLVED
from ._force import LONGEST
from ._force_impacts import ForceImpacts
from ._merge import Columns

FAINT = 1.4
"""Times the threshold: below it, as many impacts are missed as are found."""
SHORT = 0.5
"""Of the usual contact: a time constant below it takes most of the pulse."""
MANY = 0.1
"""Share of the impacts that a note is worth."""
CLOSE = 1.5
"""Contacts after the start of one impact, within which another may be the same, ringing."""
OFTEN, ALIKE, EQUAL, FEWEST = 0.4, 0.12, 0.005, 5
"""Share of impacts that are followed so, relative spread of heights and delays, and how many there
are, from which on (up to which) the sensor is suspected."""


def force_notes(found: ForceImpacts, rate: float, settled: bool) -> tuple[str, ...]:
    """Notes, each with the setting that would help.

    Parameters
    ----------
    rate : float
        Samples a second.
    settled : bool
        The record, not the user, decided how long a contact may be.
    """
    count = len(found.columns)
    notes = []
    if count:
        faint = (
            float(np.mean(found.sure < FAINT * found.threshold / found.response_noise))
            if (found.response_noise > 0)
            else 0.0
        )
        if faint > MANY:
            notes.append(
                f"{faint:.0%} of the impacts are hardly stronger than the threshold, so fainter "
                "ones are missed: a lower least_probability finds more of them, and more that "
                "are none."
            )
        overlapping = float(np.mean((found.flags & UNRESOLVED) > 0))
        if overlapping > MANY:
            notes.append(
                f"{overlapping:.0%} of the impacts overlap a neighbour: their contact times are "
                "lower bounds, and two that follow within half a contact are one."
            )
        clipped = float(np.mean((found.flags & CLIPPED) > 0))
        if clipped > MANY:
            notes.append(
                f"{clipped:.0%} of the impacts are clipped: their peaks and impulses are lower "
                "bounds without an error. A greater range of the converter would show them."
            )
        if found.width < 1.5:
            notes.append(
                "A contact lasts about one sample: contact times are upper bounds; a higher "
                "sampling rate would resolve them."
            )
    if count and 0 < found.constant < SHORT * float(np.median(found.columns[:, 1])):
        notes.append(
            f"The sensor is AC coupled, with a time constant of {found.constant / rate:.2g} s, "
            "shorter than half a contact: contact times, peaks and impulses are as exact as it is "
            "read from the undershoot. A sensor with a longer one would show them."
        )
    usual = max(LONGEST[0], LONGEST[1] / rate)
    if count and settled and found.longest > usual:
        notes.append(
            f"No pulse is shorter than {usual:g} s, so longer ones were taken for impacts: give "
            "contact_time if they are none, or to find such in every record of a series."
        )
    if found.in_step:
        notes.append(
            f"{found.in_step} weak pulses that come once in each period of the mains were taken "
            "for interference, of what switches: if they are impacts, give threshold."
        )
    if silent := _durations(found, "dropout"):
        notes.append(
            f"The signal drops out {len(silent)} times, for {sum(silent) / rate:.3g} s in all: "
            'impacts are missed there. Where these samples are NaN, gaps="split" takes no interval '
            "across them."
        )
    if coded := _durations(found, "code"):
        values = sorted({one.height for one in found.disturbances if one.kind == "code"})
        notes.append(
            f"{sum(coded):.0f} samples are {' or '.join(f'{one:g}' for one in values)}, far from "
            "all others, and taken for error codes: they are filled from their neighbours, and "
            "impacts that they hide are missed."
        )
    if bursts := _durations(found, "burst"):
        notes.append(
            f"There are {len(bursts)} bursts of noise, {sum(bursts) / rate:.2g} s in all, whose "
            "crests are taken for no impacts: impacts in them are missed, and some crests may be "
            "left."
        )
    wide = _durations(found, "wide")
    if len(wide) > 0.5 * count and len(wide) > 2:
        typical = np.median(wide) / rate
        notes.append(
            f"{len(wide)} pulses of about {typical:.2g} s are longer than a contact may be "
            f"({found.longest:g} s): if they are impacts, give contact_time=(0, {3 * typical:.2g})."
        )
    return tuple(notes)


def ringing_note(columns: Columns) -> tuple[str, ...]:
    """A note if most impacts are closely followed by another, all alike; else empty."""
    time, contact, peak = (columns[name] for name in ("time", "contact_time", "peak"))
    delays = np.diff(time)
    close = delays < CLOSE * contact[:-1]
    count = int(np.count_nonzero(close))
    share = count / max(len(time) - count, 1)
    if share < OFTEN or count < FEWEST:
        return ()
    heights = np.abs(peak)
    delay, late = _spread(delays[close])
    ratio, uneven = _spread((heights[1:] / heights[:-1])[close])
    # Where all are equally high, alike pairs tell nothing.
    different = _spread(heights[:-1][close])[1]
    if different < EQUAL or max(late, uneven) > min(ALIKE, different):
        return ()
    return (
        f"{share:.0%} of the impacts are followed after {delay:.2g} s, while they last or hardly "
        f"later, by one of {ratio:.2g} of their height, all much alike: a sensor that rings does "
        f"so. merge_within={CLOSE * delay:.2g} takes them for one.",
    )


def _spread(values: np.ndarray) -> tuple[float, float]:
    """Median, and robust relative standard deviation."""
    low, median, high = np.quantile(values, (0.16, 0.5, 0.84))
    return float(median), float(0.5 * (high - low) / median)


def _durations(found: ForceImpacts, kind: str) -> list[float]:
    """Durations of the disturbances of a kind, in samples."""
    return [one.duration for one in found.disturbances if one.kind == kind]
