"""What the engines share: events as rows of numbers, counters, the clock; and their contract.

An engine works in the unit of time in which the forcing period (`Oscillator.forcing_period`) is a
turn, 2 pi, and in coordinates in which the stops rest. It is called with arrays that it changes:

clock : turns, phase of the forcing in [0, 2 pi), and what the phase lacks by rounding.
state : position (from the origin of the mode), velocity, greatest approach velocity so far, and
    energy lost at the stops and by friction per mass.
count : mode, whether stuck (0 or 1), impacts, sticks, contacts, rows written, legs (or steps).

A row of `COLUMNS` numbers tells an event, and the state after it: turns, phase, kind, stop (its
place in `Oscillator.stops`, or -1), mode, position, velocity, approach velocity.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

# Kinds of event. IMPACT is of a rigid stop; a soft contact goes from TOUCH to PART; STICK and
# RELEASE are of rigid stops and of friction; REVERSE is where friction changes its sign; MARK is
# none, but a state to go on from.
START, IMPACT, STICK, RELEASE, TOUCH, PART, REVERSE, MARK = range(8)
# Statuses: all done; the buffer of events is full; the work allowed is spent; numbers overflowed; a
# function of the user's returned what cannot be.
DONE, FULL, EXHAUSTED, DIVERGED, BROKEN = range(5)
STATUS = ("complete", "", "work limit", "diverged", "broken law")
COLUMNS = 8
COUNTERS = 7


class Engine(Protocol):
    """What `simulate` and `Motion` ask of an engine."""

    omega: float
    """Angular frequency of the reference, per unit of the oscillator's time."""

    def begin(self, q: float, v: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """State and counters of a start at q, v (in the engine's units) and that phase."""

    def run(
        self,
        clock: np.ndarray,
        state: np.ndarray,
        count: np.ndarray,
        events: np.ndarray,
        end_turns: float,
        end_phase: float,
        legs: int,
    ) -> int:
        """Move to the end, writing events until they are full; a status.

        An `events` without rows is not written to.
        """

    def place(self, mode: Any, q: Any) -> Any:
        """Position in the coordinates of the stops, of positions from the origins of modes."""

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants, each after the row that `where` names."""

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, from the TOUCH in row `first` to row `last`.

        A contact that the run cut short, at the turns and phase `end`, has `last` = the number of
        rows.
        """
