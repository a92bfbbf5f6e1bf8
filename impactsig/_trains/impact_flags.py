"""What makes the measurement of an impact doubtful, as bits of one number."""

from __future__ import annotations

OPEN_START = 1
"""The pulse had begun before the record did: contact time and impulse are lower bounds."""
OPEN_END = 2
"""The pulse had not ended when the record did: contact time and impulse are lower bounds."""
CLIPPED = 4
"""The peak reached the limit of the instrument: peak and impulse are lower bounds."""
UNRESOLVED = 8
"""The pulse overlaps a neighbour: it is measured as far as the valley between them."""
INFERRED = 16
"""Not measured at all, but put in by `impactsig.repair_intervals` where one was missed."""

EDITED = 32
"""Put in or moved by hand (`Impacts.edit`)."""

FLAG_NAMES = {
    OPEN_START: "open start",
    OPEN_END: "open end",
    CLIPPED: "clipped",
    UNRESOLVED: "unresolved",
    INFERRED: "inferred",
    EDITED: "edited",
}


def flag_names(flags: int) -> str:
    """The names of the bits set in `flags`, separated by commas."""
    return ", ".join(name for bit, name in FLAG_NAMES.items() if flags & bit)
