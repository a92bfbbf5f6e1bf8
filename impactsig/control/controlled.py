"""The motion of a controlled oscillator: a `Motion` with the control force."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np

from .._arguments import number, times_within
from .._showing import drawn_by
from ..errors import InvalidInput
from ..simulation.basis.events import TURN
from ..simulation.motion import Motion


class Effort(Protocol):
    """Protocol of the control force, in the oscillator's units; instants are turns and phases."""

    def force(self, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Control force."""

    def squared(self, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Integrals of the squared force between successive instants, over the phase [rad]."""


@dataclass(frozen=True, eq=False, repr=False)
class ControlledMotion(Motion):
    """The simulated motion of a controlled oscillator; a `Motion` with the control force.

    Attributes
    ----------
    schedule : tuple of (float, controller or None)
        Start [forcing periods] and controller, for each change of control.

    See Also
    --------
    results.Motion, Controlled, plot.control_force

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, scenes, simulate
    >>> feedback = DelayedFeedback(0.15, 1, limit=0.1)
    >>> motion = simulate(Controlled(scenes.karpodinis(20.3355), feedback, start=50), periods=100)
    >>> time, rms = motion.effort()
    >>> bool(rms[-1] < rms.max() / 100)
    True
    """

    schedule: tuple[tuple[float, Any], ...] = ()
    _control: Effort = field(repr=False, default=None)  # type: ignore[assignment]

    def force(self, time: Any) -> np.ndarray:
        """Control force at any times of the span, shape of `time`, in the oscillator's units.

        Parameters
        ----------
        time : array_like
            Times [s].

        Raises
        ------
        InvalidInput
            If a time is outside the span.
        """
        time = times_within(time, self.start, self.stop, " s")
        turns, phase = self._instants(time.ravel())
        return self._control.force(turns, phase).reshape(time.shape)

    def effort(self, periods: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Root mean square of the control force in windows of `periods` forcing periods.

        Returns
        -------
        time, rms : ndarray, shape (n,)
            End of each window [s], and the force in it, in the oscillator's units.

        Raises
        ------
        InvalidInput
            If the windows are not positive, or longer than the motion.
        """
        periods = number("periods", periods, above=0)
        period = self.system.forcing_period
        assert period is not None
        count = math.floor(self.duration / (periods * period) * (1 + 1e-12))
        if count < 1:
            raise InvalidInput(
                "periods", periods, f"no more than the motion has, {self.duration / period:.6g}"
            )
        edges = self.start + np.arange(count + 1) * periods * period
        squared = self._control.squared(*self._instants(np.minimum(edges, self.stop)))
        return edges[1:], np.sqrt(squared / (periods * TURN))

    plot = drawn_by("control_strobe", "its stroboscopic points over time")

    def __repr__(self) -> str:
        return "Controlled" + super().__repr__()


def under_control(motion: Motion, schedule: Any, effort: Effort) -> ControlledMotion:
    """Add schedule and control force to a motion."""
    known = {own.name: getattr(motion, own.name) for own in fields(Motion)}
    return ControlledMotion(**known, schedule=schedule, _control=effort)
