"""Ensembles: densities and moments of many paths, of which none is stored."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import Seed, limits, thread_count, whole
from .._running.threads import in_threads
from .._showing import Shown
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..studies.device import Executor, on_gpu
from ._arguments import Course, course
from ._counting import SLICES, Part, look_at_group, look_at_group_on_gpu
from .density import Density, JointDensity, moments, shares
from .paths.posing import potential
from .paths.running import LANES, Method, Mover, key_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LOOK = 8  # steps from one look to the next, unless the time between is given
PATHS_ON_GPU, CELLS_ON_GPU = 2**13, 2**25  # of a launch, at most
QUANTITIES = ("energy", "displacement", "velocity")


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Shown):
    """Statistics of many paths of an oscillator under noise.

    Times are in seconds, displacements, velocities and energies in the oscillator's own units.
    Every standard error is from the scatter between the paths, which are independent.

    Attributes
    ----------
    system : Oscillator
        The simulated system.
    method : str
        Integration method.
    step : float
        Step [s].
    paths : int
        Number of paths in the densities.
    transient, duration : float
        Lengths of the transient and of the sampled span of each path [s]: the requested ones, in
        multiples of `every`.
    every : float
        Sampling interval [s].
    energy, displacement, velocity : Density
        Marginal densities with their moments.
    joint : JointDensity
        Density over displacement and velocity.
    effective_size : float
        Number of independent samples with the same error of the mean energy: variance of the energy
        divided by that of its mean.
    correlation_time : float
        Integral of the autocorrelation function of the energy from 0 on [s], derived from the
        effective size.
    time, mean_energy, mean_energy_error : numpy.ndarray, shape (slices,)
        Mean energy over time after the transient, and its standard error.
    impact_rate, impact_rate_error : float
        Impacts per second, from the start on, and the standard error.
    drift : float
        Mean energy of the second half of the time minus that of the first, in standard errors.
        Above 3 or 4 the transient was too short for a stationary density.
    status : str
        "complete", or "diverged" if the state of some paths became infinite or invalid, for example
        because a law supplies energy. These paths are excluded.
    failed : int
        Number of these paths.

    See Also
    --------
    simulate_ensemble, averaged_density, results.NoisyMotion

    Examples
    --------
    >>> from impactsig import Noise, Oscillator, simulate_ensemble
    >>> shaken = Oscillator(damping=0.2, noise=Noise(0.1))
    >>> found = simulate_ensemble(shaken, paths=8, duration=100, transient=50, seed=1)
    >>> found.status, found.paths
    ('complete', 8)
    """

    system: Oscillator
    method: Method
    step: float
    paths: int
    transient: float
    duration: float
    every: float
    energy: Density
    displacement: Density
    velocity: Density
    joint: JointDensity
    effective_size: float
    correlation_time: float
    time: np.ndarray = field(repr=False)
    mean_energy: np.ndarray = field(repr=False)
    mean_energy_error: np.ndarray = field(repr=False)
    impact_rate: float
    impact_rate_error: float
    drift: float
    status: str
    failed: int

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the density of the energy with its band; see `impactsig.plot.density`."""
        return self.energy.plot(ax)

    def __repr__(self) -> str:
        mean = f"{self.energy.mean:.4g} +- {self.energy.mean_error:.1g}"
        unit = " s" if self.system.in_seconds else ""
        return (
            f"Ensemble({self.paths} paths of {self.duration:g}{unit}, {self.method}, step "
            f"{self.step:.3g}{unit}; mean energy {mean}, effective size {self.effective_size:.0f}; "
            f"{self.status})"
        )


def simulate_ensemble(
    oscillator: Oscillator,
    *,
    paths: int = 1000,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: Any = (0.0, 0.0),
    phase: float = 0.0,
    seed: Seed = None,
    method: Method = "splitting",
    step: float | None = None,
    every: float | None = None,
    bins: int = 128,
    energy_range: tuple[float, float] | None = None,
    displacement_range: tuple[float, float] | None = None,
    velocity_range: tuple[float, float] | None = None,
    executor: Executor = "threads",
    workers: int | None = None,
) -> Ensemble:
    """Simulate many paths of an oscillator under noise, and estimate densities and moments.

    The result for a seed is the same to the last bit for any number of threads: path k takes its
    noise from a counter-based generator with a key from the seed and k [SalmonEtAl2011]_.

    The energy is ``m v^2 / 2 + k x^2 / 2 - load x - integral of law(0, s, 0) ds from 0 to x``, with
    that of the springs of soft stops in contact.

    Parameters
    ----------
    oscillator : Oscillator
        The oscillator, with its noise.
    paths : int
        Number of paths, at least 2.
    periods, duration : float
        Length of the sampled span of each path, in forcing periods or in seconds. Give one of them.
    transient : float
        Length of the transient: in forcing periods with `periods`, in seconds with `duration`.
    initial : array_like, shape (2,) or (paths, 2)
        Displacement and velocity at t = 0, one for all or one each. A filtered force starts from
        its stationary distribution.
    phase : float
        Phase of the forcing at t = 0 [rad].
    seed : int, SeedSequence or Generator, optional
        Of the noise. The same seed gives the same result; a Generator is advanced.
    method : {"splitting", "runge-kutta", "zhuravlev", "gaussian"}
        "splitting" alternates flights with impacts, friction, and impulses by forces and noise;
        each part is exact, except for Heun's method for the impulses. It supports every oscillator.
        "runge-kutta" is the classical method with constant noise over a step, divided at the stop,
        where the noise is split by a Brownian bridge; "zhuravlev" is the same without division, in
        Zhuravlev's coordinate, for one rigid stop [Zhuravlev1976]_. Their measured weak orders with
        dissipative impacts are 1.8, 1.4 and 1.7. "gaussian" samples the exact transition of a
        linear oscillator with rigid stops under white noise, with bridges between the steps; its
        error is negligible.
    step : float, optional
        Time step [s]; by default a fifth of the fastest time scale of oscillation, damping,
        contacts, forcing, filter, and of the law along a few short paths.
    every : float, optional
        Sampling interval [s], by default 8 steps. With the forcing period the density is that of
        the stroboscopic section. Steps are shortened to fit.
    bins : int
        Cells of a marginal density, at least 8; half as many for each axis of the joint one.
    energy_range, displacement_range, velocity_range : (float, float), optional
        Ranges of the cells; by default those of a few short paths, with a margin.
    executor : {"threads", "gpu"}
        Where the paths are computed. A GPU (NVIDIA, with ``impactsig[gpu]``) supports the splitting
        method of oscillators without user-defined functions; its noise is the same, but its
        trigonometric functions may change the last bits of a path.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    Ensemble

    Raises
    ------
    InvalidInput
        If an argument is out of its range, the step is larger than the fastest time scale, the
        method does not support the oscillator, or there is no suitable GPU.
    MissingExtra
        If ``impactsig[gpu]`` is needed and not there.

    See Also
    --------
    simulate, averaged_density, plot.density

    Examples
    --------
    >>> from impactsig import Noise, Oscillator, simulate_ensemble
    >>> shaken = Oscillator(damping=0.2, noise=Noise(0.1))
    >>> found = simulate_ensemble(shaken, paths=100, duration=200, transient=50, seed=1)
    >>> abs(found.energy.mean - 0.1 / 0.2) < 4 * found.energy.mean_error
    True
    """
    paths, bins = whole("paths", paths, 2), whole("bins", bins, 8)
    gpu = on_gpu(executor, workers)
    threads = 1 if gpu else thread_count(workers)
    found = course(
        oscillator, paths, periods=periods, duration=duration, transient=transient,
        initial=initial, phase=phase, method=method, step=step, every=every, look=LOOK,
    )  # fmt: skip
    asked = (energy_range, displacement_range, velocity_range)
    edges = [
        _edges(f"{name}_range", given, known, bins)
        for name, given, known in zip(QUANTITIES, asked, found.survey.ranges, strict=True)
    ]
    look_at, together = look_at_group, LANES
    if gpu:
        _for_gpu(oscillator, method)
        together = max(1, min(PATHS_ON_GPU, CELLS_ON_GPU // (bins // 2) ** 2))
        look_at = look_at_group_on_gpu
    mover = Mover(oscillator, found.step, method, found.phase, key_of(seed))
    table = potential(oscillator, mover.functions.law, *edges[1][[0, -1]])

    def one(first: int) -> Part:
        return look_at(mover, found, table, edges, first, min(first + together, paths))

    parts = in_threads(one, range(0, paths, together), threads, " groups of paths")
    return _gather(oscillator, method, found, edges, parts)


def _edges(name: str, given: Any, known: tuple[float, float], bins: int) -> np.ndarray:
    """Edges of the cells."""
    if given is not None:
        known = limits(name, given, "two finite numbers, the first less than the second")
    return np.linspace(*known, bins + 1)


def _for_gpu(oscillator: Oscillator, method: Method) -> None:
    """Refuse what a GPU does not move.

    Raises
    ------
    InvalidInput
        If it is another method, or an oscillator with functions of the user's.
    """
    remedy = 'Else take executor="threads"'
    if method != "splitting":
        raise InvalidInput("method", method, '"splitting" for a GPU', remedy)
    functions = [("restitution", stop.law.function) for stop in oscillator.stops]
    for name, function in [("law", oscillator.law), *functions]:
        if function is not None:
            raise InvalidInput(name, function, "no function of the user's for a GPU", remedy)


def _gather(
    oscillator: Oscillator,
    method: Method,
    found: Course,
    edges: list[np.ndarray],
    parts: list[Part],
) -> Ensemble:
    """Combine the counts of all groups, in their order."""
    unit, looks = oscillator.time_unit, found.looks
    sums = np.concatenate([part.sums for part in parts]) / looks
    courses = np.concatenate([part.course for part in parts])
    impacts = np.concatenate([part.impacts for part in parts])
    paths = len(sums)
    if paths < 2:
        raise InvalidInput(
            "oscillator", repr(oscillator), "a motion that stays finite",
            f"Of {len(found.q)} paths {len(found.q) - paths} came to no finite state",
        )  # fmt: skip
    counts = [np.sum([part.counts[k] for part in parts], axis=0) for k in range(4)]
    squares = [np.sum([part.squares[k] for part in parts], axis=0) for k in range(4)]
    marginals = [
        _marginal(name, edges[k], counts[k], squares[k], looks, sums[:, 2 * k], sums[:, 2 * k + 1])
        for k, name in enumerate(QUANTITIES)
    ]
    half = len(counts[3])
    x_edges, v_edges = (np.linspace(each[0], each[-1], half + 1) for each in edges[1:])
    area = (x_edges[1] - x_edges[0]) * (v_edges[1] - v_edges[0])
    share, error = shares(counts[3].T, squares[3].T, looks, paths)
    joint = JointDensity(x_edges, v_edges, share / area, error / area, float(1 - share.sum()))

    energy = marginals[0]
    every = found.every * found.step * unit
    span, transient = looks * every, found.before * found.step * unit
    effective = (energy.sd / energy.mean_error) ** 2 if energy.mean_error > 0 else math.nan
    per_slice = np.bincount(np.arange(looks) * SLICES // looks, minlength=SLICES)
    met = per_slice > 0
    courses = courses[:, met] / per_slice[met]
    middle = courses.shape[1] // 2
    change = courses[:, middle:].mean(axis=1) - courses[:, :middle].mean(axis=1) if middle else None
    rate = impacts / (span + transient)
    return Ensemble(
        system=oscillator,
        method=method,
        step=found.step * unit,
        paths=paths,
        transient=transient,
        duration=span,
        every=every,
        energy=energy,
        displacement=marginals[1],
        velocity=marginals[2],
        joint=joint,
        effective_size=effective,
        correlation_time=paths * span / (2 * effective),
        time=transient + (np.flatnonzero(met) + 0.5) * span / SLICES,
        mean_energy=courses.mean(axis=0),
        mean_energy_error=courses.std(axis=0, ddof=1) / math.sqrt(paths),
        impact_rate=float(rate.mean()),
        impact_rate_error=float(rate.std(ddof=1) / math.sqrt(paths)),
        drift=_in_errors(change),
        status="complete" if paths == len(found.q) else "diverged",
        failed=len(found.q) - paths,
    )


def _in_errors(change: np.ndarray | None) -> float:
    """Mean of independent values in units of its standard error; 0 if undefined."""
    if change is None:
        return 0.0
    error = float(change.std(ddof=1)) / math.sqrt(len(change))
    return float(change.mean()) / error if error > 0 else 0.0


def _marginal(
    name: str,
    edges: np.ndarray,
    counts: np.ndarray,
    squares: np.ndarray,
    looks: int,
    one: np.ndarray,
    two: np.ndarray,
) -> Density:
    from scipy.special import stdtrit

    share, error = shares(counts, squares, looks, len(one))
    width = edges[1] - edges[0]
    reach = float(stdtrit(len(one) - 1, 0.975)) * error
    mean, sd, mean_error, sd_error = moments(one, two)
    return Density(
        quantity=name,
        edges=edges,
        density=share / width,
        standard_error=error / width,
        low=np.maximum(share - reach, 0.0) / width,
        high=(share + reach) / width,
        outside=float(1 - counts.sum() / (looks * len(one))),
        mean=mean,
        sd=sd,
        mean_error=mean_error,
        sd_error=sd_error,
    )
