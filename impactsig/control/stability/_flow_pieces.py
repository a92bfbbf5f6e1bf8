"""Linearisation of a flow about a periodic orbit, under delayed feedback."""

from __future__ import annotations

import numpy as np

from ...dynamics.periodic.flow_orbits import FlowOrbit
from ...dynamics.periodic.flow_shooting import rate_at, tangent_pieces
from ..feedback import DelayedFeedback
from ..running.flow import number_of
from ._variation import State, Variation, laps_in, moving


def of_flow(orbit: FlowOrbit, feedback: DelayedFeedback) -> Variation:
    """The linearised map of deviations from an orbit of a flow.

    Raises
    ------
    InvalidInput
        If the delay is no multiple of the period, or the signal no coordinate.
    """
    laps = laps_in(feedback, orbit.period, f"the orbit's period, {orbit.period!r}")
    flow, k = orbit.system, number_of(orbit.system, feedback.signal)
    pieces, rates = [], []
    for h, times, states, slopes in tangent_pieces(flow, orbit.state, orbit.period, orbit._parts):
        pieces.append(moving(h, slopes, k, k, feedback.gain))
        rates.append([rate_at(flow, t, y)[k] for t, y in zip(times, states, strict=True)])
    along = None
    if not orbit.forced:
        late = np.array(rates)[:, :, None]
        along = State(rate_at(flow, 0.0, orbit.state)[:, None], [late] * laps, [])
    return Variation(pieces, laps, feedback.memory, feedback.gain, along=along)
