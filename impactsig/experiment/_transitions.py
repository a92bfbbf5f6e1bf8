"""Changes of the motion along a branch, and hysteresis between branches."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ._delays import delay_of
from ._motions import motion_of
from .points import Point

REACH = 5
"""Points to either side that say where a change is."""
LEAST_DOUBT = 1e-3
"""Probability that a motion was taken for another, at the least."""


class Jump(NamedTuple):
    """A change of the motion along a branch.

    Attributes
    ----------
    branch : str
    value : float
        Where it is most probably, midway between two values of the parameter.
    error : float
        Its standard error: half of the spacing over sqrt(3), and what the doubt about the motions
        on either side adds.
    before, after : str
        The motions, in the direction in which the parameter goes.
    low, high : float
        The last value with the motion before, and the first with the one after.
    delay : float
        Of a sweep, by how much the change comes late: it is seen at ``value + delay``. The error
        holds that of the delay.
    """

    branch: str
    value: float
    error: float
    before: str
    after: str
    low: float
    high: float
    delay: float = 0.0

    def describe(self, unit: str = "") -> str:
        """Describe the change in words."""
        where = f"{self.value:.6g} ± {self.error:.2g} {unit}".rstrip()
        branch = f"{self.branch}: " if self.branch else ""
        late = f", {abs(self.delay):.2g} {unit}".rstrip() + " before it is seen"
        late = late if self.delay else ""
        return f"{branch}{self.before} to {self.after} at {where}{late}"


class Hysteresis(NamedTuple):
    """A change that occurs at another value of the parameter on the way back.

    Attributes
    ----------
    below, above : str
        The motions at lower and at higher values of the parameter.
    up, down : Jump
        The change on either branch.
    width, error : float
        Value upwards less value downwards, and its standard error.
    """

    below: str
    above: str
    up: Jump
    down: Jump
    width: float
    error: float


def jumps_of(points: Sequence[Point]) -> tuple[Jump, ...]:
    """The changes along each branch, in the order in which they occur."""
    jumps: list[Jump] = []
    for branch in dict.fromkeys(point.branch for point in points):
        along = [point for point in points if point.branch == branch and math.isfinite(point.value)]
        along = [point for point in along if point.motion != "unknown"]
        along.sort(key=lambda point: point.value, reverse=branch == "down")
        for k, (point, following) in enumerate(pairwise(along)):
            if point.motion != following.motion:
                jumps.append(_jump(along, k))
    return tuple(jumps)


def jumps_in_sweeps(sweeps: Sequence[tuple[Mapping[str, Any], str]]) -> list[Jump]:
    """The changes along sweeps, corrected for the delay of each sweep.

    The transients of a motion that is lost say when: what grows before, and what decays where
    another sweep, the other way, takes it up. Where nothing grows before, but the motion that comes
    is already there in outline, the change is a birth at which that motion's transients tell.
    """
    everywhere = [change for row, _ in sweeps for change in row["changes"]]
    jumps = []
    for row, branch in sweeps:
        changes = sorted(row["changes"], key=lambda one: one["value"], reverse=branch == "down")
        for one in changes:
            delay = delay_of(one["value"], one["rate"], _transients_of(one, everywhere))
            jumps.append(
                Jump(
                    branch, one["value"] - delay.value, math.hypot(one["error"], delay.error),
                    motion_of(one["before"])[0], motion_of(one["after"])[0], one["low"],
                    one["high"], delay.value,
                )
            )  # fmt: skip
    return jumps


def _transients_of(
    change: Mapping[str, Any], everywhere: Sequence[Mapping[str, Any]]
) -> list[tuple[float, Any]]:
    """Transients of the motion at a change, with the rates of their sweeps."""
    if change["through"]:
        own, other, side, opposite = "decay", "growth", "after", "before"
    else:
        own, other, side, opposite = "growth", "decay", "before", "after"
    motion = motion_of(change[side])[0]
    back = [
        one
        for one in everywhere
        if one["rate"] * change["rate"] < 0 and one[other] and motion_of(one[opposite])[0] == motion
    ]
    nearest = sorted(back, key=lambda one: abs(one["value"] - change["value"]))[:1]
    if not change[own]:
        return []
    return [(change["rate"], change[own]), *((one["rate"], one[other]) for one in nearest)]


def _jump(points: Sequence[Point], k: int) -> Jump:
    """The change after point k, located by the points around it."""
    before, after = points[k], points[k + 1]
    first = k
    while first > max(0, k - REACH) and points[first - 1].motion == before.motion:
        first -= 1
    last = k + 1
    while last < min(len(points) - 1, k + 1 + REACH) and points[last + 1].motion == after.motion:
        last += 1
    near = points[first : last + 1]
    # The log-probability of the motions if the change is after the j-th of them.
    old = np.array([_log(point, before.motion) for point in near])
    new = np.array([_log(point, after.motion) for point in near])
    fits = np.cumsum(old)[:-1] + (new.sum() - np.cumsum(new))[:-1]
    weight = np.exp(fits - fits.max())
    weight /= weight.sum()
    values = np.array([point.value for point in near])
    middle, width = 0.5 * (values[1:] + values[:-1]), np.diff(values)
    mean = float(weight @ middle)
    spread = float(weight @ ((middle - mean) ** 2 + width**2 / 12))
    return Jump(
        before.branch,
        0.5 * (before.value + after.value),
        math.sqrt(spread),
        before.motion,
        after.motion,
        before.value,
        after.value,
    )


def _log(point: Point, motion: str) -> float:
    sure = min(max(point.confidence, LEAST_DOUBT), 1 - LEAST_DOUBT)
    return math.log(sure if point.motion == motion else 1 - sure)


def hysteresis_of(jumps: Sequence[Jump]) -> tuple[Hysteresis, ...]:
    """Pair changes of the upward branch with the reverse changes of the downward branch.

    Each is taken with the nearest on the other branch that is not taken yet.
    """
    up = [jump for jump in jumps if jump.branch == "up"]
    down = [jump for jump in jumps if jump.branch == "down"]
    pairs = sorted(
        (abs(a.value - b.value), i, j)
        for i, a in enumerate(up)
        for j, b in enumerate(down)
        if (a.before, a.after) == (b.after, b.before)
    )
    found: list[Hysteresis] = []
    taken: tuple[set[int], set[int]] = (set(), set())
    for _, i, j in pairs:
        if i not in taken[0] and j not in taken[1]:
            taken[0].add(i)
            taken[1].add(j)
            a, b = up[i], down[j]
            error = math.hypot(a.error, b.error)
            found.append(Hysteresis(a.before, a.after, a, b, a.value - b.value, error))
    return tuple(sorted(found, key=lambda jump: jump.up.value))
