"""Impact times in cycles of a measured forcing: instants of a tacho, or a channel."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .._arguments import reals
from ..errors import InvalidInput
from ..recording import Recording

Forcing = Recording | Iterable[float]
SIDE = 0.25  # of its range by which a signal must come to either side of its middle
UNEVEN = 0.25  # of a forcing period by which an instant may be off
CLOCK_ERROR = 2e-3
"""Share by which a stated forcing frequency may be off on the clock of the recording."""
HARMONICS, UNLOCKED = 4, 0.025
"""Harmonics of the forcing, and the squared vector strength of the impacts' phases below which they
are not forced by it. Of 376 irregular trains of 100 or 500 impacts of all kinds of machine the
strongest harmonic has 0.03 or more; at periods that are wrong, 0.02."""
ENOUGH = 1000  # impacts that tell it


def keeps_phase(time: np.ndarray, frequency: float) -> bool:
    """Whether impacts come more often at some phases of a forcing than at others.

    Chance alone gathers the phases of a few tens as much: these always do.
    """
    time = time[:ENOUGH] - time[0]
    if not time[-1]:
        return True
    trials = frequencies_about(time, frequency)
    order = np.argsort(np.abs(trials - frequency))  # the stated one first, which mostly tells it
    return any(
        gathered(time, harmonic * trial) > UNLOCKED
        for trial in trials[order]
        for harmonic in range(1, HARMONICS + 1)
    )


def frequencies_about(time: np.ndarray, frequency: float) -> np.ndarray:
    """Frequencies within 0.2 %, as close as impacts from time 0 on tell them apart."""
    step = 0.2 / time[-1]
    reach = min(CLOCK_ERROR * frequency, 2000 * step)
    trials: np.ndarray = np.arange(frequency - reach, frequency + reach + step / 2, step)
    return trials


def gathered(time: np.ndarray, frequency: float) -> float:
    """Squared vector strength of the phases."""
    return float(np.abs(np.exp(2j * np.pi * frequency * time).mean()) ** 2)


def forcing_cycles(forcing: Forcing, time: np.ndarray) -> tuple[np.ndarray, float]:
    """Times in cycles of the forcing, and its mean period [s].

    The instants are those of one phase of the forcing. Where a few are missing, the time between is
    divided evenly.

    Raises
    ------
    InvalidInput
        If they do not cover the times, or do not come once in each period.
    """
    instants = rising_instants(forcing) if isinstance(forcing, Recording) else _instants(forcing)
    if len(instants) < 2 or (np.diff(instants) <= 0).any():
        raise InvalidInput(
            "forcing",
            f"{len(instants)} instants",
            "two or more ascending instants, or a channel that rises once in each forcing period",
        )
    step = np.diff(instants)
    period = float(np.median(step))
    turns = np.round(step / period)
    if (np.abs(step / period - turns) > UNEVEN * turns).any() or (turns < 1).any():
        raise InvalidInput(
            "forcing",
            f"instants {step.min():.4g} to {step.max():.4g} s apart",
            "one in each forcing period",
            "Give one instant of each period; a tacho of more pulses a turn has to be thinned",
        )
    if time[0] < instants[0] - period or time[-1] > instants[-1] + period:
        raise InvalidInput(
            "forcing",
            f"instants from {instants[0]:.6g} to {instants[-1]:.6g} s",
            f"instants that cover the impacts, from {time[0]:.6g} to {time[-1]:.6g} s",
        )
    count = np.concatenate(([0.0], np.cumsum(turns)))
    cycles = np.interp(time, instants, count)
    early, late = time < instants[0], time > instants[-1]
    cycles[early] = (time[early] - instants[0]) / period
    cycles[late] = count[-1] + (time[late] - instants[-1]) / period
    return cycles, float((instants[-1] - instants[0]) / count[-1])


def _instants(forcing: Iterable[float]) -> np.ndarray:
    required = "a Recording of one channel, or instants [s], one a forcing period"
    values = reals("forcing", forcing, required)
    if values.ndim != 1 or not np.isfinite(values).all():
        raise InvalidInput("forcing", forcing, required)
    return values


def rising_instants(recording: Recording) -> np.ndarray:
    """Instants at which a signal rises through its middle, with hysteresis."""
    samples = recording.samples
    if samples.ndim > 1 and samples.shape[1] > 1:
        raise InvalidInput(
            "forcing",
            f"{samples.shape[1]} channels",
            "one channel",
            "Recording.channel chooses it",
        )
    values = samples.ravel().astype(np.float64)
    usable = values[np.isfinite(values)]
    low, high = (float(usable.min()), float(usable.max())) if len(usable) else (0.0, 0.0)
    middle, side = 0.5 * (low + high), SIDE * (high - low)
    beyond = np.where(values > middle + side, 1, np.where(values < middle - side, -1, 0))
    decided = np.flatnonzero(beyond)
    rising = np.flatnonzero(np.diff(beyond[decided]) == 2)
    at = np.empty(len(rising))
    for k, one in enumerate(rising):
        first, last = int(decided[one]), int(decided[one + 1])
        below = first + int(np.flatnonzero(values[first:last] <= middle)[-1])
        share = (middle - values[below]) / (values[below + 1] - values[below])
        at[k] = below + share
    return recording.start + at / recording.rate
