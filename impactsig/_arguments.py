"""Arguments that many functions share: bounded numbers, threads, random streams."""

from __future__ import annotations

import math
import os
from numbers import Integral
from typing import TYPE_CHECKING, Any, TypeAlias

from .errors import InvalidInput

if TYPE_CHECKING:  # the command's help needs no arrays
    import numpy as np

Seed: TypeAlias = "int | np.random.SeedSequence | np.random.Generator | None"


READING = (
    *("channel", "start", "stop", "rate", "resample", "scale", "offset", "unit", "sensor", "raw"),
)
"""Arguments of `read` that say how a recording is read."""
PER_CHANNEL = ("scale", "offset", "unit", "sensor")
"""Those that differ from channel to channel, where several are read."""


def number(
    name: str,
    value: Any,
    *,
    least: float = -math.inf,
    most: float = math.inf,
    positive: bool = False,
) -> float:
    """A finite number within bounds.

    Raises
    ------
    InvalidInput
        If it is none.
    """
    try:
        given = float(value)
    except (TypeError, ValueError):
        given = math.nan
    if math.isfinite(given) and least <= given <= most and (given > 0 or not positive):
        return given
    required = "a positive number" if positive else "a finite number"
    if math.isfinite(most):
        required += f" from {least:g} to {most:g}"
    elif math.isfinite(least):
        required += f", {least:g} or greater"
    raise InvalidInput(name, value, required)


def whole(name: str, value: Any, least: int) -> int:
    """A whole number of at least `least`.

    Raises
    ------
    InvalidInput
        If it is none.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InvalidInput(name, value, f"a whole number, {least} or greater")
    return int(value)


def thread_count(workers: int | None) -> int:
    """As many threads as asked for, or as there are cores.

    Raises
    ------
    InvalidInput
        If it is not a whole number from 1 on.
    """
    return os.cpu_count() or 1 if workers is None else whole("workers", workers, 1)


def streams(seed: Seed, count: int) -> list[np.random.Generator]:
    """Independent generators, the same ones for the same seed; see `seed_sequence`."""
    import numpy as np

    seed = seed_sequence(seed)
    children = (
        np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, child))
        for child in range(count)
    )
    return [np.random.default_rng(child) for child in children]


def seed_sequence(seed: Seed) -> np.random.SeedSequence:
    """What random numbers start from.

    A SeedSequence is not spawned from but read: given twice, it means the same twice. A Generator
    is drawn from, so that successive calls with it differ.

    Raises
    ------
    InvalidInput
        If the seed is not of a kind that NumPy knows.
    """
    import numpy as np

    if isinstance(seed, np.random.SeedSequence):
        return seed
    if isinstance(seed, np.random.Generator):
        return np.random.SeedSequence(seed.integers(2**63, size=2).tolist())
    try:
        return np.random.SeedSequence(seed)
    except (TypeError, ValueError):
        raise InvalidInput(
            "seed", seed, "a whole number >= 0, a SeedSequence or a Generator"
        ) from None
