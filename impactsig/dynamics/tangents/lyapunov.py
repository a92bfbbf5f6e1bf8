"""Lyapunov spectrum of an oscillator or a flow, from its equations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, overload

import numpy as np

from ..._arguments import Seed, number, one_of_them, refuse, unless
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.batch import OscillatorBatch
from ...oscillators.flows import Flow
from ...simulation import FixedStep, RungeKutta, simulate
from ...simulation.flows.course import Running
from ...simulation.simulation import CHATTER
from ...studies.device import Executor, on_gpu
from ..arguments import instead_of
from ._follow import Follower
from .batches.spectra import LyapunovSpectra, spectra_of
from .growth import BATCHES, edges_of, growth_of, lost_of, measured, steps_of
from .tangent import SYSTEMS, differentiated_by

TURN = 2 * math.pi
GONE = 1e-13  # share of the greatest growth below which a direction of a collapse has vanished
STEPS = 50_000  # of a flow, in a call of a kernel, so that a run can be interrupted


@dataclass(frozen=True, eq=False, repr=False)
class LyapunovSpectrum(Shown):
    """The Lyapunov exponents of a motion, with the evidence for them.

    An oscillator has two, those of its stroboscopic map; the third, along the phase of the forcing,
    is 0 and omitted. A cantilever has two per mode, a flow one per coordinate.

    Attributes
    ----------
    system : Oscillator, Cantilever, Flow or Controlled
        The simulated system.
    exponents : ndarray, shape (d,)
        Exponents in descending order, per unit of time of the system; `per_second` has them in SI
        units. -inf for a direction that collapses by sticking or an impact without rebound.
    error : ndarray, shape (d,)
        Standard error of `between_collapses`, by batch means.
    between_collapses : ndarray, shape (d,)
        Mean growth rates of deviations that are restarted after each collapse; equal to the
        exponents if there is no collapse.
    expected_sum : float
        Sum of the exponents from the mean divergence and the determinants of the saltation
        matrices, computed separately as a check. NaN for a Hertz stop whose loss depends on the
        approach velocity.
    time : ndarray, shape (n,)
        Time since the transient, in the unit of the system.
    curve : ndarray, shape (n, d)
        `between_collapses` up to that time.
    collapses : int
        Number of collapses of deviations: of all, when the mass sticks to a rigid stop (as after
        chatter), or of one direction, when it sticks under friction or an impact has no rebound.
    collapse_time : ndarray, shape (k,)
        Times of the first 10 000 collapses since the start, in the unit of the system.
    collapse_dimensions : ndarray of int, shape (k,)
        Number of dimensions that remain after each collapse, 0 or 1.
    impacts : int
        Impacts, and touches of soft stops.
    grazings : int
        Number of grazing events, which have no derivative; their saltation is omitted.
    status : str
        "complete"; else why the motion ended early, see `simulate`.

    See Also
    --------
    lyapunov_spectrum, results.LyapunovExponent, plot.lyapunov_convergence

    Examples
    --------
    >>> from impactsig import Force, Oscillator, lyapunov_spectrum
    >>> found = lyapunov_spectrum(Oscillator(damping=0.2, forces=(Force(1.0, 0.9),)), periods=200)
    >>> float(found.exponents.sum().round(6))  # minus the damping
    -0.2
    """

    system: Any
    exponents: np.ndarray
    error: np.ndarray
    between_collapses: np.ndarray
    expected_sum: float
    time: np.ndarray = field(repr=False)
    curve: np.ndarray = field(repr=False)
    collapses: int = 0
    collapse_time: np.ndarray = field(default_factory=lambda: np.empty(0))
    collapse_dimensions: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    impacts: int = 0
    grazings: int = 0
    status: str = "complete"

    @property
    def sum(self) -> float:
        """Sum of the exponents, per unit of time of the system; compare `expected_sum`."""
        return float(self.exponents.sum())

    @property
    def per_second(self) -> np.ndarray:
        """The exponents [1/s], shape (d,); of a flow, in its own unit of time."""
        return self.exponents / getattr(self.system, "time_unit", 1.0)

    @property
    def kaplan_yorke_dimension(self) -> float:
        """Kaplan-Yorke dimension of the attractor [KaplanYorke1979]_.

        ``j + (lambda_1 + ... + lambda_j) / |lambda_{j+1}|`` with the greatest j whose sum is not
        negative. Of an oscillator it is that of the stroboscopic section.
        """
        total = 0.0
        for j, exponent in enumerate(self.exponents):
            if total + exponent < 0:
                return j + total / abs(exponent)
            total += exponent
        return float(len(self.exponents))

    def describe(self) -> str:
        """Describe the result in words."""
        pairs = zip(self.between_collapses, self.error, strict=True)
        parts = [f"{value:.6g} ± {error:.2g}" for value, error in pairs if not math.isnan(value)]
        told = f"Lyapunov exponents {', '.join(parts)} per unit of time"
        if self.collapses:
            lost = int(np.isinf(self.exponents).sum())
            told = (
                f"{lost} of {len(self.exponents)} directions vanish, in {self.collapses} sticks or "
                f"impacts without rebound; between them: {told}"
            )
        return told + ("" if self.status == "complete" else f"; {self.status}")

    plot = drawn_by("lyapunov_convergence", "how they converge")


@overload
def lyapunov_spectrum(system: OscillatorBatch, **options: Any) -> LyapunovSpectra: ...
@overload
def lyapunov_spectrum(
    system: Oscillator | Cantilever | Flow, **options: Any
) -> LyapunovSpectrum: ...


def lyapunov_spectrum(  # type: ignore[misc]
    system: Any,
    *,
    periods: float | None = None,
    duration: float | None = None,
    transient: float | None = None,
    initial: Sequence[float] | None = None,
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    chatter: float = CHATTER,
    executor: Executor = "threads",
    seed: Seed = None,
) -> LyapunovSpectrum | LyapunovSpectra:
    """All Lyapunov exponents of a motion, from its variational equation.

    One deviation per dimension is propagated and orthonormalised after every event (every step of a
    flow); the exponents are the mean logarithms of their growth [Benettin1980]_. Between the events
    of a piecewise linear oscillator the tangent flow is known in closed form; at the events it is
    multiplied by the saltation matrix [Muller1995]_, see `tangent_map`. The exponents are therefore
    those of the motion up to rounding, with a statistical error due to its finite length. With
    Hertz stops, user-defined forces and flows, the variational equation is integrated in the steps
    of the motion. Derivatives of a user's function are central differences (to 1e-10), so it must
    be smooth.

    With noise the exponents are those of one path: neighbouring motions have the same noise. Under
    `OGY` the span consists of whole forcing periods, at the phase of its orbit.

    Parameters
    ----------
    system : Oscillator, OscillatorBatch, Cantilever, Flow or Controlled
        The system; a controlled one must be an oscillator under `OGY`.
    periods, duration : float
        Length of the span, in forcing periods, or in seconds (for a flow, in its unit of time).
        Give one of them.
    transient : float, optional
        Length of the transient, in the same unit; by default a tenth of the span. It also lets the
        deviations align with the growing directions.
    initial : sequence of float, optional
        State at t = 0, as for `simulate`.
    phase, method, chatter
        As for `simulate`. `FixedStep` has no tangent map.
    executor : {"threads", "gpu"}
        Where the oscillators of a batch are computed, as for `simulate_many`.
    seed : int, SeedSequence or Generator, optional
        Of the noise. The same seed gives the same result; a Generator is advanced.

    Returns
    -------
    LyapunovSpectrum, or LyapunovSpectra of a batch

    Raises
    ------
    InvalidInput
        If an argument is out of its range, or a path under noise has no derivative: at a rigid
        stop, at one whose loss depends on the approach velocity, and under friction.

    See Also
    --------
    lyapunov_exponent, tangent_map, plot.lyapunov_convergence

    Examples
    --------
    >>> from impactsig import Force, Oscillator, lyapunov_spectrum, scenes
    >>> free = Oscillator(damping=0.2, forces=(Force(1.0, 0.9),))
    >>> float(lyapunov_spectrum(free, periods=200).exponents.sum().round(6))  # minus the damping
    -0.2
    >>> chaotic = lyapunov_spectrum(scenes.karpodinis(20.3355), periods=1000)
    >>> bool(chaotic.exponents[0] > 0)
    True
    """
    gpu = on_gpu(executor, None)
    if gpu and not isinstance(system, OscillatorBatch):
        raise InvalidInput("system", system, "for a GPU, a batch of oscillators")
    if isinstance(system, Oscillator) and system.noise is not None:
        refuse("under noise", "", chatter=unless(CHATTER, chatter))
        run = {"initial": initial, "phase": phase, "method": method, "seed": seed}
        return _of_path(system, periods, duration, transient, run)
    refuse("where there is no noise", "", seed=seed)
    if isinstance(system, OscillatorBatch):
        refuse("for a batch, which moves exactly", "", method=method)
        return spectra_of(
            system, periods=periods, duration=duration, transient=transient, initial=initial,
            phase=phase, chatter=chatter, gpu=gpu,
        )  # fmt: skip
    if isinstance(system, Oscillator):
        options: dict[str, Any] = {
            "periods": periods, "duration": duration, "phase": phase,
            "method": method, "chatter": chatter,
        }  # fmt: skip
        if initial is not None:
            options["initial"] = initial
        return _of_oscillator(system, transient, options)
    if isinstance(system, Cantilever):
        refuse("for a Cantilever, which is computed exactly", "", method=method)
        options = {"periods": periods, "duration": duration, "phase": phase, "chatter": chatter}
        if initial is not None:
            options["initial"] = initial
        return _of_beam(system, transient, options)
    home = differentiated_by(system)
    if home is not None:
        options = {"initial": initial, "phase": phase, "method": method, "chatter": chatter}
        return home.spectrum_of(system, periods, duration, transient, **options)
    if not isinstance(system, Flow):
        raise InvalidInput("system", system, SYSTEMS, instead_of(system))
    refuse(
        "for a flow", "Give duration=", periods=periods, method=method,
        phase=unless(0.0, phase), chatter=unless(CHATTER, chatter),
    )  # fmt: skip
    length = number("duration", duration, above=0)
    before = number("transient", length / 10 if transient is None else transient, least=0.0)
    return _of_flow(system, length, before, initial)


def _of_oscillator(
    oscillator: Oscillator, before: float | None, options: dict[str, Any]
) -> LyapunovSpectrum:
    from .columns import DETERMINANT, IMPACTS, LINES, POINTS, SINGULAR, TOTALS

    follower = Follower(oscillator, True, **options)
    length = follower.run.length
    transient = number("transient", length / 10 if before is None else before, least=0.0)
    status = follower.to(transient)[0] if transient > 0 else "complete"
    follower.forget()
    totals = follower.totals
    start = follower.place[:2].copy()
    instants, taken = np.empty((0, 2)), np.empty((0, TOTALS))
    if status == "complete":
        edges = edges_of(transient, length)
        status, instants, taken = follower.to(edges[-1], edges)
        if status != "complete":  # what it came to is the last edge
            instants = np.vstack([instants, follower.place[:2]])
            taken = np.vstack([taken, totals])
    times, grown = measured(follower.omega, start, instants, taken)
    times, grown = times[times > 0], grown[times > 0]
    collapses = int(totals[LINES] + totals[POINTS])
    listed = follower.collapses[:collapses]
    divergence = float(totals[DETERMINANT]) / times[-1] if len(times) else math.nan
    return spectrum_from(
        oscillator,
        times,
        grown,
        int(lost_of(totals)),
        divergence,
        collapses=collapses,
        collapse_time=follower.seconds(listed[:, 0], listed[:, 1]) / oscillator.time_unit,
        collapse_dimensions=listed[:, 2].astype(int),
        impacts=int(totals[IMPACTS]),
        grazings=int(totals[SINGULAR]),
        status=status,
    )


def _of_path(
    oscillator: Oscillator, periods: Any, duration: Any, before: Any, run: dict[str, Any]
) -> LyapunovSpectrum:
    """The spectrum along one path of an oscillator under noise."""
    from ._noisy_tangent import orthonormal, tangent_steps

    whole, given = one_of_them(periods=periods, duration=duration)
    length = number(whole, given, above=0)
    transient = number("transient", length / 10 if before is None else before, least=0.0)
    path, matrices, divergence = tangent_steps(oscillator, **{whole: transient + length}, **run)
    first = round(len(matrices) * transient / (transient + length))
    columns, growth = np.eye(2), np.zeros((len(matrices), 2))
    for k, matrix in enumerate(matrices):
        columns, growth[k] = orthonormal(matrix @ columns)
    edges = steps_of(len(matrices) - first)
    grown = np.cumsum(growth[first:], axis=0)
    times = edges * path.step / oscillator.time_unit
    start = path.start + first * path.step
    return spectrum_from(
        oscillator,
        times,
        grown[edges - 1],
        0,
        float(divergence[first:].sum()) / times[-1] if len(times) else math.nan,
        impacts=len(path.impacts.between(start)),
        status=path.status,
    )


def _of_flow(
    flow: Flow, length: float, transient: float, initial: Sequence[float] | None
) -> LyapunovSpectrum:
    from ...simulation.basis.events import DIVERGED, DONE, STATUS
    from ._flow_tangent import carry

    running = Running(flow, None, initial)
    d = flow.dimension
    columns, growth = np.eye(d), np.zeros(d + 1)
    room = np.empty((d, d)), np.zeros(d), np.empty((13, d, d)), np.empty((d, d)), *np.empty((2, d))
    times, grown = [], []
    for edge in [transient, *edges_of(transient, length)]:
        on = partial(
            carry, running.tableau, running.field, running.scratch, running.course, edge, STEPS,
            columns, growth, *room,
        )  # fmt: skip
        status = running.until(edge, on)
        if status == DONE and not np.isfinite(growth).all():
            status = DIVERGED
        if status != DONE:
            break
        if edge == transient:
            growth[:] = 0.0
            continue
        times.append(running.time - transient)
        grown.append(growth[:d].copy())
    divergence = float(growth[d]) / times[-1] if times else math.nan
    return spectrum_from(
        flow,
        np.array(times),
        np.array(grown).reshape(-1, d),
        0,
        divergence,
        status=STATUS[status],
    )


def _of_beam(beam: Cantilever, before: float | None, options: dict[str, Any]) -> LyapunovSpectrum:
    from ._beam_tangent import steps

    whole, given = one_of_them(periods=options["periods"], duration=options["duration"])
    length = number(whole, given, above=0)
    transient = number("transient", length / 10 if before is None else before, least=0.0)
    motion = simulate(beam, **(options | {whole: transient + length}))
    unit = beam.forcing_period if whole == "periods" else 1.0
    assert unit is not None
    start = transient * unit
    edges = start + (motion.stop - start) * np.arange(BATCHES + 1) / BATCHES
    d = beam.dimension
    columns, grown, determinant = np.eye(d), np.zeros(d), 0.0
    taken, when, grazings, passed, lost = [], [], 0, 0, 0
    for n, step in steps(motion, edges if start < motion.stop else edges[:0]):
        columns, triangle = np.linalg.qr(step.matrix @ columns)
        sizes = np.abs(np.diag(triangle))
        gone = sizes < GONE * max(sizes.max(), 1e-300)
        if step.collapsed:  # displacement and velocity of the tip
            gone[np.argsort(sizes)[:2]] = True
        if n == 0:  # still before the span
            grown[:], determinant = 0.0, 0.0
        with np.errstate(divide="ignore"):
            grown += np.where(gone, 0.0, np.log(sizes))
            determinant += float(np.log(sizes).sum())
        if step.collapsed and n:
            lost = max(lost, int(gone.sum()))
            when.append((motion._phase, step.turns * TURN + step.phase))
        grazings += step.grazed and n > 0
        if n > passed:
            passed = n
            if n > 1:
                taken.append(grown.copy())
            else:
                grown[:], determinant = 0.0, 0.0
    grown_of = np.array(taken).reshape(-1, d)
    grown_of[:, d - lost :] = math.nan  # after each collapse they begin anew, from nothing
    reached = edges[1 : 1 + len(taken)] - start
    ended = np.array([(angle - phase) / motion._omega for phase, angle in when])
    return spectrum_from(
        beam,
        reached,
        grown_of,
        lost,
        determinant / reached[-1] if len(reached) else math.nan,
        collapses=len(when),
        collapse_time=ended,
        collapse_dimensions=np.full(len(when), d - lost),
        impacts=len(motion.impacts.between(start)),
        grazings=grazings,
        status=motion.status,
    )


def spectrum_from(
    system: Any,
    time: np.ndarray,
    grown: np.ndarray,
    lost: int,
    divergence: float,
    **rest: Any,
) -> LyapunovSpectrum:
    """The result, from the log growth of the columns at the ends of the batches."""
    found = growth_of(time, grown, lost)
    return LyapunovSpectrum(
        system, found.exponents, found.error, found.between, divergence, time, found.curve, **rest
    )
