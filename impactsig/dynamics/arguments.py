"""Arguments shared by several studies of the dynamics."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from .._arguments import reals
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..oscillators.batch import OscillatorBatch
from ..oscillators.flows import Flow
from ..oscillators.swept import Swept
from ..simulation.run import without_noise


def parameter_values(name: str, given: Any) -> np.ndarray:
    """Values of a parameter: one dimension, finite, at least one.

    Raises
    ------
    InvalidInput
        If they are not.
    """
    required = "a sequence of finite numbers, at least one"
    found = reals(name, given, required)
    if found.ndim != 1 or not found.size or not np.all(np.isfinite(found)):
        raise InvalidInput(name, given, required)
    return found


def parameter_names(scene: Callable[..., Any], count: int) -> tuple[str, ...]:
    """Names of a function's first parameters, such as ``gamma`` of ``lambda gamma: ...``."""
    try:
        names = list(inspect.signature(scene).parameters)[:count]
    except (TypeError, ValueError):
        names = []
    return tuple(names) if len(names) == count else ("parameter", "second parameter")[:count]


def made_of_arrays(scene: Callable[..., Any], *values: np.ndarray) -> OscillatorBatch | None:
    """The batch that a scene makes of arrays; None if it takes numbers only.

    A scene of numbers refuses arrays in its own way, so whatever it raises means that.
    """
    try:
        made = scene(*values)
    except Exception:
        return None
    fits = isinstance(made, OscillatorBatch) and made.shape == values[0].shape
    return made if fits else None


def instead_of(system: Any) -> str:
    """What to ask in place of a question that has no answer for a system."""
    if isinstance(system, Swept):
        return "A swept force does not recur: ask of its oscillator, under a steady one"
    if isinstance(system, Flow):
        return "find_periodic_orbit(flow, period=...) finds the orbits of a flow, one by one"
    return ""


def recurring(name: str, oscillator: Any) -> Oscillator:
    """Require an oscillator with a forcing period.

    Raises
    ------
    InvalidInput
        If it is no oscillator, is not forced, or its forcing does not recur.
    """
    if not isinstance(oscillator, Oscillator) or oscillator.angular_forcing_frequency is None:
        required = "an Oscillator with forcing, to count its periods"
        raise InvalidInput(name, oscillator, required, instead_of(oscillator))
    without_noise(oscillator, name)
    if not oscillator.forcing_recurs:
        timed = " and a law that depends on time" if oscillator.law_depends_on_time else ""
        raise InvalidInput(
            name,
            f"angular frequencies "
            f"{', '.join(f'{w:.15g}' for w in oscillator.angular_frequencies)}{timed}",
            "a common period of all forcing, of at most 8 periods of the first frequency",
            "Without one no motion is periodic; give frequencies in a ratio of whole numbers",
        )
    return oscillator
