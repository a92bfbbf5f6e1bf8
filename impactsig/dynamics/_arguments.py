"""Arguments that several studies of the dynamics share."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import InvalidInput


def parameter_values(name: str, given: Any) -> np.ndarray:
    """Values of a parameter: one dimension, finite, at least one.

    Raises
    ------
    InvalidInput
        If they are not.
    """
    try:
        found = np.asarray(given, float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if found.ndim != 1 or not found.size or not np.all(np.isfinite(found)):
        raise InvalidInput(name, given, "a sequence of finite numbers, at least one")
    return found


def parameter_names(scene: Callable[..., Any], count: int) -> tuple[str, ...]:
    """What a function calls its first parameters, such as ``gamma`` of ``lambda gamma: ...``."""
    try:
        names = list(inspect.signature(scene).parameters)[:count]
    except (TypeError, ValueError):
        names = []
    return tuple(names) if len(names) == count else ("parameter", "second parameter")[:count]
