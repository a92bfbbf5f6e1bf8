"""Probability densities of an ensemble: histograms with standard errors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .._showing import Shown, drawn_by


@dataclass(frozen=True, eq=False)
class Density(Shown):
    """The density of one quantity, with its moments.

    Attributes
    ----------
    quantity : str
        "energy", "displacement" or "velocity".
    edges : numpy.ndarray, shape (n + 1,)
        Of the cells.
    density : numpy.ndarray, shape (n,)
        Mean density in each cell. The integral over the cells is ``1 - outside``.
    standard_error : numpy.ndarray, shape (n,)
        Of the density, from the scatter between the paths.
    low, high : numpy.ndarray, shape (n,)
        95 % confidence band of the density, cell by cell (Student's t).
    outside : float
        Fraction of the samples beyond the edges.
    mean, sd : float
        Mean and standard deviation of all samples, in a cell or not.
    mean_error, sd_error : float
        Their standard errors.

    See Also
    --------
    simulate_ensemble, results.JointDensity, plot.density

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Noise, Oscillator, simulate_ensemble
    >>> shaken = Oscillator(damping=0.2, noise=Noise(0.1))
    >>> found = simulate_ensemble(shaken, paths=8, duration=100, transient=50, seed=1)
    >>> cells = np.diff(found.energy.edges)
    >>> round(float((found.energy.density * cells).sum()) + found.energy.outside, 6)
    1.0
    """

    quantity: str
    edges: np.ndarray = field(repr=False)
    density: np.ndarray = field(repr=False)
    standard_error: np.ndarray = field(repr=False)
    low: np.ndarray = field(repr=False)
    high: np.ndarray = field(repr=False)
    outside: float
    mean: float
    sd: float
    mean_error: float
    sd_error: float

    @property
    def centers(self) -> np.ndarray:
        """Centres of the cells, shape (n,)."""
        return (self.edges[1:] + self.edges[:-1]) / 2

    plot = drawn_by("density", "the density with its band")


@dataclass(frozen=True, eq=False)
class JointDensity(Shown):
    """The joint density of displacement and velocity.

    Attributes
    ----------
    x_edges, v_edges : numpy.ndarray, shapes (n + 1,) and (m + 1,)
        Of the cells.
    density : numpy.ndarray, shape (m, n)
        Mean density in each cell, velocity over displacement.
    standard_error : numpy.ndarray, shape (m, n)
        Of the density, from the scatter between the paths.
    outside : float
        Fraction of the samples beyond the edges.

    See Also
    --------
    simulate_ensemble, results.Density, plot.joint_density

    Examples
    --------
    >>> from impactsig import Noise, Oscillator, simulate_ensemble
    >>> shaken = Oscillator(damping=0.2, noise=Noise(0.1))
    >>> found = simulate_ensemble(shaken, paths=8, duration=100, transient=50, seed=1, bins=20)
    >>> found.joint.density.shape
    (10, 10)
    """

    x_edges: np.ndarray = field(repr=False)
    v_edges: np.ndarray = field(repr=False)
    density: np.ndarray = field(repr=False)
    standard_error: np.ndarray = field(repr=False)
    outside: float

    plot = drawn_by("joint_density", "the density as a map")


def shares(
    counts: np.ndarray, squares: np.ndarray, looks: int, paths: int
) -> tuple[np.ndarray, np.ndarray]:
    """Probability of each cell, and its standard error from the scatter between paths.

    Parameters
    ----------
    counts, squares : numpy.ndarray
        Sums over the paths of a cell's count, and of the square of it.
    looks, paths : int
        Looks at a path, and paths.
    """
    share = counts / (looks * paths)
    scatter = squares / looks**2 / paths - share**2
    return share, np.sqrt(np.maximum(scatter, 0.0) / (paths - 1))


def moments(one: np.ndarray, two: np.ndarray) -> tuple[float, float, float, float]:
    """Mean and standard deviation of a quantity, with standard errors.

    Parameters
    ----------
    one, two : numpy.ndarray, shape (paths,)
        Means over each path of the quantity and of its square.
    """
    paths = len(one)
    mean, square = float(one.mean()), float(two.mean())
    sd = float(np.sqrt(max(square - mean**2, 0.0)))
    mean_error = float(one.std(ddof=1) / np.sqrt(paths))
    # The variance is a function of both means: its error to first order in both.
    variance_error = float((two - 2 * mean * one).std(ddof=1) / np.sqrt(paths))
    sd_error = variance_error / (2 * sd) if sd > 0 else 0.0
    return mean, sd, mean_error, sd_error
