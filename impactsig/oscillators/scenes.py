"""The systems of the papers, with their parameters; a value that is our choice is marked so.

Those that are linear between events take arrays for their parameters: shapes broadcast, and what
they make is an `OscillatorBatch`.

Those without dimensions tell no seconds: their time is in units of the papers' equations.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from types import SimpleNamespace
from typing import Any, Literal

from .._arguments import choice
from ..errors import InvalidInput
from .batch import takes_arrays
from .cantilever import Cantilever
from .oscillator import Oscillator
from .parts import (
    BaseMotion,
    Force,
    Friction,
    Noise,
    columns_allowed,
    numbers,
)
from .stops import KelvinVoigt, Rigid, Stop

__all__ = [
    "begley_virgin",
    "cantilever",
    "karpodinis",
    "okolewski",
    "tian",
    "van_der_pol_duffing",
]

NATURAL_FREQUENCY = 22.2
"""First natural frequency of the beam of [Karpodinis]_ [Hz]."""


@takes_arrays()
def karpodinis(
    frequency: float = 22.1,
    *,
    damping_ratio: float = 0.03,
    amplitude: float = 0.25,
    restitution: float = 0.2,
) -> Oscillator:
    """The impacting cantilever beam of [Karpodinis]_, in its first mode.

    ``x'' + 2 damping_ratio x' + x = amplitude cos(omega t)``, x < 1, with x in units of the gap and
    time in units of 1/omega_n. The natural frequency, 22.2 Hz, and the restitution coefficient,
    0.2, are those of the thesis. With the default damping and amplitude the beam is periodic at
    22.1 Hz and chaotic at 20.1 and 20.3355 Hz, as in the thesis; delayed feedback with a gain of
    0.45, which fails in the thesis, succeeds. `karpodinis_control` reproduces all results of the
    thesis on control, but is period(1, 3) at 20.1 Hz.

    Parameters
    ----------
    frequency : float
        Forcing frequency [Hz]. At 22.1 Hz there is one impact per period, at 20.1 and 20.3355 Hz
        chaos.
    damping_ratio : float
        Damping as a fraction of critical damping. Our choice: the table with it and the amplitude
        is not in the available text of the thesis.
    amplitude : float
        Amplitude of the forcing: the deflection under a constant force of that size, in units of
        the gap. Our choice as well.
    restitution : float
        Restitution coefficient.

    Returns
    -------
    Oscillator
        The first mode, in units of the gap and of 1/omega_n; `time_unit` converts to seconds.

    Raises
    ------
    InvalidInput
        If a parameter is out of its range.

    See Also
    --------
    impactsig.scenes.cantilever, impactsig.simulate

    Examples
    --------
    >>> from impactsig import scenes, simulate
    >>> motion = simulate(scenes.karpodinis(22.1), periods=20, transient=500)
    >>> motion.impact_count
    20
    """
    _require(above=0.0, frequency=frequency)
    _require(least=0.0, damping_ratio=damping_ratio)
    return Oscillator(
        damping=2 * damping_ratio,
        forces=(Force(amplitude, frequency / NATURAL_FREQUENCY),),
        stops=(Stop(1.0, Rigid(restitution)),),
        time_unit=1 / (2 * math.pi * NATURAL_FREQUENCY),
        name=_named("Karpodinis' beam at {:g} Hz", frequency),
    )


def karpodinis_control(frequency: float = 20.3355, *, restitution: float = 0.2) -> Oscillator:
    """The beam of [Karpodinis]_ with the damping and amplitude that meet its chapter on control.

    `karpodinis` with a damping ratio of 0.1 and an amplitude of 0.265, our choice: with them
    delayed feedback with a limit of 0.1 holds period(1, 1) at the gain 0.15 and fails at 0.01 and
    0.45, and holds period(1, 2) at 0.15 and 0.015, as the thesis reports. At 20.1 Hz, where the
    thesis has chaos, it is period(1, 3).

    Parameters
    ----------
    frequency : float
        Forcing frequency [Hz]; 20.3355 Hz, where the thesis controls it, is chaotic.
    restitution : float
        Restitution coefficient.

    Raises
    ------
    InvalidInput
        If a parameter is out of its range.

    See Also
    --------
    impactsig.scenes.karpodinis

    Examples
    --------
    >>> from impactsig import scenes
    >>> scenes.karpodinis_control().forces[0].amplitude
    0.265
    """
    return karpodinis(frequency, damping_ratio=0.1, amplitude=0.265, restitution=restitution)


@takes_arrays()
def okolewski(
    eta: float,
    restitution: float,
    stop: Literal["hard", "soft"] = "hard",
    *,
    stop_stiffness: float = 2e5,
    **changes: Any,
) -> Oscillator:
    """A mass on a moving base that carries the stop, hard or soft [Okolewski2021]_.

    ``x'' + 0.23 x' + x = a sin(eta t)``, ``x >= a sin(eta t)``, a = 0.0025: the spring is attached
    to the base, the damper to the ground. The quantity a_e of the paper, the change of the kinetic
    energy of the body in impacts, is `Motion.kinetic_energy_gained`; `Motion.energy_lost` is the
    energy dissipated by the stop. The published periods and impacts per period are reproduced for
    both kinds of stop. The published Lyapunov exponents, which are for a finite time, and the 201
    impacts per period of the hard stop at eta = 3, r = 0.6, which chatters, are not.

    Parameters
    ----------
    eta : float
        Angular frequency of the base, 2 to 10 in the paper.
    restitution : float
        Restitution coefficient; of the soft stop, that of its free contact
        (`KelvinVoigt.equivalent`). We assume this to be the measure of equal dissipation of the
        paper, because it reproduces its impacts per period.
    stop : {"hard", "soft"}
        The contact law.
    stop_stiffness : float
        Stiffness of the soft stop; 2e5, 2000, 500 and 100 in the paper.
    **changes
        Other parameters of `Oscillator`, to depart from the paper.

    Returns
    -------
    Oscillator
        The mass, in the dimensionless units of the paper.

    Raises
    ------
    InvalidInput
        If a parameter is out of its range.

    See Also
    --------
    impactsig.scenes.tian, impactsig.stop_damping

    Examples
    --------
    >>> from impactsig import scenes
    >>> hard = scenes.okolewski(4.0, 0.6)
    >>> soft = scenes.okolewski(4.0, 0.6, "soft", stop_stiffness=2000.0)
    >>> type(hard.stops[0].law).__name__, type(soft.stops[0].law).__name__
    ('Rigid', 'KelvinVoigt')
    """
    choice("stop", stop, ("hard", "soft"))
    _require(above=0.0, eta=eta, stop_stiffness=stop_stiffness)
    law: Rigid | KelvinVoigt = Rigid(restitution)
    if stop == "soft":
        law = _equivalent(restitution, stop_stiffness)
    known: dict[str, Any] = {
        "damping": 0.23,
        "base": BaseMotion(0.0025, eta, -math.pi / 2, damper=False, stops=True),
        "stops": (Stop(0.0, law, "lower"),),
        "name": _named(f"Okolewski's {stop} stop at eta = {{:g}}", eta),
        "in_seconds": False,
    }
    return Oscillator(**(known | changes))


@takes_arrays()
def tian(
    omega: float,
    amplitude: float,
    stop: Literal["hard", "soft"] = "soft",
    *,
    damping_ratio: float = 0.03,
    gap: float = 1.0,
    restitution: float = 0.85,
    stop_stiffness: float = 1e4,
    stop_damping: float = 10.3288336,
) -> Oscillator:
    """A mass with a rigid stop, or with the soft stop that is equivalent to it [Tian]_.

    ``x'' + 2 damping_ratio x' + x = amplitude sin(omega t + phi)``; beyond the gap d the soft stop
    adds ``stop_stiffness (x - d) + stop_damping x'`` (beta and zeta_1 in the paper) on the left;
    the hard stop changes x' to ``-restitution x'``. phi in the paper is the `phase` of `simulate`.
    With the defaults, omega from 0.5 to 4 and A from 0.1 to 2, there are impacts in a third of the
    plane, and `match_rate` is 91.9 %, as published; with a gap of 0.5 it is 83 %. The published
    sequence 4/3, 4/2, 2/1 (period/impacts) in the upper right corner requires a smaller gap: at A =
    2 it exists for a gap of 0.5, at omega = 2.65, 2.7 and 2.85, but not for 1.

    Parameters
    ----------
    omega : float
        Angular frequency of the forcing. The range sampled in the paper is not in the available
        text; 0.5 to 4 is our choice.
    amplitude : float
        Amplitude of the forcing; 0.1 to 2 is our choice as well.
    stop : {"hard", "soft"}
        The contact law.
    damping_ratio : float
        Damping as a fraction of critical damping (zeta in the paper). Our choice: the paper's is
        not in the available text.
    gap : float
        Position of the stop. Our choice as well; it sets the scale of the displacement.
    restitution : float
        Restitution coefficient of the hard stop, 0.85 as in the paper.
    stop_stiffness : float
        Stiffness of the soft stop (beta in the paper), by default the published optimum for a
        restitution coefficient of 0.85.
    stop_damping : float
        Damping of the soft stop (zeta_1 in the paper), from the same optimum;
        `KelvinVoigt.equivalent` gives 10.3325.

    Returns
    -------
    Oscillator
        The mass, in the dimensionless units of the paper.

    Raises
    ------
    InvalidInput
        If a parameter is out of its range.

    See Also
    --------
    impactsig.fit_soft_stop, impactsig.match_rate, impactsig.scenes.okolewski

    Examples
    --------
    >>> from impactsig import scenes, stop_restitution
    >>> soft = scenes.tian(1.5, 0.5).stops[0].law
    >>> round(stop_restitution(soft.stiffness, soft.damping), 2)
    0.85
    """
    choice("stop", stop, ("hard", "soft"))
    _require(above=0.0, omega=omega, stop_stiffness=stop_stiffness)
    _require(least=0.0, damping_ratio=damping_ratio, stop_damping=stop_damping)
    soft = KelvinVoigt(stop_stiffness, stop_damping)
    return Oscillator(
        damping=2 * damping_ratio,
        forces=(Force(amplitude, omega, -math.pi / 2),),
        stops=(Stop(gap, soft if stop == "soft" else Rigid(restitution)),),
        name=_named(f"Tian's {stop} stop at omega = {{:g}}, A = {{:g}}", omega, amplitude),
        in_seconds=False,
    )


@takes_arrays()
def begley_virgin(
    gamma: float,
    sigma: float | tuple[float, float],
    friction: float,
    *,
    damping_ratio: float = 0.02,
    wall_stiffness: float = 15.0**2,
    kinetic_ratio: float = 1.0,
) -> Oscillator:
    """A mass with friction between two walls, on a base that moves [BegleyVirgin1998]_.

    ``theta'' + 2 h theta' + theta + f(theta') + g(theta) = 2 h gamma cos(gamma t) + sin(gamma t)``,
    h = `damping_ratio`: spring and damper are attached to a base that moves as sin(gamma t); the
    walls are fixed. f opposes the motion with `kinetic_ratio` times `friction`, and balances a
    force up to `friction` on a mass at rest; g is `wall_stiffness` times the depth in a wall.

    The charts of the paper for friction have damping_ratio = 0.001, those for viscous damping
    friction = 0; its bifurcation diagrams and phase portraits belong to an experiment with a
    damping ratio of 0.02. The default rho of 15 reproduces the chaos of its figure 20 and the four
    attractors, but not the pair of figure 14c, which requires rho >= 17.

    Parameters
    ----------
    gamma : float
        Ratio of the angular frequency of the base to the natural one; at 1.338, sigma = 1.6 and
        friction = 0.05 there are four attractors.
    sigma : float or (float, float)
        Positions of the walls, relative to the rest position of the spring: at -sigma and sigma, or
        left and right.
    friction : float
        Half the range of displacements at which the mass can rest (f in the paper); 0 for none.
    damping_ratio : float
        Damping as a fraction of critical damping (h in the paper): 0.02 in the experiment, 0.001 in
        the charts and spectra with friction, 0.1 and 0.5 in the spectra without.
    wall_stiffness : float
        Ratio of the stiffness of a wall to that of the spring, rho^2. 15^2 is our choice, since the
        value is not in the available text of the paper; the four attractors exist from 8^2 to 40^2.
    kinetic_ratio : float
        Ratio of kinetic to static friction, at most 1 (alpha_k in the paper). 1 is our choice.

    Returns
    -------
    Oscillator
        The mass, in the dimensionless units of the paper.

    Raises
    ------
    InvalidInput
        If a parameter is out of its range.

    See Also
    --------
    impactsig.scenes.okolewski, impactsig.scenes.tian, impactsig.basins_of_attraction

    Examples
    --------
    >>> from impactsig import scenes
    >>> walls = scenes.begley_virgin(gamma=1.338, sigma=1.6, friction=0.05)
    >>> [stop.position for stop in walls.stops]
    [-1.6, 1.6]
    """
    _require(above=0.0, gamma=gamma, wall_stiffness=wall_stiffness)
    _require(least=0.0, friction=friction, damping_ratio=damping_ratio)
    _require(least=0.0, most=1.0, kinetic_ratio=kinetic_ratio)
    left, right = _both(sigma)
    has_friction = bool(friction.any() if hasattr(friction, "any") else friction)
    wall = KelvinVoigt(wall_stiffness)
    return Oscillator(
        damping=2 * damping_ratio,
        base=BaseMotion(1.0, gamma, -math.pi / 2),
        stops=(Stop(left, wall, "lower"), Stop(right, wall, "upper")),
        friction=Friction(kinetic_ratio * friction, friction) if has_friction else None,
        name=_named("Begley and Virgin's walls at gamma = {:g}", gamma),
        in_seconds=False,
    )


def van_der_pol_duffing(
    restitution: float = 0.99,
    friction: float = 1.0,
    intensity: float = 1.0,
    *,
    epsilon: float = 0.01,
    c1: float = 3.0,
    c2: float = 1.0,
) -> Oscillator:
    """A Van der Pol-Duffing oscillator under white noise, with friction and a stop at 0.

    The system of [VanDerPolDuffing2020]_, and by default its values:
    ``x'' + epsilon (c2 x^2 - c1) x' + epsilon f_k sgn x' + x^3 = sqrt(epsilon) xi``, x >= 0, with
    ``<xi(t) xi(t + s)> = 2 D delta(s)``.

    The scaling of the noise by epsilon is an interpretation, since the formulas are not in the
    available text of the paper: of three possible ones, it gives the published sequences of shapes
    over r and f_k if peaks of at least 2 % of the highest are counted. The statement that D does
    not change the shape then holds if all peaks are counted, but not if only visible ones are.

    Parameters
    ----------
    restitution : float
        Restitution coefficient of the stop (r).
    friction : float
        Coulomb friction divided by epsilon (f_k); 0 for none.
    intensity : float
        Intensity of the noise divided by epsilon (D).
    epsilon : float
        Small parameter that scales damping, friction and noise.
    c1, c2 : float
        Gain at small, and loss at large displacements.

    Returns
    -------
    Oscillator
        The oscillator, in the dimensionless units of the paper, with its noise.

    Raises
    ------
    InvalidInput
        If a parameter is out of its range.

    See Also
    --------
    impactsig.averaged_density, impactsig.simulate_ensemble

    Examples
    --------
    >>> from impactsig import scenes
    >>> shaken = scenes.van_der_pol_duffing(restitution=0.99)
    >>> shaken.stops[0].position, shaken.noise.intensity
    (0.0, 0.01)
    """
    _require(least=0.0, friction=friction, intensity=intensity, c1=c1, c2=c2)
    _require(above=0.0, epsilon=epsilon)
    return Oscillator(
        stiffness=0.0,
        stops=(Stop(0.0, Rigid(restitution), "lower"),),
        friction=Friction(epsilon * friction) if friction else None,
        law=_van_der_pol_duffing(epsilon * float(c1), epsilon * float(c2)),
        noise=Noise(epsilon * intensity),
        name=f"Van der Pol-Duffing, r = {restitution:g}, f_k = {friction:g}, D = {intensity:g}",
        in_seconds=False,
    )


@lru_cache(maxsize=256)  # the same numbers give the same function, which is compiled once
def _van_der_pol_duffing(gain: float, loss: float) -> Callable[[float, float, float], float]:
    """The force of a cubic spring and of damping that is negative at small displacements."""

    def law(t: float, x: float, v: float) -> float:
        return (gain - loss * x * x) * v - x * x * x

    return law


@takes_arrays(
    *("length", "width", "thickness", "modulus", "density", "natural_frequency"),
)
def cantilever(
    length: float,
    width: float,
    thickness: float,
    modulus: float,
    density: float,
    stop: float,
    frequency: float,
    amplitude: float,
    loading: Literal["base", "clamp", "tip"] = "base",
    *,
    damping_ratio: float = 0.03,
    restitution: float = 0.2,
    natural_frequency: float | None = None,
    **changes: Any,
) -> Oscillator:
    """The first mode of a uniform cantilever with a stop at its tip, from its dimensions.

    ``m x'' + 2 damping_ratio m omega_n x' + m omega_n^2 x = F cos(omega t)`` in SI units, m a
    quarter of the mass of the beam, omega_n as in `Cantilever` [Rao2017]_. x is the deflection of
    the tip; with a stop on the ground ("clamp") it is the position of the tip.

    Parameters
    ----------
    length : float
        Free length of the beam [m].
    width : float
        Its width [m].
    thickness : float
        Its thickness [m], in the plane in which it vibrates.
    modulus : float
        Young's modulus [Pa].
    density : float
        Density of its material [kg/m^3].
    stop : float
        Gap: distance of the stop from the tip of the beam at rest [m].
    frequency : float
        Forcing frequency [Hz].
    amplitude : float
        Amplitude of the forcing: of the base or the clamp [m], or of the force at the tip [N].
    loading : {"base", "clamp", "tip"}
        Excitation: motion of a base that carries clamp and stop, motion of the clamp alone with a
        stop on the ground, or a force at the tip. Motion of a base or clamp excites the first mode
        by 1.566 times its amplitude.
    damping_ratio : float
        Damping as a fraction of critical damping, as measured by `identify_resonance`. The default
        is our choice, as for `karpodinis`.
    restitution : float
        Restitution coefficient of the beam as a whole, which `apparent_restitution` computes from
        that of its tip; by default that of [Karpodinis]_.
    natural_frequency : float, optional
        Measured natural frequency [Hz], used instead of the calculated one; the mass is not
        changed.
    **changes
        Other parameters of `Oscillator`, such as a soft stop.

    Returns
    -------
    Oscillator
        The first mode, in SI units.

    Raises
    ------
    InvalidInput
        If a parameter is out of its range.

    See Also
    --------
    impactsig.Cantilever, impactsig.identify_resonance

    Examples
    --------
    >>> import math
    >>> from impactsig import scenes
    >>> size = (0.2, 0.025, 1e-3)
    >>> beam = scenes.cantilever(*size, 210e9, 7850, stop=1e-3, frequency=20, amplitude=2e-4)
    >>> round(math.sqrt(beam.stiffness / beam.mass) / beam.time_unit / (2 * math.pi), 2)
    20.89
    """
    choice("loading", loading, ("base", "clamp", "tip"))
    beam = Cantilever(length, width, thickness, modulus, density)
    if natural_frequency is not None:
        _require(above=0.0, natural_frequency=natural_frequency)
        beam = beam.tuned(natural_frequency)
    _require(above=0.0, stop=stop, frequency=frequency)
    _require(least=0.0, damping_ratio=damping_ratio)
    _require(amplitude=amplitude)
    mass, stiffness = beam.modal_mass, float(beam.modal_stiffness(1)[0])
    omega, force = 2 * math.pi * frequency, amplitude
    if loading != "tip":
        # Relative to what it is clamped in, inertia is a force; but a lumped mass that hangs on a
        # moving spring feels its own share of that already.
        share = float(beam.participation(1)[0]) - (loading == "clamp")
        force = share * mass * (omega * omega) * amplitude
    known: dict[str, Any] = {
        "mass": mass,
        "damping": 2 * damping_ratio * math.sqrt(mass * stiffness),
        "stiffness": stiffness,
        "forces": (Force(force, omega),),
        "base": BaseMotion(amplitude, omega) if loading == "clamp" else None,
        "stops": (Stop(stop, Rigid(restitution)),),
        "name": f"cantilever of {beam.frequencies(1)[0]:.4g} Hz",
    }
    return Oscillator(**(known | changes))


def _both(sigma: Any) -> tuple[Any, Any]:
    """Walls on the left and on the right."""
    pair = sigma if isinstance(sigma, (tuple, list)) else None
    required = "a positive number, or two finite ones, left < right"
    try:
        left, right = pair if pair else (-sigma, sigma)
        if not columns_allowed.get():
            left, right = float(left), float(right)
    except Exception:
        raise InvalidInput("sigma", sigma, required) from None
    for value in (left, right):
        numbers(SimpleNamespace(sigma=value), "sigma")
    right_order = left < right
    if not (right_order.all() if hasattr(right_order, "all") else right_order):
        raise InvalidInput("sigma", sigma, required)
    return left, right


def _equivalent(restitution: Any, stiffness: Any) -> KelvinVoigt:
    """`KelvinVoigt.equivalent`, for each oscillator of a batch."""
    if not columns_allowed.get():
        return KelvinVoigt.equivalent(restitution, stiffness)
    import numpy as np

    pairs = np.stack(np.broadcast_arrays(restitution, stiffness), axis=-1).reshape(-1, 2)
    known, which = np.unique(pairs, axis=0, return_inverse=True)
    token = columns_allowed.set(False)
    try:
        damping = np.array([KelvinVoigt.equivalent(*pair).damping for pair in known.tolist()])
    finally:
        columns_allowed.reset(token)
    columns: Any = damping[which.ravel()]
    return KelvinVoigt(stiffness, columns)


def _named(words: str, *values: Any) -> str:
    """A name with numbers in it; a batch has none, its oscillators have."""
    return "" if columns_allowed.get() else words.format(*values)


def _require(
    *, above: float = -math.inf, least: float = -math.inf, most: float = math.inf, **given: Any
) -> None:
    """Validate a parameter under the name that the scene gives it."""
    numbers(SimpleNamespace(**given), *given, above=above, least=least, most=most)
