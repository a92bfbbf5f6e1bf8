"""Pseudo-arclength continuation of a fixed point of the stroboscopic map, or of a flow's orbit."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..._running.watched import progress
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...oscillators.flows import Flow
from ._clearance import clearance, gaps, seconds_of
from ._flow_map import FlowMap, size_of
from .branches import Branch, Kind, SpecialPoint
from .flow_orbits import FlowOrbit
from .orbits import PeriodicOrbit, orbit_of, shooting_of
from .shooting import off_each

FIRST, LONGEST, SHORTEST = 0.01, 0.04, 1e-9  # steps along the branch, in units of its extent
CORRECTIONS = 8
FLAT = 1e-6  # change of the parameter, in units of the range, to differentiate by
MOVED = 1e-3  # step of the correction after which that derivative is taken again
FAINT = 1e-3  # least approach velocity, of the greatest it has been, at which a grazing is near
CLOSING = 40  # last points whose clearance is looked at
CLOSE = 0.2  # way from the section to the nearest impact, of that from the middle between two


@dataclass(frozen=True)
class _Point:
    """An orbit on the branch: its scaled state and parameter, and the orbit itself."""

    place: np.ndarray
    tangent: np.ndarray
    orbit: Any
    parameter: float
    iterations: int = 0

    @property
    def doubles(self) -> float:
        """det(M + 1), whose sign changes where a multiplier passes -1."""
        return float((1 + self.orbit.multipliers).prod().real)


class Continuation:
    """The state of a continuation."""

    def __init__(
        self,
        scene: Callable[[float], Any],
        first: float,
        last: float,
        start: PeriodicOrbit | FlowOrbit,
        options: dict[str, Any],
    ) -> None:
        self.scene, self.first, self.last, self.start = scene, first, last, start
        self.options = options
        self.flow = isinstance(start, FlowOrbit)
        if isinstance(start, FlowOrbit):
            self.begin = start.state if start.forced else np.append(start.state, start.period)
            self.size = size_of(start)
            shooting, size, self.anchored = self.map(first, self.begin), 1.0, True
        else:
            self.begin = start.state
            shooting = self.map(first, self.begin)
            self.anchored = shooting.anchored
            times = np.linspace(0, 0.99, 64) * start.periods * seconds_of(start)
            states = shooting.states(start.motion(), times)
            size = max(*(np.ptp(states, axis=0) / shooting.scales), 1e-12)
        self.unit = np.append(size * shooting.scales, abs(last - first))
        self.together = shooting.side_by_side

    def map(self, parameter: float, anchor: np.ndarray) -> Any:
        """The return map at a parameter value; of a flow, near a state."""
        system = self.scene(parameter)
        if isinstance(self.start, FlowOrbit):
            if not isinstance(system, Flow) or system.dimension != self.start.system.dimension:
                raise InvalidInput("scene_of_parameter", system, "a function that makes one flow")
            return FlowMap(system, self.start, self.size, anchor)
        return shooting_of(system, self.start.periods, **self.options)

    def orbit(
        self, shooting: Any, state: np.ndarray, residual: float, steps: int, here: Any
    ) -> PeriodicOrbit | FlowOrbit:
        """The orbit through a fixed point of the map."""
        if self.flow:
            return shooting.orbit(state, residual, steps, here)
        return orbit_of(shooting, state, residual, steps, "found", here)

    def point(self, place: np.ndarray, along: np.ndarray, ahead: np.ndarray) -> _Point | None:
        """Corrector: the orbit on the plane through a place normal to `along`; None if none."""
        guess, kept = place, None  # the derivative by the parameter, while steps are small
        for iterations in range(CORRECTIONS):
            parameter = float(place[-1] * self.unit[-1])
            anchor = guess[:-1] * self.unit[:-1]
            state, unit = place[:-1] * self.unit[:-1], self.unit[:-1]
            beside = [parameter + h * self.unit[-1] for h in (FLAT, -FLAT)]
            (shooting, (residual, gap, here)), *sides = self._off(
                state, anchor, parameter, *(beside if self.together or kept is None else ())
            )
            if here is None:
                return None
            gap = gap / unit
            by_state = shooting.slopes(here, unit)
            column = self._by_parameter(gap, here.impacts, sides) if kept is None else kept
            slopes = np.vstack([np.column_stack([by_state, column]), along])
            if not np.isfinite(slopes).all():
                return None
            try:
                step = -np.linalg.solve(slopes, [*gap, along @ (place - guess)])
                if residual <= self.options["tolerance"] and np.abs(step).max() < 1e-7:
                    if kept is not None:
                        sides = sides or self._off(state, anchor, *beside)
                        slopes[:-1, -1] = self._by_parameter(gap, here.impacts, sides)
                    tangent = np.linalg.solve(slopes, np.eye(len(place))[-1])
                    tangent /= np.linalg.norm(tangent)
                    tangent *= 1 if tangent @ ahead > 0 else -1
                    orbit = self.orbit(shooting, state, residual, iterations, here)
                    if not self.flow and orbit.impacts != self.start.impacts:  # type: ignore[union-attr]
                        return None
                    return _Point(place, tangent, orbit, parameter, iterations)
            except np.linalg.LinAlgError:
                return None
            place = place + step
            kept = None if np.abs(step).max() > MOVED else slopes[:-1, -1]
            if np.abs(place - guess).max() > 2 * LONGEST:
                return None
        return None

    def _off(self, state: np.ndarray, anchor: np.ndarray, *parameters: float) -> list[Any]:
        """Maps at some parameters, and what each returns to a state: see `Shooting.off`."""
        maps = [self.map(parameter, anchor) for parameter in parameters]
        return list(zip(maps, off_each(maps, [state] * len(maps)), strict=True))

    def _by_parameter(self, gap: np.ndarray, impacts: int, sides: list[Any]) -> np.ndarray:
        """Derivative of the map by the parameter, one-sided near grazing impacts.

        `gap` is how far the return is off at the parameter itself, scaled; `sides` is what `_off`
        gives above and below it.
        """
        smooth = [
            (h, off / self.unit[:-1])
            for h, (_, (_, off, here)) in zip((FLAT, -FLAT), sides, strict=True)
            if here is not None and here.impacts == impacts
        ]
        if not smooth:
            return np.full(len(gap), math.nan)
        (h, up), (low, down) = smooth[0], smooth[1] if len(smooth) == 2 else (0.0, gap)
        return (up - down) / (h - low)

    def follow(self, most: int) -> Branch:
        """Step along the branch to its end."""
        place = np.array([*self.begin, self.first]) / self.unit
        axis = self._axis(self.last - self.first)
        here = self.point(place, axis, axis)
        if here is None:
            raise InvalidInput("guess", self.start.state, "an orbit that can be followed")
        points, special, status = [here], list[SpecialPoint](), "most points"
        ds = FIRST
        low, high = sorted((self.first, self.last))
        with progress(None, " points", leave=False) as advance:
            while len(points) < most:
                here = points[-1]
                following = self.point(_ahead(points, ds), here.tangent, here.tangent)
                bent = following is not None and following.tangent @ here.tangent < 0.95
                if following is None or (bent and ds > 1e-4):
                    ds /= 2
                    if ds < SHORTEST:
                        status = self._end(points, special)
                        break
                    continue
                if not low <= following.parameter <= high:
                    status = "end of range"
                    edge = low if following.parameter < low else high
                    final = self._at_edge(here, following, edge)
                    if final is not None:
                        special += self._between(here, final, len(points) - 1)
                        points.append(final)
                        advance(1)
                    break
                special += self._between(here, following, len(points) - 1)
                points.append(following)
                advance(1)
                if self._grazes(points):
                    status = self._end(points, special)
                    break
                if self._near_impact(following.orbit):
                    points[-1] = self._elsewhere(following)
                if following.iterations <= 3:
                    ds = min(1.5 * ds, LONGEST)
                elif following.iterations > 5:
                    ds /= 2
        return self._branch(points, special, status)

    def _between(self, before: _Point, after: _Point, index: int) -> list[SpecialPoint]:
        """The bifurcation between two neighbouring points, if any, and its location."""
        tests: list[tuple[Kind, Callable[[_Point], float]]] = [
            ("fold", lambda point: float(point.tangent[-1])),
            ("period doubling", lambda point: point.doubles),
        ]
        found = []
        for kind, test in tests:
            if test(before) * test(after) < 0:
                point = self._root(before, after, test)
                found.append(
                    SpecialPoint(kind, point.parameter, point.orbit.state, _phase(point), index)
                )
        return sorted(found, key=lambda point: abs(point.parameter - before.parameter))

    def _root(self, before: _Point, after: _Point, test: Callable[[_Point], float]) -> _Point:
        """The point between two neighbours at which a test function vanishes."""
        low, high = before, after
        at_low, at_high = test(low), test(high)
        along = before.tangent
        length = along @ (after.place - before.place)
        a, b = 0.0, 1.0
        best = low if abs(at_low) < abs(at_high) else high
        for n in range(60):
            share = a - at_low * (b - a) / (at_high - at_low) if n % 3 < 2 else (a + b) / 2
            place = before.place + share * length * along
            if a < b:
                weight = (share - a) / (b - a)
                place = low.place + weight * (high.place - low.place)
                place = place + (share * length - along @ (place - before.place)) * along
            point = self.point(place, along, along)
            if point is None:
                break
            value = test(point)
            best = point if abs(value) < abs(test(best)) else best
            if value == 0.0 or b - a < 1e-13:
                break
            if value * at_low < 0:
                high, at_high, b = point, value, share
            else:
                low, at_low, a = point, value, share
        return best

    def _at_edge(self, before: _Point, after: _Point, edge: float) -> _Point | None:
        """The orbit at the end of the range."""
        share = (edge - before.parameter) / (after.parameter - before.parameter)
        place = before.place + share * (after.place - before.place)
        place[-1] = edge / self.unit[-1]
        point = self.point(place, self._axis(after.parameter - before.parameter), before.tangent)
        return None if point is None else replace(point, parameter=edge)

    def _axis(self, way: float) -> np.ndarray:
        """Unit direction of the parameter, up or down."""
        return np.append(np.zeros(len(self.begin)), math.copysign(1.0, way))

    def _near_impact(self, orbit: Any) -> bool:
        """Whether an impact is about to pass the section, which can then be moved.

        It cannot where a law depends on time, which counts from the section, or under OGY, which
        has its own.
        """
        machine = getattr(orbit.system, "system", orbit.system)
        if self.anchored or (isinstance(machine, Oscillator) and machine.law_depends_on_time):
            return False
        away, widest, _ = gaps(orbit)
        return away < CLOSE * widest / 2

    def _elsewhere(self, point: _Point) -> _Point:
        """The same orbit on a section midway between two impacts."""
        orbit = point.orbit
        _, _, phase = gaps(orbit)
        ahead = (phase - orbit.phase) % (2 * math.pi)
        seconds = ahead / (2 * math.pi) * seconds_of(orbit)
        state = self.map(point.parameter, orbit.state).states(orbit.motion(), seconds)
        before = self.options
        self.options = {**before, "phase": phase}
        place = np.append(state, point.parameter) / self.unit
        axis = self._axis(point.tangent[-1])
        moved = self.point(place, axis, axis)
        if moved is None:
            self.options = before
            return point
        return moved

    def _grazes(self, points: list[_Point]) -> bool:
        """Whether an impact has nearly lost its velocity."""
        if isinstance(self.start, FlowOrbit) or not self.start.impacts or len(points) < 3:
            return False
        least = [point.orbit.approach_velocity.min() for point in points]
        return bool(least[-1] < FAINT * max(least))

    def _end(self, points: list[_Point], special: list[SpecialPoint]) -> str:
        """Whether a branch that cannot be continued ends in a grazing, and where."""
        last = points[-1]
        values = None
        if self.flow:
            return "lost"
        if self._grazes(points):
            values = [point.orbit.approach_velocity.min() for point in points]
        elif clearance(last.orbit) < 1e-3 * self.unit[0]:
            values = [clearance(point.orbit) for point in points[-CLOSING:]]
        if values is None:
            return "lost"
        place = _to_zero(points[-len(values) :], values)
        special.append(
            SpecialPoint("grazing", place, last.orbit.state, last.orbit.phase, len(points) - 1)
        )
        return "grazing"

    def _branch(self, points: list[_Point], special: list[SpecialPoint], status: str) -> Branch:
        orbits, start = [point.orbit for point in points], self.start
        if isinstance(start, FlowOrbit):
            count, impacts = 1, 0
            period = [orbit.period for orbit in orbits]
        else:
            count, impacts = start.periods, start.impacts
            period = [orbit.periods * seconds_of(orbit) for orbit in orbits]
        none = np.empty(0)
        return Branch(
            count,
            impacts,
            np.array([point.parameter for point in points]),
            np.array([orbit.state for orbit in orbits]),
            np.array([_phase(point) for point in points]),
            np.array(period),
            np.array([orbit.multipliers.astype(complex) for orbit in orbits]),
            np.array([getattr(orbit, "approach_velocity", none) for orbit in orbits]),
            tuple(special),
            status,
            None if not isinstance(start, FlowOrbit) else start.forced,
        )


def _phase(point: _Point) -> float:
    """Phase of the section; 0 of a flow."""
    return float(getattr(point.orbit, "phase", 0.0))


def _ahead(points: list[_Point], ds: float) -> np.ndarray:
    """Predictor: a point a step ds ahead, through up to four points of one section.

    The region from which Newton's method converges shrinks with the square of the least approach
    velocity, so that a guess along the tangent alone would need ever shorter steps.
    """
    last = points[-1]
    known = [point.place for point in points[-4:] if _phase(point) == _phase(last)]
    away = np.array([np.linalg.norm(place - last.place) for place in known])
    # Distances must grow from point to point, or it is no curve that they lie on.
    if len(known) < 3 or np.any(np.diff(away) >= 0) or away[0] > 20 * ds + 1e-3:
        return last.place + ds * last.tangent
    weights = _lagrange(-away, ds)
    return np.asarray(sum(weight * place for weight, place in zip(weights, known, strict=True)))


def _to_zero(points: list[_Point], values: list[float]) -> float:
    """Parameter at which a value vanishes, extrapolated from three points."""
    chosen = [len(points) - 1]
    for k in range(len(points) - 2, -1, -1):
        if len(chosen) < 3 and values[k] >= 2 * values[chosen[-1]]:
            chosen.append(k)
    weights = _lagrange([values[k] for k in chosen], 0.0)
    return float(sum(w * points[k].parameter for w, k in zip(weights, chosen, strict=True)))


def _lagrange(nodes: Sequence[float] | np.ndarray, at: float) -> list[float]:
    """Weights of the values at the nodes in their interpolating polynomial at a place."""
    return [
        math.prod((at - other) / (node - other) for j, other in enumerate(nodes) if j != k)
        for k, node in enumerate(nodes)
    ]
