"""State of the search for one second of a force record."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ._response_kernels import CREST
from .events.width_kernels import EVENT

Faint = tuple[np.ndarray, np.ndarray]
"""Upward and downward crests of the responses at one width."""
# Nothing is ever written into these.
NOTHING, NO_RUNS = np.empty(0, np.int64), np.empty((0, 2), np.int64)
NO_CRESTS, NO_EVENTS = np.empty((0, CREST)), np.empty((0, EVENT))


def united(runs: np.ndarray) -> np.ndarray:
    """Runs of samples in order, those that overlap as one."""
    if not len(runs):
        return runs
    runs = runs[np.argsort(runs[:, 0], kind="stable")]
    reach = np.maximum.accumulate(runs[:, 1])
    new = np.flatnonzero(runs[1:, 0] > reach[:-1]) + 1
    return np.column_stack((runs[np.r_[0, new], 0], reach[np.r_[new - 1, len(runs) - 1]]))


def _nothing() -> np.ndarray:
    return NOTHING


@dataclass
class Span:
    """Samples, noise, crests and events of one second."""

    first: int
    last: int
    values: np.ndarray  # as they came
    before: np.ndarray  # the last samples of the span before, as they came
    clean: np.ndarray  # without hum and glitches
    # First samples of what is filled in, and those after the last.
    dropouts: np.ndarray = field(default_factory=lambda: NO_RUNS)
    filled: np.ndarray = field(default_factory=lambda: NO_RUNS)  # those, and pulses left out
    medians: np.ndarray = field(default_factory=_nothing)
    moves: np.ndarray = field(default_factory=_nothing)  # from one to the next, up or down
    step: float = 0.0  # of the converter, 0 if none shows
    range: float = 0.0
    mask: np.ndarray = field(default_factory=_nothing)  # what is no background
    # Of the background in blocks, above the baseline, and of how many samples.
    sums: np.ndarray = field(default_factory=_nothing)
    counts: np.ndarray = field(default_factory=_nothing)
    lines: tuple[float, ...] = ()  # of the mains, that it shows by itself
    hum: dict[float, float] = field(default_factory=dict)  # amplitude by frequency
    spikes: np.ndarray = field(default_factory=_nothing)  # samples that stand alone
    glitches: np.ndarray = field(default_factory=_nothing)  # the spikes that are glitches
    runs: int = 0  # of samples that stand out, longer than a glitch
    sigma: float = 0.0  # of the background's samples
    own_noise: np.ndarray = field(default_factory=_nothing)  # of the responses
    noise: np.ndarray = field(default_factory=_nothing)  # the same, of the seconds around
    codes: np.ndarray = field(default_factory=_nothing)  # least responses, by the converter's step
    crests: np.ndarray = field(default_factory=lambda: NO_CRESTS)
    bursts: list[tuple[float, float, float]] = field(default_factory=list)  # start, end, height
    events: np.ndarray = field(default_factory=lambda: NO_EVENTS)
    faint: dict[int, Faint] = field(default_factory=dict)  # crests by rung
