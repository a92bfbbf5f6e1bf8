"""Kernels that handle events under delayed feedback, for steps and for series."""

from __future__ import annotations

from ...._compiling.compiled import inlined, kernel
from ....simulation.basis.delay import Control
from ....simulation.basis.events import Q
from ....simulation.exact.passing import time_until
from ....simulation.stepping.contact import settle_event
from ....simulation.stepping.rates import Functions
from .force import signal_of
from .rows import LAPS, recall, side_of_limit


@inlined
def under(f, feedback, line, past, region):
    """The user's functions together with the control force."""
    return Functions(f.law, f.upper, f.lower, Control(feedback, line, past, region))


@kernel
def settle(p, f, fb, line, laps, leg, s, clock, state, count, events, due, end_turns, end_phase):
    """Handle the event `due` that a step has ended at.

    Returns what `settle_event` does, where what is fed back is found, and the region of the force.
    """
    count[LAPS] = laps[0]
    past, smooth = recall(fb, line, count, clock)
    x = state[Q] + leg.origin
    region, _ = side_of_limit(fb, line, past, count, signal_of(fb, x, 0.0))
    acting = under(f, fb, line, past, region)
    calm = min(time_until(clock, end_turns, end_phase), smooth)
    return settle_event(p, acting, s, leg, clock, state, count, events, due, calm), past, region
