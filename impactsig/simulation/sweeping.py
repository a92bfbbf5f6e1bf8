"""A swept oscillator -> its motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import numpy as np

from .._arguments import number
from ..errors import InvalidInput
from ..oscillators.swept import Swept
from .motion import Motion
from .simulation import CHATTER
from .simulation import move as move_oscillator
from .stepping.runge_kutta import FixedStep, RungeKutta

TOLERANCE = 1e-12  # of a step; the sum over a long run is then about 1e-11 of the motion


@dataclass(frozen=True, eq=False, repr=False)
class SweptMotion(Motion):
    """The simulated motion of an oscillator under a swept force, a `Motion`.

    Attributes
    ----------
    sweep : Swept
        The simulated system; `system` is the oscillator with the swept force as its law.

    See Also
    --------
    Swept, results.Motion

    Examples
    --------
    >>> from impactsig import Swept, scenes, simulate
    >>> motion = simulate(Swept(scenes.karpodinis(20.0), frequency_rate=0.5), duration=2.0)
    >>> x, v = motion.stroboscopic()  # at 20.5 Hz on average
    >>> len(x)
    42
    """

    sweep: Swept = field(default=None)  # type: ignore[assignment]
    _begin: float = field(repr=False, default=0.0)

    def stroboscopic(self, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity once per cycle of the swept force, at a phase of it [rad].

        Returns
        -------
        x, v : ndarray, shape (n,)
            Displacement and velocity at each time in the span at which the force has that phase.

        Raises
        ------
        InvalidInput
            If the phase is not a finite number, or only counts were kept.
        """
        since = math.fmod(number("phase", phase, "a finite angle [rad]") - self._begin, math.tau)
        first, last = ((self.sweep.phase(at) - since) / math.tau for at in (self.start, self.stop))
        turns = np.arange(math.ceil(first - 1e-9), math.floor(last + 1e-9) + 1)
        times = self.sweep.times_of(turns * math.tau + since)
        return self.sample(np.clip(times, self.start, self.stop))


def move(
    swept: Swept,
    *,
    duration: float | None = None,
    transient: float = 0.0,
    initial: Any = (0.0, 0.0),
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    chatter: float = CHATTER,
    keep: Literal["all", "counts"] = "all",
) -> SweptMotion:
    """The motion under a swept force; `phase` is that of the force at t = 0 [rad]."""
    if duration is None:
        raise InvalidInput("duration", None, "how long to look [s]: a sweep has no period")
    duration = number("duration", duration, above=0)
    transient = number("transient", transient, least=0.0)
    if (last := swept.frequency(duration + transient)) <= 0:
        raise InvalidInput(
            "duration", duration, f"an end at a frequency above 0, where this ends at {last:g} Hz"
        )
    phase = number("phase", phase, "a finite angle [rad]")
    motion = move_oscillator(
        swept.as_law(phase), duration=duration, transient=transient, initial=initial,
        method=RungeKutta(TOLERANCE) if method is None else method, chatter=chatter, keep=keep,
    )  # fmt: skip
    x, v, _ = motion.final
    known = {own.name: getattr(motion, own.name) for own in fields(Motion)}
    final = x, v, math.fmod(swept.phase(motion.stop) + phase, math.tau)
    return SweptMotion(**{**known, "final": final}, sweep=swept, _begin=phase)
