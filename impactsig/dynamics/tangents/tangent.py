"""Tangent map: the derivative of a motion's final state by its initial state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arguments import refuse
from ..._showing import Shown
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation import simulate
from ...simulation.flows.course import state_of
from ..arguments import instead_of
from ._follow import Follower

SYSTEMS = "an Oscillator, a Cantilever, a Flow, or an Oscillator under OGY"


@dataclass(frozen=True, eq=False)
class TangentMap(Shown):
    """Derivative of the final state with respect to the initial state.

    Attributes
    ----------
    matrix : ndarray, shape (d, d)
        ``matrix @ dy`` is the deviation of the final state for a small deviation dy of the initial
        state: displacement and velocity of an oscillator, in its units; modal displacements [m],
        then velocities [m/s] of a cantilever; coordinates of a flow. It is
        ``exp(log_scale) * scaled``, and may overflow.
    scaled, log_scale : ndarray, float
        The matrix in scaled form, for motions so long that it overflows.
    log_determinant : float
        Logarithm of the determinant, computed separately from the damping and the determinants of
        the events. -inf if a dimension collapses; NaN for a Hertz stop whose loss depends on the
        approach velocity, and under OGY, where the determinant may be negative.
    impacts : int
        Impacts, and touches of soft stops.
    collapses : int
        Number of collapses of deviations by sticking or by an impact without rebound.
    grazings : int
        Number of grazing events, which have no derivative; their saltation is omitted.
    final : tuple of float, or ndarray
        State at the end (and phase of the forcing), as of the motion.
    status : str
        As in `simulate`.

    See Also
    --------
    tangent_map, results.LyapunovSpectrum

    Examples
    --------
    >>> import math
    >>> from impactsig import Force, Oscillator, tangent_map
    >>> found = tangent_map(Oscillator(damping=0.2, forces=(Force(1.0, 0.5),)), periods=1)
    >>> round(found.log_determinant, 6), round(-0.2 * 2 * math.pi / 0.5, 6)
    (-2.513274, -2.513274)
    """

    matrix: np.ndarray
    scaled: np.ndarray
    log_scale: float
    log_determinant: float
    impacts: int
    collapses: int
    grazings: int
    final: Any
    status: str

    @property
    def multipliers(self) -> np.ndarray:
        """Eigenvalues, shape (d,), in descending order of modulus.

        For a periodic orbit, its Floquet multipliers over the span. The smaller of two multipliers
        is accurate however small it is.
        """
        square = math.nan
        if len(self.scaled) == 2:
            half = np.trace(self.scaled) / 2
            square = half**2 - math.exp(self.log_determinant - 2 * self.log_scale)
        if math.isnan(square):
            values = np.linalg.eigvals(self.scaled).astype(complex)
        elif square < 0:
            values = np.array([complex(half, math.sqrt(-square))] * 2)
            values[1] = values[1].conjugate()
        else:
            large = half + math.copysign(math.sqrt(square), half)
            product = half**2 - square
            values = np.array([large, product / large if large else 0.0], complex)
        values = values[np.argsort(-np.abs(values), kind="stable")] * math.exp(self.log_scale)
        return values if np.iscomplex(values).any() else values.real


def tangent_map(system: Any, **options: Any) -> TangentMap:
    """Derivative of a motion's final state with respect to its initial state.

    Between events the tangent flow is the homogeneous flow of the mode; at impacts, at the
    beginning and end of a contact, and where friction reverses, holds or releases the mass, it
    jumps by the saltation matrix [Muller1995]_, which includes the acceleration of a moving base;
    for a cantilever it includes all modes. With Hertz stops, user-defined forces and flows, the
    variational equation is integrated together with the motion.

    Parameters
    ----------
    system : Oscillator, Cantilever, Flow or Controlled
        The system; a controlled one must be an oscillator under `OGY`, with the derivative of the
        gains included.
    **options
        `periods` or `duration`, `initial`, `phase`, `method`, `chatter` as for `simulate`; with
        noise `seed`: the derivative is that of one path, under the same noise.

    Returns
    -------
    TangentMap

    Raises
    ------
    InvalidInput
        As `simulate` does; also if the state is not finite-dimensional, as under delayed feedback,
        or has no derivative, as under noise at a rigid stop.

    See Also
    --------
    lyapunov_spectrum, find_periodic_orbit

    Examples
    --------
    >>> from impactsig import scenes, simulate, tangent_map
    >>> beam = scenes.karpodinis(22.1)
    >>> motion = simulate(beam, periods=1, transient=1000)
    >>> found = tangent_map(beam, periods=1, initial=motion.final[:2])
    >>> bool(abs(found.multipliers).max() < 1)  # the motion is stable
    True
    """
    refuse("of a tangent map", "Give initial=", transient=options.pop("transient", None))
    if isinstance(system, Oscillator) and system.noise is not None:
        return _of_path(system, options)
    if isinstance(system, Oscillator):
        return _of_oscillator(system, options)
    if isinstance(system, Cantilever):
        return _of_beam(system, options)
    if isinstance(system, Flow):
        return _of_flow(system, options)
    home = differentiated_by(system)
    if home is not None:
        return home.tangent_of(system, **options)
    raise InvalidInput("system", system, SYSTEMS, instead_of(system))


def differentiated_by(system: Any) -> Any:
    """Module with the derivatives of a system of a higher layer, or None."""
    home = getattr(system, "differentiated_by", None)
    return None if home is None or isinstance(system, type) else home()


def _of_oscillator(oscillator: Oscillator, options: dict[str, Any]) -> TangentMap:
    from .columns import DETERMINANT, FIRST, IMPACTS, LINES, POINTS, SINGULAR

    follower = Follower(oscillator, False, **options)
    run, omega = follower.run, follower.omega
    status, _, _ = follower.to(run.length)
    motion = run.motion(run.length, keep=False)
    totals = follower.totals
    unit = np.array([[1, 1 / omega], [omega, 1]])
    # A column that begins without motion is no direction of the start's: stops carry none of it.
    scaled = unit * follower.columns
    collapses = int(totals[LINES] + totals[POINTS])
    return map_from(
        scaled, float(totals[FIRST]), float(totals[DETERMINANT]), motion.final,
        int(totals[IMPACTS]), collapses, int(totals[SINGULAR]), status,
    )  # fmt: skip


def _of_path(oscillator: Oscillator, options: dict[str, Any]) -> TangentMap:
    """The tangent map along one path of an oscillator under noise."""
    from ._noisy_tangent import tangent_steps

    refuse("under noise", "", **{name: options.get(name) for name in ("every", "chatter")})
    path, matrices, divergence = tangent_steps(oscillator, **options)
    scaled, scale = np.eye(2), 0.0
    for matrix in matrices:
        scaled, scale = multiplied(matrix, scaled, scale)
    impacts = len(path.impacts)
    return map_from(scaled, scale, float(divergence.sum()), path.final, impacts, 0, 0, path.status)


def _of_beam(beam: Cantilever, options: dict[str, Any]) -> TangentMap:
    from ._beam_tangent import steps

    motion = simulate(beam, **options)
    m = beam.modes
    scaled, scale, determinant = np.eye(2 * m), 0.0, 0.0
    collapses = grazings = 0
    for _, step in steps(motion, np.array([motion.stop])):
        scaled, scale = multiplied(step.matrix, scaled, scale)
        lost = step.collapsed
        determinant += -math.inf if lost else float(np.linalg.slogdet(step.matrix)[1])
        collapses, grazings = collapses + lost, grazings + step.grazed
    unit = np.repeat([1.0, motion._omega], m)
    scaled = scaled * unit[:, None] / unit
    return map_from(
        scaled, scale, determinant, motion.final, len(motion.impacts), collapses, grazings,
        motion.status,
    )  # fmt: skip


def _of_flow(flow: Flow, options: dict[str, Any]) -> TangentMap:
    from ..periodic.flow_shooting import converged

    motion = simulate(flow, **options)
    start = state_of(flow, options.get("initial"))
    _, matrix, _, settled = converged(flow, start, motion.duration)
    if motion.status == "complete" and not settled:
        raise InvalidInput(
            "duration", motion.duration, "a span in which differences grow by no more than digits",
            "lyapunov_spectrum() follows them for as long as wanted",
        )  # fmt: skip
    size = float(np.abs(matrix).max()) or 1.0
    determinant = float(np.linalg.slogdet(matrix)[1])
    return map_from(
        matrix / size, math.log(size), determinant, motion.final, 0, 0, 0, motion.status
    )


def multiplied(matrix: np.ndarray, scaled: np.ndarray, scale: float) -> tuple[np.ndarray, float]:
    """A matrix times a scaled one, scaled anew, and the logarithm of the scale."""
    scaled = matrix @ scaled
    size = float(np.abs(scaled).max()) or 1.0
    return scaled / size, scale + math.log(size)


def map_from(
    scaled: np.ndarray, scale: float, determinant: float, final: Any, impacts: int,
    collapses: int, grazings: int, status: str,
) -> TangentMap:  # fmt: skip
    """The result, of a matrix scaled by the exponential of `scale`."""
    with np.errstate(over="ignore", under="ignore"):
        matrix = scaled * np.exp(scale)
    return TangentMap(
        matrix, scaled, scale, determinant, impacts, int(collapses), int(grazings), final,
        status,
    )  # fmt: skip
