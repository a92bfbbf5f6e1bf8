"""Trains over thresholds or noise levels, by title, for `plot.return_maps`."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ..._arguments import Seed, choice, instance, reals
from ...errors import InvalidInput
from ...impacts import Impacts
from ...oscillators.flows import Flow
from ..flows.firing import integrate_and_fire, threshold_crossings
from ..motion import Motion
from .measuring import measure

THESIS_NOISE = (0.0, 0.00247, 0.00476, 0.0096)


def noisy_trains(
    motion: Motion, noise: Any = THESIS_NOISE, *, seed: Seed = None
) -> dict[str, Impacts]:
    """Impacts of a motion as counted by a threshold detector, at several noise levels.

    Figures 4.17 to 4.19 of [Karpodinis]_ are `plot.return_maps` of the trains, or
    `plot.interval_densities` over the levels. The levels are defined in `measure`.

    Parameters
    ----------
    motion : Motion
        The motion to measure.
    noise : array_like
        Levels, as in `measure`; by default those of the thesis, 0 to 0.960 %.
    seed : int, SeedSequence or Generator, optional
        Of the noise, the same at every level. The same seed gives the same result; a Generator is
        advanced.

    Returns
    -------
    dict of str to Impacts
        The trains, by the level in per cent.

    Raises
    ------
    InvalidInput
        If an argument is out of its range.

    See Also
    --------
    measure, plot.return_maps

    Examples
    --------
    >>> from impactsig import noisy_trains, scenes, simulate
    >>> motion = simulate(scenes.karpodinis(22.1), periods=100, transient=400)
    >>> trains = noisy_trains(motion, [0.0, 0.01], seed=1)
    >>> len(trains)
    2
    """
    instance("motion", motion, Motion, "a Motion, as simulate makes")
    levels = _series("noise", noise)
    if seed is None or isinstance(seed, np.random.Generator):
        seed = int(np.random.default_rng(seed).integers(2**63))
    return {
        f"{100 * level:.3g} %": measure(motion, noise=level, seed=seed).impacts for level in levels
    }


def fired_trains(
    flow: Flow,
    thresholds: Any,
    *,
    kind: Literal["integral", "crossing"] = "integral",
    **options: Any,
) -> dict[str, Impacts]:
    """Spikes of a flow at several thresholds.

    The threshold study of chapter 3 of [Karpodinis]_: return maps of the trains show the flow's
    attractor, at each threshold, from intervals alone.

    Parameters
    ----------
    flow : Flow
        The flow.
    thresholds : array_like
        Thresholds of the integral of the signal, 20 to 60 in the thesis, or of the signal itself.
    kind : {"integral", "crossing"}
        `integrate_and_fire` or `threshold_crossings`.
    **options
        As of that: signal, count, duration, transient, initial.

    Returns
    -------
    dict of str to Impacts
        The trains, by the threshold.

    Raises
    ------
    InvalidInput
        If an argument is out of its range.

    See Also
    --------
    integrate_and_fire, threshold_crossings, plot.return_maps

    Examples
    --------
    >>> from impactsig import fired_trains, flows
    >>> trains = fired_trains(flows.rossler(), [20, 40], count=50)
    >>> [len(train) for train in trains.values()]
    [50, 50]
    """
    choice("kind", kind, ("integral", "crossing"))
    fire = integrate_and_fire if kind == "integral" else threshold_crossings
    levels = _series("thresholds", thresholds)
    if kind == "integral" and min(levels) <= 0:
        raise InvalidInput("thresholds", thresholds, "positive numbers for an integral")
    return {f"threshold {level:g}": fire(flow, level, **options) for level in levels}


def _series(name: str, given: Any) -> list[float]:
    required = "a sequence of different finite numbers, at least one"
    values = reals(name, given, required)
    if values.ndim != 1 or not values.size or not np.isfinite(values).all():
        raise InvalidInput(name, given, required)
    if len(np.unique(values)) != len(values):
        raise InvalidInput(name, given, required)
    return [float(value) for value in values]
