"""Tangent maps, exponents and orbits of controlled oscillators."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..._arguments import number
from ...dynamics.periodic.orbits import orbit_of
from ...dynamics.periodic.shooting import OscillatorShooting
from ...dynamics.tangents.growth import steps_of
from ...dynamics.tangents.lyapunov import GONE, LyapunovSpectrum, spectrum_from
from ...dynamics.tangents.tangent import TangentMap, map_from, multiplied
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation import simulate
from ...simulation.run import count_of_periods
from ..controlling import Controlled, section_of
from ..feedback import DelayedFeedback
from ..intervals import IntervalFeedback
from ..ogy import OGY
from ..schedule import schedule
from ._laps import laps
from .stability import MULTIPLIERS, orbit_stability

DELAYED = (
    "Under delayed feedback the state is all that was within a delay: orbit_stability() has "
    "multipliers of its orbits"
)
INTERVALS = (
    "Under interval feedback the state has the last intervals too, and a start has none: "
    "orbit_stability() has multipliers of its orbits"
)


def tangent_of(
    controlled: Controlled, *, periods: Any = None, duration: Any = None, initial: Any = None,
    phase: Any = None, method: Any = None, **options: Any,
) -> TangentMap:  # fmt: skip
    """Tangent map of an oscillator under OGY control."""
    oscillator = _nudged(controlled)
    length = count_of_periods(oscillator, periods, duration)
    phases = schedule(controlled.controller, controlled.start, math.inf)
    options |= {"phase": _section(controlled, phase), "method": method}
    scaled, scale, impacts, collapses, grazings = np.eye(2), 0.0, 0, 0, 0
    for lap in laps(oscillator, phases, length, initial, **options):
        scaled, scale = multiplied(lap.matrix, scaled, scale)
        impacts, collapses = impacts + lap.here.impacts, collapses + lap.here.collapses
        grazings += lap.here.grazings + lap.grazed
    here = lap.here
    return map_from(scaled, scale, math.nan, here.final, impacts, collapses, grazings, here.status)


def spectrum_of(
    controlled: Controlled, periods: Any, duration: Any, transient: Any, *, initial: Any,
    phase: Any, method: Any, chatter: Any,
) -> LyapunovSpectrum:  # fmt: skip
    """Lyapunov exponents of the section map under OGY control."""
    oscillator = _nudged(controlled)
    length = math.ceil(count_of_periods(oscillator, periods, duration) - 1e-9)
    before = length / 10
    if transient is not None:
        unit = 1.0 if periods is not None else oscillator.forcing_period or 1.0
        before = number("transient", transient, least=0.0) / unit
    before = math.ceil(before - 1e-9)
    phases = schedule(controlled.controller, controlled.start, math.inf)
    options = {"phase": _section(controlled, phase), "method": method, "chatter": chatter}
    columns, status = np.eye(2), "complete"
    growth, divergence, collapsed = [np.zeros(2)], 0.0, []
    impacts = grazings = lost = 0
    for n, lap in enumerate(laps(oscillator, phases, before + length, initial, **options)):
        status = lap.here.status
        if status != "complete":
            break
        columns, triangle = np.linalg.qr(lap.matrix @ columns)
        if n < before:
            continue
        sizes = np.abs(np.diag(triangle))
        gone = (sizes < GONE * sizes.max()) | (sizes == 0.0)
        if gone.any():
            lost = max(lost, int(gone.sum()))
            collapsed.append((n + 1, 2 - int(gone.sum())))
        with np.errstate(divide="ignore"):
            growth.append(np.where(gone, 0.0, np.log(sizes)))
            divergence += float(np.log(abs(lap.determinant)))
        impacts, grazings = impacts + lap.here.impacts, grazings + lap.here.grazings + lap.grazed
    grown = np.cumsum(growth, axis=0)
    edges = steps_of(len(grown) - 1)
    unit = 2 * math.pi / controlled.angular_forcing_frequency
    when = np.array(collapsed, float).reshape(-1, 2)
    return spectrum_from(
        controlled,
        edges * unit,
        grown[edges],
        lost,
        divergence / (edges[-1] * unit) if len(edges) else math.nan,
        collapses=len(when),
        collapse_time=when[:, 0] * unit,
        collapse_dimensions=when[:, 1].astype(int),
        impacts=impacts,
        grazings=grazings,
        status=status,
    )


class NudgedShooting(OscillatorShooting):
    """The section map under OGY control, for Newton's method."""

    anchored = True

    def __init__(
        self, controlled: Controlled, periods: int, phase: float, method: Any, tolerance: float
    ) -> None:
        oscillator = _nudged(controlled)
        super().__init__(oscillator, periods, _section(controlled, phase), method, tolerance)
        self.system = self.moves = controlled

    def strobed(self) -> np.ndarray:
        """States at the section, after the transient."""
        motion = simulate(
            self.moves, periods=self.settle + self.look + self.periods, **self.options
        )
        return np.stack(motion.stroboscopic(self.phase), axis=1)[self.settle :]


class SilentShooting(OscillatorShooting):
    """The stroboscopic map of an oscillator on orbits for which the feedback vanishes."""

    def __init__(
        self, controlled: Controlled, periods: int, phase: float, method: Any, tolerance: float
    ) -> None:
        super().__init__(controlled.moving_on_orbits, periods, phase, method, tolerance)
        self.system = controlled
        self.feedback: Any = controlled.controller
        if isinstance(self.feedback, DelayedFeedback):
            laps = self.feedback.delay / self.periods
            if round(laps) < 1 or abs(laps - round(laps)) > 1e-9 * laps:
                raise InvalidInput(
                    "periods", periods, f"periods that divide the delay of {self.feedback.delay:g}",
                    "On other orbits the feedback does not vanish, and the state is all that was "
                    "within a delay",
                )  # fmt: skip

    def multipliers(self, here: TangentMap, state: np.ndarray) -> np.ndarray:
        """Multipliers of the orbit under the feedback."""
        alone = OscillatorShooting(
            self.moves, self.periods, self.phase, self.options["method"], self.tolerance
        )
        orbit = orbit_of(alone, state, 0.0, 0, "found", here)
        if isinstance(self.feedback, IntervalFeedback):
            return orbit_stability(orbit, self.feedback).multipliers
        found = orbit_stability(orbit, self.feedback, laps=40)
        if not len(found.multipliers):
            raise InvalidInput(
                "system", self.system, "feedback under which deviations follow a linear map",
                'Use signal="displacement" or a soft stop; orbit_stability() gives the growth of '
                "deviations without a linear map",
            )  # fmt: skip
        values = found.multipliers
        if values[-1].imag and not np.isclose(values[-1], values[-2].conjugate()):
            values = values[:-1]  # whose conjugate is not among the greatest
        return np.append(values, np.zeros(MULTIPLIERS - len(values)))


def shooting_of(
    controlled: Controlled, periods: int, phase: float, method: Any, tolerance: float
) -> OscillatorShooting:
    """The map whose fixed points are the orbits under control.

    Raises
    ------
    InvalidInput
        If there is none, as where control is not on for good.
    """
    if not isinstance(controlled.system, Oscillator):
        raise InvalidInput(
            "system", controlled, "a Flow alone, or a Controlled oscillator",
            "Feedback is silent on orbits whose period divides the delay: find one of the flow, "
            "and ask orbit_stability()",
        )  # fmt: skip
    controller = controlled.controller
    lasting = isinstance(controller, (DelayedFeedback, IntervalFeedback, OGY))
    if not lasting or (isinstance(controller, OGY) and controlled.start):
        raise InvalidInput(
            "system", controlled, "one controller, on for good",
            "Periodic orbits need a system that does not change with time",
        )  # fmt: skip
    kind = NudgedShooting if isinstance(controller, OGY) else SilentShooting
    return kind(controlled, periods, phase, method, tolerance)


def _nudged(controlled: Controlled) -> Oscillator:
    """The oscillator, if the controller is OGY.

    Raises
    ------
    InvalidInput
        If it is feedback, whose state is more than displacement and velocity.
    """
    for _, own in schedule(controlled.controller, controlled.start, math.inf):
        if own is not None and not isinstance(own, OGY):
            why = DELAYED if isinstance(own, DelayedFeedback) else INTERVALS
            raise InvalidInput("system", controlled, "a system under OGY, or alone", why)
    return controlled.system  # type: ignore[return-value]


def _section(controlled: Controlled, phase: float | None) -> float:
    """The phase at which the parameter is changed."""
    phases = schedule(controlled.controller, controlled.start, math.inf)
    return section_of([own for _, own in phases if isinstance(own, OGY)], phase)
