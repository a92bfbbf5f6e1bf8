"""Restitution coefficient of a spring and a damper, by three definitions, and the inverses.

In units of the contact's own frequency ``sqrt(k/m)``, with ``beta = c / (2 sqrt(k m))``, a mass
that meets a spring and a damper side by side, free of other forces, returns

- ``exp(-pi beta / sqrt(1 - beta^2))`` of its velocity when the depth is zero again ("gap");
- ``exp(-2 beta arccos(beta) / sqrt(1 - beta^2))`` when the force is ("force");
- the energy less the work of the damper along a half-sine without loss, ``c = (1 - r^2)
  sqrt(k m) / pi`` ("work"), to first order the same.
"""

from __future__ import annotations

import math
from typing import Literal

from .._arguments import choice, number
from ..errors import InvalidInput

Formula = Literal["gap", "force", "work"]


def stop_restitution(
    stiffness: float, damping: float, mass: float = 1.0, *, formula: Formula = "gap"
) -> float:
    """Restitution coefficient of a soft stop after one free contact [Okolewski2021]_.

    Parameters
    ----------
    stiffness : float
        Stiffness of the stop [N/m], positive.
    damping : float
        Its damping [N s/m].
    mass : float
        Impacting mass [kg], positive.
    formula : {"gap", "force", "work"}
        End of the contact: "gap", at zero depth, where the damper may pull (`KelvinVoigt` with
        ``ends="gap"``), or "force", at zero force (``ends="force"``); both are exact. "work" is an
        approximation by the work of the damper along the undamped motion.

    Returns
    -------
    float
        Restitution coefficient. With "gap" it is zero from critical damping on, since the mass
        creeps back and its depth does not become zero again.

    Raises
    ------
    InvalidInput
        If a number is out of range; with "work" also if the damping exceeds
        ``sqrt(stiffness mass) / pi``, where this work exceeds the energy.

    See Also
    --------
    stop_damping, stop_stiffness, KelvinVoigt

    Examples
    --------
    >>> from impactsig import stop_restitution
    >>> stop_restitution(100.0, 0.0)
    1.0
    >>> round(stop_restitution(100.0, 2.0), 6)  # exp(-pi zeta / sqrt(1 - zeta^2)), zeta = 0.1
    0.729248
    """
    _known(formula)
    stiffness = number("stiffness", stiffness, above=0)
    mass = number("mass", mass, above=0)
    damping = number("damping", damping, least=0.0)
    beta = damping / (2 * math.sqrt(stiffness) * math.sqrt(mass))
    if formula == "work":
        kept = 1 - 2 * math.pi * beta
        if kept < 0:
            most = math.sqrt(stiffness) * math.sqrt(mass) / math.pi
            raise InvalidInput(
                "damping", damping, f"at most {most:g}", "Use formula='gap' or 'force'"
            )
        return math.sqrt(kept)
    if formula == "gap":
        return math.exp(-math.pi * beta / _cosine(beta)) if beta < 1 else 0.0
    return math.exp(-_force_loss(beta))


def stop_damping(
    restitution: float, stiffness: float, mass: float = 1.0, *, formula: Formula = "gap"
) -> float:
    """Damping of a soft stop that has a given restitution coefficient [Okolewski2021]_.

    Parameters
    ----------
    restitution : float
        Restitution coefficient, above 0 (which would require infinite damping; with "work" 0 is
        allowed) and at most 1.
    stiffness, mass, formula
        As for `stop_restitution`, whose inverse this is.

    Returns
    -------
    float
        Damping of the stop [N s/m].

    Raises
    ------
    InvalidInput
        If a number is out of range.

    See Also
    --------
    stop_restitution, stop_stiffness, KelvinVoigt

    Examples
    --------
    >>> from impactsig import stop_damping, stop_restitution
    >>> damping = stop_damping(0.85, 10_000.0)
    >>> round(damping, 4)
    10.3325
    >>> round(stop_restitution(10_000.0, damping), 6)
    0.85
    """
    _known(formula)
    stiffness = number("stiffness", stiffness, above=0)
    mass = number("mass", mass, above=0)
    return 2 * _beta(_share(restitution, formula), formula) * math.sqrt(stiffness) * math.sqrt(mass)


def stop_stiffness(
    restitution: float, damping: float, mass: float = 1.0, *, formula: Formula = "gap"
) -> float:
    """Stiffness of a soft stop of given damping that has a given restitution coefficient.

    Parameters
    ----------
    restitution : float
        Restitution coefficient, above 0 (with "work" from 0) and below 1, which would require
        infinite stiffness.
    damping : float
        Damping of the stop [N s/m], positive.
    mass, formula
        As for `stop_restitution`, whose inverse this is too [Okolewski2021]_.

    Returns
    -------
    float
        Stiffness of the stop [N/m].

    Raises
    ------
    InvalidInput
        If a number is out of range.

    See Also
    --------
    stop_restitution, stop_damping, KelvinVoigt

    Examples
    --------
    >>> from impactsig import stop_restitution, stop_stiffness
    >>> stiffness = stop_stiffness(0.85, 10.0)
    >>> round(stop_restitution(stiffness, 10.0), 6)
    0.85
    """
    _known(formula)
    damping = number("damping", damping, above=0)
    mass = number("mass", mass, above=0)
    share = _share(restitution, formula)
    if share == 1:
        raise InvalidInput(
            "restitution", restitution, "less than 1", "No stiffness makes a damper lose nothing"
        )
    return (damping / (2 * _beta(share, formula))) ** 2 / mass


def _known(formula: str) -> None:
    choice("formula", formula, ("gap", "force", "work"))


def _share(restitution: float, formula: str) -> float:
    share = number("restitution", restitution, least=0.0, most=1.0)
    if share == 0 and formula != "work":
        raise InvalidInput("restitution", restitution, "above 0", "0 requires infinite damping")
    return share


def _beta(r: float, formula: str) -> float:
    """Damping ratio of the contact that returns r."""
    if formula == "work":
        return (1 - r) * (1 + r) / (2 * math.pi)
    loss = -math.log(r)
    if formula == "gap":
        return loss / math.hypot(math.pi, loss)
    from scipy.optimize import brentq

    # From below, beta: the loss is at least beta up to critical damping, ln(2 beta) beyond.
    most = max(1.0, loss, math.exp(min(loss / 2, 700.0)))
    return brentq(lambda beta: _force_loss(beta) - loss, 0.0, most, xtol=1e-300, rtol=1e-15)


def _force_loss(beta: float) -> float:
    """-ln r of a contact that ends at zero force."""
    if beta < 1:
        return 2 * beta * math.acos(beta) / _cosine(beta) if 1 - beta > 1e-12 else 2.0
    return 2 * beta * math.acosh(beta) / _cosine(beta) if beta - 1 > 1e-12 else 2.0


def _cosine(beta: float) -> float:
    return math.sqrt(abs(1 - beta) * (1 + beta))
