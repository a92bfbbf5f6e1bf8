"""The systems of the papers, with their parameters; a value that is our choice is marked so."""

from __future__ import annotations

import math
from typing import Any, Literal

from ..errors import InvalidInput
from .oscillator import Oscillator
from .parts import BaseMotion, Force, KelvinVoigt, Rigid, Stop

NATURAL_FREQUENCY = 22.2
"""First natural frequency of the beam of [Karpodinis]_ [Hz]."""


def karpodinis(
    frequency: float = 22.1,
    *,
    damping_ratio: float = 0.03,
    amplitude: float = 0.25,
    restitution: float = 0.2,
) -> Oscillator:
    """The impacting cantilever beam of [Karpodinis]_, in its first mode.

    ``x'' + 2 damping_ratio x' + x = amplitude cos(omega t)``, x < 1, with x in units of the gap
    and time in units of 1/omega_n. The natural frequency, 22.2 Hz, and the restitution
    coefficient, 0.2, are the thesis'.

    Parameters
    ----------
    frequency : float
        Forcing frequency [Hz]. 22.1 Hz gives one impact a period, 20.1 and 20.3355 Hz chaos.
    damping_ratio, amplitude : float
        Our choice: the thesis' table of them is not in the text that is left.
    restitution : float
        Restitution coefficient.
    """
    if not (math.isfinite(frequency) and frequency > 0):
        raise InvalidInput("frequency", frequency, "a positive number [Hz]")
    return Oscillator(
        damping=2 * damping_ratio,
        forces=(Force(amplitude, frequency / NATURAL_FREQUENCY),),
        stops=(Stop(1.0, Rigid(restitution)),),
        time_unit=1 / (2 * math.pi * NATURAL_FREQUENCY),
        name=f"Karpodinis' beam at {frequency:g} Hz",
    )


def okolewski(
    eta: float,
    restitution: float,
    stop: Literal["hard", "soft"] = "hard",
    *,
    stop_stiffness: float = 2e5,
    **changes: Any,
) -> Oscillator:
    """A mass on a moving base that carries the stop, hard or soft [Okolewski2021]_.

    ``x'' + 0.23 x' + x = a sin(eta t)``, ``x >= a sin(eta t)``, a = 0.0025: the spring hangs on
    the base, the damper on the ground.

    Parameters
    ----------
    eta : float
        Forcing frequency, 2 to 10 in the paper.
    restitution : float
        Restitution coefficient; of the soft stop, that of its free contact
        (`KelvinVoigt.equivalent`), which we take for the paper's measure of equal dissipation
        because its impacts per period come out with it.
    stop : {"hard", "soft"}
        The contact law.
    stop_stiffness : float
        Stiffness of the soft stop; 2e5, 2000, 500 and 100 in the paper.
    **changes
        Other parameters of `Oscillator`, to depart from the paper.
    """
    if stop not in ("hard", "soft"):
        raise InvalidInput("stop", stop, '"hard" or "soft"')
    law: Rigid | KelvinVoigt = Rigid(restitution)
    if stop == "soft":
        law = KelvinVoigt.equivalent(restitution, stop_stiffness)
    known: dict[str, Any] = {
        "damping": 0.23,
        "base": BaseMotion(0.0025, eta, -math.pi / 2, damper=False, stops=True),
        "stops": (Stop(0.0, law, "lower"),),
        "name": f"Okolewski's {stop} stop at eta = {eta:g}",
    }
    return Oscillator(**(known | changes))
