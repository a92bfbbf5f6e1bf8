"""Stops of an oscillator as rows of numbers, in the coding of `laws`."""

from __future__ import annotations

from ...oscillators import Hertz, KelvinVoigt, Rigid
from .laws import BY_FUNCTION, HERTZ, NO_NUMBER, PUSHER, RIGID, SPRING


def kind_of(law: Rigid | KelvinVoigt | Hertz) -> int:
    """Code of the contact law of a stop."""
    if isinstance(law, Rigid):
        return RIGID
    if isinstance(law, Hertz):
        return HERTZ
    return SPRING if law.ends == "gap" else PUSHER


def restitution_of(law: Rigid | KelvinVoigt | Hertz) -> float:
    """Restitution coefficient, or the code of a stop without one."""
    r = None if isinstance(law, KelvinVoigt) else law.restitution
    if r is None:
        return NO_NUMBER
    return BY_FUNCTION if callable(r) else r


def columns(
    law: Rigid | KelvinVoigt | Hertz, spring: float, damper: float, speed: float
) -> tuple[float, ...]:
    """LAW to RESTITUTION of a stop, in other units.

    A stiffness is divided by `spring`, a damping of Kelvin and Voigt's by `damper`; the loss of
    Hunt and Crossley is multiplied by `speed`, a unit of velocity over that of the oscillator.
    """
    kind, r = float(kind_of(law)), restitution_of(law)
    if isinstance(law, Rigid):
        return kind, 0.0, 0.0, 1.0, r
    if isinstance(law, KelvinVoigt):
        return kind, law.stiffness / spring, law.damping / damper, 1.0, r
    return kind, law.stiffness / spring, law.damping * speed, law.exponent, r
