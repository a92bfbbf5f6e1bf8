"""The drop of a body fitted to its bounces, at one law of the contact times.

With a restitution coefficient r the flight after bounce k lasts f r^k, and the contact of bounce k
lasts c r^(p k), as a stop whose force is a power of its depth has it: p is 0 for a linear spring
and -1/5 for Hertz's contact. Instants, and contact times where these are measured, are linear in
f, c and the first instant, so only r is sought step by step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Drop(NamedTuple):
    """What is measured of the bounces of one drop."""

    instants: np.ndarray  # at which contacts begin, or their middles
    errors: np.ndarray | None  # of these
    contacts: np.ndarray  # measured contact times, with errors
    contact_errors: np.ndarray | None  # their covariance; None where contacts are known or unseen
    with_contact: bool  # whether the first contact time is sought

    @property
    def left(self) -> int:
        """Degrees of freedom."""
        known = len(self.instants) + (0 if self.contact_errors is None else len(self.contacts))
        return known - 3 - self.with_contact

    def design(self, restitution: float, law: float) -> tuple[np.ndarray, np.ndarray]:
        """What instants and contacts are by first flight, first instant and first contact.

        Returns
        -------
        design, slope : ndarray, shape (n, 2) or (n, 3)
            And its derivative by the restitution coefficient.
        """
        number = np.arange(len(self.instants))
        flown, by_flown = _sums(restitution, 1.0, len(number))
        columns, slopes = [flown, np.ones(len(number))], [by_flown, np.zeros(len(number))]
        if not self.with_contact:
            return np.column_stack(columns), np.column_stack(slopes)
        lasted, by_lasted = _sums(restitution, law, len(number))
        contact = restitution ** (law * number)
        by_contact = law * number * contact / restitution
        if self.contact_errors is None:
            return np.column_stack((*columns, lasted)), np.column_stack((*slopes, by_lasted))
        # From middle to middle there is half of either contact.
        columns.append(lasted + (contact - 1) / 2)
        slopes.append(by_lasted + by_contact / 2)
        below = np.zeros((len(number), 2))
        return (
            np.vstack((np.column_stack(columns), np.column_stack((below, contact)))),
            np.vstack((np.column_stack(slopes), np.column_stack((below, by_contact)))),
        )

    def whitened(self, values: np.ndarray) -> np.ndarray:
        """Instants and contacts, or columns of them, in standard errors."""
        count = len(self.instants)
        scale = np.ones(count) if self.errors is None else self.errors
        times = (values[:count].T / scale).T
        if self.contact_errors is None:
            return times
        factor = np.linalg.cholesky(self.contact_errors)
        return np.concatenate((times, np.linalg.solve(factor, values[count:])))


class Fit(NamedTuple):
    """The drop at one law."""

    restitution: float
    contact: float  # of the first bounce; 0 where it is not sought
    squares: float  # of the residuals
    variance: float  # of the restitution coefficient
    law: float


def fit(drop: Drop, law: float, share: float) -> Fit:
    """Least squares, from a restitution coefficient to begin at."""
    from scipy.optimize import least_squares

    measured = drop.contacts[:0] if drop.contact_errors is None else drop.contacts
    observed = drop.whitened(np.concatenate((drop.instants - drop.instants[0], measured)))

    def linear(at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        design, slope = (drop.whitened(one) for one in drop.design(float(at[0]), law))
        size = np.linalg.norm(design, axis=0)
        return design, slope, np.linalg.lstsq(design / size, observed, rcond=None)[0] / size

    def residuals(at: np.ndarray) -> np.ndarray:
        design, _, own = linear(at)
        return observed - design @ own

    def slopes(at: np.ndarray) -> np.ndarray:  # Kaufman's, of the projected residuals
        design, slope, own = linear(at)
        basis = np.linalg.qr(design)[0]
        moved = slope @ own
        return -(moved - basis @ (basis.T @ moved))[:, None]

    begin = [min(max(share, 0.01), 0.999)]
    found = least_squares(
        residuals, begin, slopes, bounds=(1e-6, 1.0), ftol=1e-14, xtol=1e-14, gtol=1e-14
    )
    design, slope, own = linear(found.x)
    variance = _variance(np.column_stack((slope @ own, design)), 0)
    contact = float(own[2]) if drop.with_contact else 0.0
    return Fit(float(found.x[0]), contact, 2 * found.cost, variance, law)


def _sums(restitution: float, law: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Sums of r^(law k) over the bounces before each, and their derivatives by r."""
    power = restitution ** (law * np.arange(count - 1))
    slope = law * np.arange(count - 1) * power / restitution
    summed, by_ratio = (np.concatenate(([0.0], np.cumsum(one))) for one in (power, slope))
    return summed, by_ratio


def _variance(jacobian: np.ndarray, k: int) -> float:
    """Variance of parameter k by a fit, as large as rounding can tell where it is not determined.

    Of bounces that hardly get shorter, a longer contact is a longer flight, and the inverse of the
    normal matrix had negative entries.
    """
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, singular, directions = np.linalg.svd(jacobian / size, full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).eps * singular[0])
    return float(np.sum((directions[:, k] / singular) ** 2) / size[k] ** 2)
