"""How neighbours of a motion part: the derivative of where it ends by where it starts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..oscillators import Oscillator
from ._follow import Follower


@dataclass(frozen=True, eq=False)
class TangentMap:
    """The derivative of the final by the initial displacement and velocity.

    Attributes
    ----------
    matrix : ndarray, shape (2, 2)
        In the oscillator's units; ``matrix @ (dx, dv)`` is what a start that far off ends off. Its
        entries are those of ``exp(log_scale)`` times `scaled`, and may overflow.
    scaled, log_scale : ndarray, float
        The same, for motions so long that the matrix is no number.
    log_determinant : float
        Logarithm of its determinant, worked out apart: damping and what every event does to areas.
        -inf where a dimension is lost; NaN for a Hertz stop whose loss goes by its approach
        velocity.
    impacts : int
        Impacts, and touches of soft stops.
    collapses : int
        How often a stick, or an impact without rebound, has made neighbours one.
    grazings : int
        Events without a derivative, whose saltation is left out.
    final : tuple of float
        Displacement, velocity and phase of the forcing at the end, as of `Motion`.
    status : str
        As of `simulate`.
    """

    matrix: np.ndarray
    scaled: np.ndarray
    log_scale: float
    log_determinant: float
    impacts: int
    collapses: int
    grazings: int
    final: tuple[float, float, float]
    status: str

    @property
    def multipliers(self) -> np.ndarray:
        """Eigenvalues, shape (2,), the greater in modulus first.

        Of a periodic orbit, its Floquet multipliers over the span. The smaller one keeps its digits
        however small it is.
        """
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


def tangent_map(oscillator: Oscillator, **options: Any) -> TangentMap:
    """The derivative of a motion's end by its start, in closed form where the motion is linear.

    Between events the tangent flow is the homogeneous flow of the mode; at impacts, touches, where
    contact ends, where friction turns, holds or lets go, it jumps by the saltation matrix
    [Muller1995]_, with the acceleration of a moving base in it. Hertz stops and a force of the
    user's are stepped, with the variational equation beside them.

    Parameters
    ----------
    oscillator : Oscillator
        What moves.
    **options
        `periods` or `duration`, `initial`, `phase`, `method`, `chatter` as for `simulate`.

    Returns
    -------
    TangentMap

    Raises
    ------
    InvalidInput
        As `simulate` does.

    Examples
    --------
    >>> beam = scenes.karpodinis(22.1)
    >>> motion = simulate(beam, periods=1, transient=2000)
    >>> tangent_map(beam, periods=1, initial=motion.final[:2]).multipliers
    """
    from ._columns import DETERMINANT, FIRST, IMPACTS, LINES, POINTS, SINGULAR

    follower = Follower(oscillator, False, **options)
    run, omega = follower.run, follower.omega
    status, _, _ = follower.to(run.length)
    motion = run.motion(run.length, keep=False)
    totals = follower.totals
    unit = np.array([[1, 1 / omega], [omega, 1]])
    # A column that begins without motion is no direction of the start's: stops carry none of it.
    scaled = unit * follower.columns
    with np.errstate(over="ignore", under="ignore"):
        matrix = scaled * np.exp(totals[FIRST])
    return TangentMap(
        matrix=matrix,
        scaled=scaled,
        log_scale=float(totals[FIRST]),
        log_determinant=float(totals[DETERMINANT]),
        impacts=int(totals[IMPACTS]),
        collapses=int(totals[LINES] + totals[POINTS]),
        grazings=int(totals[SINGULAR]),
        final=motion.final,
        status=status,
    )
