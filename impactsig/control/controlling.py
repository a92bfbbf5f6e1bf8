"""`Controlled`: a system with feedback, and its simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from .._arguments import number, refuse, unless
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..oscillators.flows import Flow
from ..simulation import RungeKutta
from ..simulation.basis.events import TURN
from ..simulation.run import count_of_periods
from ..simulation.simulation import CHATTER
from .controlled import ControlledMotion, under_control
from .intervals import IntervalFeedback
from .ogy import OGY, check_parameter
from .running.delayed import run_delayed
from .running.flow import ControlledFlowMotion, control_flow, number_of
from .running.nudged import run_nudged
from .running.spiked import run_spiked
from .running.spiked_flow import control_flow_by_intervals
from .schedule import KINDS, Controller, Phase, schedule
from .stability.crossing_map import check_flow


@dataclass(frozen=True)
class Controlled:
    """A system with feedback control, which is a system again.

    Under delayed feedback an oscillator is a delay differential equation with impacts, solved by
    the method of steps. Steps end at impacts, where the force reaches or leaves its limit, and at
    integer multiples of the delay after each of these events. In between, the delayed signal is a
    polynomial. A piecewise linear oscillator is integrated by Taylor series of 21 terms, exact to
    rounding. Oscillators with Hertz stops or a `law`, flows, and oscillators with a given `method`,
    are integrated by the method of Dormand and Prince of order 8, with the delayed signal from its
    interpolant. Under `OGY` the motion is simulated period by period, under `IntervalFeedback`
    impact by impact (exactly for a piecewise linear oscillator) or, for a flow, crossing by
    crossing.

    Parameters
    ----------
    system : Oscillator or Flow
        The system. An oscillator must be forced, as delays and sections are counted in its forcing
        periods. A flow is controlled by feedback, not by OGY.
    controller : DelayedFeedback, IntervalFeedback or OGY, or a sequence of pairs
        The controller, active from `start` on; or pairs of a start and a controller or None, each
        active until the next start, for example ``[(100, one), (300, other), (500, None)]`` to
        switch from one orbit to another and then to turn control off.
    start : float, optional
        Start of the control, in forcing periods or in the unit of time of the flow; by default one
        delay after t = 0, when the delayed signal is first available.

    Raises
    ------
    InvalidInput
        If the controller does not apply to the system, the orbit of an `OGY` is not an orbit of the
        system, or starts overlap.

    See Also
    --------
    DelayedFeedback, OGY, results.ControlledMotion, results.ControlledFlowMotion

    Notes
    -----
    `simulate` returns a `ControlledMotion` or a `ControlledFlowMotion`: the motion and the control
    force, from t = 0 on. Under delayed feedback this takes 5 to 10 kB per forcing period. The
    status is "diverged" if the motion becomes unbounded because the gain is too large. Under OGY
    the phase at t = 0 is that of the section of the orbit.

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, scenes, simulate
    >>> beam = scenes.karpodinis(20.3355)
    >>> feedback = DelayedFeedback(0.15, 1, limit=0.1)
    >>> locked = simulate(Controlled(beam, feedback, start=50), periods=100)
    >>> locked.status
    'complete'
    """

    system: Oscillator | Flow
    controller: Controller | Sequence[Phase]
    start: float | None = None

    moved_by: ClassVar[str] = "impactsig.control.controlling"

    def __post_init__(self) -> None:
        system = self.system
        if not isinstance(system, (Oscillator, Flow)):
            raise InvalidInput(
                "system", system, "an Oscillator or a Flow",
                "A cantilever is controlled in its first mode: scenes.cantilever(...)",
            )  # fmt: skip
        if isinstance(system, Oscillator) and system.angular_forcing_frequency is None:
            raise InvalidInput(
                "system", system, "an oscillator with forcing", "Control is counted in its periods"
            )
        if isinstance(system, Oscillator) and system.noise is not None:
            raise InvalidInput(
                "system", repr(system.noise), "an oscillator without noise",
                "Its paths are moved in steps that keep nothing to feed back; "
                "replace(oscillator, noise=None) can be controlled",
            )  # fmt: skip
        phases = schedule(self.controller, self.start, math.inf)
        nudging = [own for _, own in phases if isinstance(own, OGY)]
        spiking = [own for _, own in phases if isinstance(own, IntervalFeedback)]
        if nudging and isinstance(system, Flow):
            raise InvalidInput(
                "controller", self.controller, "a DelayedFeedback or IntervalFeedback for a flow",
                "IntervalFeedback.fastest does for its crossings of a level what OGY does for an "
                "oscillator",
            )  # fmt: skip
        for own in nudging:
            assert isinstance(system, Oscillator)
            own.check(system)
        for feedback in spiking:
            if isinstance(system, Flow):
                check_flow(system, feedback.parameter, feedback.level)
                number_of(system, feedback.signal)
            else:
                check_parameter(system, feedback.parameter)
                if feedback.level is not None:
                    raise InvalidInput(
                        "level",
                        feedback.level,
                        "None for an oscillator: its spikes are impacts",
                    )
        if isinstance(system, Flow) and len({(own.signal, own.level) for own in spiking}) > 1:
            raise InvalidInput(
                "controller", self.controller, "phases of the same signal and level",
                "The spikes are those of one crossing",
            )  # fmt: skip
        if not isinstance(self.controller, KINDS):
            object.__setattr__(self, "controller", phases)

    @property
    def time_unit(self) -> float:
        """Length of the system's unit of time [s]."""
        return self.system.time_unit

    @property
    def in_seconds(self) -> bool:
        """Whether the length of the unit of time is known."""
        return self.system.in_seconds

    @property
    def forcing_period(self) -> float | None:
        """Period of the forcing [s], or None."""
        return self.system.forcing_period

    @property
    def angular_forcing_frequency(self) -> Any:
        """Angular frequency of the forcing period [rad per unit of time]; None without forcing."""
        return getattr(self.system, "angular_forcing_frequency", None)

    @property
    def dimension(self) -> int | None:
        """Number of coordinates under OGY; None where the state includes the delayed signal."""
        phases = schedule(self.controller, self.start, math.inf)
        return 2 if all(isinstance(own, (OGY, type(None))) for _, own in phases) else None

    def differentiated_by(self) -> Any:
        """Name of the module with its tangent map, exponents and orbits."""
        from .stability import derivatives as _derivatives

        return _derivatives

    @property
    def moving_on_orbits(self) -> Any:
        """The system that moves on periodic orbits: without control where feedback is 0 there."""
        if self.dimension is not None:
            return self
        if isinstance(self.controller, IntervalFeedback) and self.controller.offset:
            return self.controller.nudged(self.system, self.controller.offset)
        return self.system


def move(
    controlled: Controlled,
    *,
    periods: float | None = None,
    duration: float | None = None,
    initial: Sequence[float] | None = None,
    phase: float | None = None,
    method: RungeKutta | None = None,
    chatter: float = CHATTER,
) -> ControlledMotion | ControlledFlowMotion:
    """Simulate a controlled oscillator or flow."""
    system, controller, start = controlled.system, controlled.controller, controlled.start
    if isinstance(system, Flow):
        refuse(
            "for a flow", "Give duration= alone", periods=periods, phase=phase, method=method,
            chatter=unless(CHATTER, chatter),
        )  # fmt: skip
        return _flow(system, controller, duration, start, initial)
    length = count_of_periods(system, periods, duration)
    chatter = number("chatter", chatter, above=0, most=1e-2)
    phases = schedule(controller, start, length)
    if not isinstance(method, (RungeKutta, type(None))):
        raise InvalidInput("method", method, "RungeKutta(...) or None")
    begin = 0.0 if phase is None else number("phase", phase)
    initial = (0.0, 0.0) if initial is None else initial
    options: dict[str, Any] = {"initial": initial, "method": method, "chatter": chatter}
    nudging = [own for _, own in phases if isinstance(own, OGY)]
    if nudging:
        options["phase"] = section_of(nudging, phase)
        motion, engines = run_nudged(system, phases, length, **options)
        return under_control(motion, phases, engines)
    if any(isinstance(own, IntervalFeedback) for _, own in phases):
        options["phase"] = math.fmod(begin, TURN) % TURN
        motion, engines = run_spiked(system, phases, length, **options)
        return under_control(motion, phases, engines)
    options["phase"] = math.fmod(begin, TURN) % TURN
    motion, line = run_delayed(system, phases, length, **options)
    return under_control(motion, phases, line)


def section_of(nudging: list[OGY], phase: float | None) -> float:
    """The phase of the section that all OGY controllers of a schedule share.

    Raises
    ------
    InvalidInput
        If they differ, or the run is to begin at another.
    """
    section = math.fmod(nudging[0].orbit.phase, TURN) % TURN
    for own in nudging:
        if abs(math.remainder(own.orbit.phase - section, TURN)) > 1e-12:
            raise InvalidInput(
                "controller", f"an orbit at phase {own.orbit.phase:g}",
                f"all orbits at the phase of the first, {section:g}",
            )  # fmt: skip
    if phase is not None and abs(math.remainder(phase - section, TURN)) > 1e-12:
        raise InvalidInput("phase", phase, f"that of the orbit's section, {section:.9g}, or None")
    return section


def _flow(
    flow: Flow, controller: Any, duration: Any, start: Any, initial: Any
) -> ControlledFlowMotion:
    length = number("duration", duration, above=0)
    phases = schedule(controller, start, length)
    if any(isinstance(own, IntervalFeedback) for _, own in phases):
        return control_flow_by_intervals(flow, phases, length, initial)
    return control_flow(flow, phases, length, initial)
