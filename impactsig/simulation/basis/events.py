"""Names of the numbers that engines share: clock, state, counters, events, statuses.

Compiled kernels take these constants as they are compiled, so an edit here compiles all of them
anew: whatever changes more often belongs elsewhere.
"""

from __future__ import annotations

import math
from typing import Any

TURN = 2 * math.pi
"""A turn of the reference, the forcing period, in the engine's unit of time."""

# The clock: turns, phase of the forcing in [0, 2 pi), and what the phase lacks by rounding.
TURNS, PHASE, LOW = range(3)

# The state of an oscillator: position (from the origin of the mode), velocity, greatest approach
# velocity so far, and energy lost at the stops and by friction per mass.
Q, V, FASTEST, LOST = range(4)
# It goes on, where it is stepped, with the step to try next, the greatest speed, and for each stop
# the approach velocity of its last contact.
STEP, SPEED, APPROACH = range(LOST + 1, LOST + 4)

# The counters: mode, whether stuck (0 or 1), impacts, sticks, contacts, rows written, legs (or
# steps).
MODE, STUCK, IMPACT_COUNT, STICK_COUNT, CONTACT_COUNT, ROW_COUNT, LEG_COUNT = range(7)
COUNTERS = LEG_COUNT + 1
# They go on, where it is stepped, with the stop that holds the mass (-1: friction alone), and
# whether rows have been written.
HOLDER, BEGUN = range(COUNTERS, COUNTERS + 2)

# A row tells an event and the state after it: turns, phase (as the clock), kind, stop (its place in
# `Oscillator.stops`, or -1), mode, position, velocity, approach velocity.
ROW_KIND, ROW_STOP, ROW_MODE, ROW_Q, ROW_V, ROW_APPROACH = range(2, 8)
COLUMNS = ROW_APPROACH + 1

# Kinds of event. IMPACT is of a rigid stop; a soft contact goes from TOUCH to PART; STICK and
# RELEASE are of rigid stops and of friction; REVERSE is where friction changes its sign; MARK is
# none, but a state to go on from.
START, IMPACT, STICK, RELEASE, TOUCH, PART, REVERSE, MARK = range(8)

# Statuses: all done; the buffer of events is full; the work allowed is spent; numbers overflowed; a
# function of the user's returned what cannot be; no row of the delay line is left; nothing more is
# to come.
DONE, FULL, EXHAUSTED, DIVERGED, BROKEN, LINE_FULL, ENDLESS = range(7)
STATUS = ("complete", "", "work limit", "diverged", "broken law", "", "")

# Of a beam the state is the modal displacements and velocities. Beside it: the regime and what is
# known of the start of the leg; greatest approach velocity, and energy lost at the stop per modal
# mass. A row has the regime, what is known and the approach velocity (of a stick: the time that its
# chatter lasts) in place of stop, mode and position; then the state.
REGIME, KNOWN = range(2)
GREATEST, SPENT = range(2)
ROW_REGIME, ROW_KNOWN, BEAM_APPROACH = range(ROW_KIND + 1, ROW_KIND + 4)
HEAD = BEAM_APPROACH + 1

# Of a flow: time, and what rounding took from it; step to try next (0: none yet), and side of the
# level that the signal is on (-1 or 1; 0: not known).
TIME, ROUNDED = range(2)
WISH, LEVEL_SIDE = range(2)

# A row of the delay line is a step: its beginning, as the clock, and its length.
LENGTH = 2

# A strobe: position, velocity, impacts in the period before it and the energy lost in it.
STROBE_IMPACTS, STROBE_ENERGY = range(2, 4)
STROBE = STROBE_ENERGY + 1


def row_of(kind: int, clock: Any, state: Any, count: Any) -> list[Any]:
    """An event row for the present state, at no stop."""
    return [
        clock[TURNS], clock[PHASE], kind, -1, count[MODE], state[Q], state[V], 0.0
    ]  # fmt: skip
