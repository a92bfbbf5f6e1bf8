"""Estimate parameters from moments, by regression over simulated trains.

Trains are simulated at parameters drawn from a normal cloud and measured as the real one was. Their
moments are regressed on the parameters (quadratic in those of the oscillator, linear in the
chain's), and the weighted least squares fit of the measured moments moves and reshapes the cloud,
until it is about as wide as the parameters are uncertain. At the end the moments are projected on
the directions that distinguish the parameters, one for each [Gourieroux1993]_, and fresh trains
show how the projections depend on the parameters and how they scatter. About the distribution of
the moments only this is assumed, that the projections are nearly normal [Wood2010]_.

Slopes have errors, and a sum of squared slopes is too large by these: a cloud would treat its own
noise as information, shrink, and have even more of it. Therefore the errors are subtracted, and the
last cloud is fresh.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .problem import Problem

CLOUD, LAST_CLOUD = 200, 300  # trains
ROUNDS = 8
NEAREST = 100  # trains of the search that shape the first cloud
WIDE = 1.5  # standard deviations of the parameters in one of the cloud
NARROWEST = 0.2  # of its width before, in one round
FEWEST = 2  # trains by the terms of a regression
OTHERWISE = 2.2  # times the median misfit: a train of another kind of motion
WIDEST = 3.0  # widths of the cloud: uncertainty of what the trains do not determine
REACH = 2.0  # standard deviations of the cloud that a solution may lie from its centre
EDGE, AGAIN = 0.95, 3  # share of this from where a cloud is moved, and how many there are


class Cloud(NamedTuple):
    """Parameters at which trains are simulated: ``psi = centre + shape z``, z standard normal."""

    centre: np.ndarray
    shape: np.ndarray  # lower triangular, so that the free parameters need their own z only
    curved: int  # parameters whose squares and products enter

    @classmethod
    def of(cls, centre: np.ndarray, covariance: np.ndarray, problem: Problem) -> Cloud:
        """The cloud of a covariance, not narrower than trains can resolve."""
        finest = np.array([problem.kind(name).finest for name in problem.names])
        return cls(centre, np.linalg.cholesky(covariance + np.diag(finest**2)), len(problem.free))

    @property
    def reach(self) -> float:
        """Distance of the farthest points from the centre, in z."""
        return float(np.sqrt(REACH**2 + len(self.centre)))

    def draw(
        self, count: int, problem: Problem, look: Callable[[np.ndarray], np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw parameters within the bounds, with the result of `look` for each."""
        low, high = problem.box
        z = problem.rng.standard_normal((4 * count, len(self.centre)))
        z = z[np.linalg.norm(z, axis=1) < self.reach][:count]
        psi = np.clip(self.centre + z @ self.shape.T, low, high)
        return psi, look(psi)

    def place(self, psi: np.ndarray) -> np.ndarray:
        """Convert parameters to z, shape (n, parameters)."""
        return np.linalg.solve(self.shape, (psi - self.centre).T).T

    def terms(self, z: np.ndarray) -> np.ndarray:
        """Regressors: 1, z, and products of the first components."""
        own = z[:, : self.curved]
        i, j = np.triu_indices(self.curved)
        return np.hstack((np.ones((len(z), 1)), z, own[:, i] * own[:, j]))


class Regression(NamedTuple):
    """Moments as a function of z, by least squares over trains of one kind."""

    cloud: Cloud
    coefficients: np.ndarray  # shape (terms, moments)
    covariance: np.ndarray  # of the moments of a train
    errors: np.ndarray  # covariance of the coefficients of a moment of variance 1
    trains: int

    @classmethod
    def of(cls, cloud: Cloud, psi: np.ndarray, y: np.ndarray) -> Regression | None:
        """Fit to trains, leaving out outliers such as periodic ones amid chaos.

        None if hardly more trains than terms have moments.
        """
        terms = cloud.terms(cloud.place(psi))
        whole = np.isfinite(y).all(1)
        if whole.sum() < FEWEST * terms.shape[1]:
            return None
        y = np.where(whole[:, None], y, 0.0)
        kept = whole
        for _ in range(8):
            coefficients = np.linalg.lstsq(terms[kept], y[kept], rcond=None)[0]
            off = y - terms @ coefficients
            scale = np.median(np.abs(off[kept]), axis=0)
            size = np.sqrt(np.mean((off / np.where(scale > 0, scale, np.inf)) ** 2, axis=1))
            near = whole & (size <= OTHERWISE * np.median(size[kept]))
            if near.sum() < FEWEST * terms.shape[1] or np.array_equal(near, kept):
                break
            kept = near
        off = off[kept]
        covariance = off.T @ off / max(len(off) - terms.shape[1], 1)
        errors = np.linalg.pinv(terms[kept].T @ terms[kept])
        return cls(cloud, coefficients, covariance, errors, len(off))

    @property
    def slopes(self) -> np.ndarray:
        """Mean derivatives over the cloud, shape (moments, parameters)."""
        return self.coefficients[1 : 1 + len(self.cloud.centre)].T

    @property
    def slope_errors(self) -> np.ndarray:
        """Covariance of the slopes, for a moment of variance 1."""
        return self.errors[1 : 1 + len(self.cloud.centre), 1 : 1 + len(self.cloud.centre)]

    def solve(self, white: np.ndarray, problem: Problem) -> np.ndarray:
        """The z at which the expected moments are closest to the measured ones."""
        from scipy.optimize import least_squares

        low, high = problem.box
        centre, shape = self.cloud.centre, self.cloud.shape
        finest = np.array([problem.kind(name).finest for name in problem.names])

        def off(z: np.ndarray) -> np.ndarray:
            psi = centre + shape @ z
            beyond = np.maximum(psi - high, 0) - np.maximum(low - psi, 0)
            expected = self.cloud.terms(z[None])[0] @ self.coefficients
            return np.concatenate((white @ expected, 100 * beyond / finest))

        found: np.ndarray = least_squares(off, np.zeros(len(centre)), bounds=(-REACH, REACH)).x
        return found


class Estimate(NamedTuple):
    """Parameters with their uncertainties."""

    psi: np.ndarray
    covariance: np.ndarray
    explained: float | None = None  # share of the legs that an orbit follows


def narrow(problem: Problem, psi: np.ndarray, y: np.ndarray) -> Estimate | None:
    """Estimate the parameters from the trains of a search and further ones.

    None where too few of the trains in a cloud have moments: the search has ended where the
    oscillator hardly reaches the stop.
    """
    distance = np.mean(np.nan_to_num(y, nan=1e3) ** 2, axis=1)
    nearest = np.argsort(distance)[:NEAREST]
    cloud = Cloud.of(psi[nearest].mean(0), np.cov(psi[nearest].T), problem)
    settled = False
    for _ in range(ROUNDS):
        # The last round decides on the directions, and is worth more trains.
        fresh = cloud.draw(2 * CLOUD if settled else CLOUD, problem, problem.look)
        psi, y = np.vstack((psi, fresh[0])), np.vstack((y, fresh[1]))
        inside = np.linalg.norm(cloud.place(psi), axis=1) < cloud.reach
        regression = Regression.of(cloud, psi[inside], y[inside])
        if regression is None:
            return None
        white = whitening(regression.covariance)
        z = regression.solve(white, problem)
        width, directions = _uncertainty(regression, white)
        project = (white @ regression.slopes).T @ white
        # Wider than it was only where the solution lies at its edge.
        most = 1.3 if np.abs(z).max() > EDGE * REACH else 1.0
        shape = cloud.shape @ directions * np.clip(WIDE * width, NARROWEST, most)
        centre = np.clip(cloud.centre + cloud.shape @ z, *problem.box)
        cloud = Cloud.of(centre, shape @ shape.T, problem)
        if settled:
            break
        settled = bool(np.all(width > 0.4) and np.abs(z).max() < 0.6 * REACH)
    psi, y = cloud.draw(LAST_CLOUD, problem, problem.look)
    regression = Regression.of(cloud, psi, y @ project.T)
    return None if regression is None else _estimate(problem, regression)


def beside(problem: Problem, centre: np.ndarray, covariance: np.ndarray) -> Estimate | None:
    """Refine an estimate from an orbit by simulated trains.

    The same estimate is made from trains simulated nearby: its bias is subtracted, and its scatter
    is that due to jitter, missed and spurious impacts. If strengths are known to a few per cent,
    moments add nothing. None if most of these trains have no orbit: then that of the measured one
    is not reliable either.
    """
    cloud = Cloud.of(centre, WIDE**2 * covariance, problem)._replace(curved=0)
    for _ in range(AGAIN):
        psi, y = cloud.draw(CLOUD, problem, problem.tell)
        if np.isfinite(y).all(1).sum() < CLOUD / 2:
            return None
        regression = Regression.of(cloud, psi, y)
        if regression is None:
            return None
        estimate = _estimate(problem, regression)
        if np.abs(cloud.place(estimate.psi)).max() < EDGE * REACH:
            break
        cloud = cloud._replace(centre=estimate.psi)
    return estimate


def _estimate(problem: Problem, regression: Regression) -> Estimate:
    """The parameters at which the expected moments equal the measured ones."""
    cloud = regression.cloud
    white = whitening(regression.covariance, 1e-10)
    z = regression.solve(white, problem)
    slopes = white @ regression.slopes
    information = slopes.T @ slopes - len(white) * regression.slope_errors
    size, directions = np.linalg.eigh(information)
    spread = cloud.shape @ directions / np.sqrt(np.maximum(size, WIDEST**-2))
    # The measured train scatters as its length has it, the regression as its trains do.
    scatter = problem.share + len(regression.coefficients) / regression.trains
    return Estimate(
        np.clip(cloud.centre + cloud.shape @ z, *problem.box), spread @ spread.T * scatter
    )


def whitening(covariance: np.ndarray, tolerance: float = 1e-3) -> np.ndarray:
    """Linear map to independent moments of unit variance, without nearly constant ones."""
    scale = np.sqrt(np.diag(covariance))
    scale = np.where(scale > 0, scale, np.inf)
    size, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    good = size > tolerance * size.max()
    matrix: np.ndarray = (vectors[:, good] / np.sqrt(size[good])).T / scale
    return matrix


def _uncertainty(regression: Regression, white: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations of z along its independent directions."""
    slopes = white @ regression.slopes
    freedom = regression.trains - len(regression.coefficients)
    # The inverse of an estimated covariance is too large by this [Wood2010]_.
    shrunk = max((freedom - len(white) - 1) / max(freedom, 1), 0.1)
    information = shrunk * (slopes.T @ slopes - len(white) * regression.slope_errors)
    size, directions = np.linalg.eigh(information)
    return 1 / np.sqrt(np.maximum(size, 1e-6)), directions
