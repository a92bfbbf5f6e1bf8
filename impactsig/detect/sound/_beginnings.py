"""How much earlier than at their attacks sounds may have begun, by their low frequencies.

Attacks and shared modes are timed by what noise of rooms and hum leave: what is above some 800 Hz.
A membrane or a plate that is struck slowly begins below that, as much as 3 ms before the rest is
heard. Its low frequencies are those of triangular means, STEP apart, that room noise and hum are
predicted from, each by the ORDER ones before. How far before the attack their errors rise above
those of earlier ones has an evidence for each impact (`begun_before`), and the fraction of the
impacts that begin so early is that under which all are the most probable (empirical Bayes): where
hardly more rise than noise does, it is none; so it is where LOOK of many gain nothing by any. A
filter that rings before a sound rings above these frequencies, near half the rate, which a triangle
of an even number of samples excludes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ._lane_kernels import median_energy
from ._low_kernels import begun_before, likeliest_fractions, low_before, predictors

STEP = 0.25e-3  # [s], and time before the attack that is its own
BEFORE, NOISE, ORDER = 10, 24, 3  # steps in which sounds begin, that are noise, and that predict
POWERS = 2.0 ** np.arange(1, 8, 2)  # variance of what has begun over that of noise
LEAST = 8  # impacts that show it
ROUNDS = 25  # in which the fractions converge
LOOK = 128  # impacts that are asked first


@dataclass
class Beginnings:
    """Low frequencies before the attacks of a record."""

    rate: float
    step: int = field(init=False)  # [samples]
    found: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.step = 2 * max(round(0.5 * STEP * self.rate), 1)
        self.found.append(np.empty((0, BEFORE + NOISE + ORDER)))

    def add(self, x: np.ndarray, attacks: np.ndarray) -> None:
        """Add the next attacks, halfway between two of the samples x."""
        rows = np.empty((len(attacks), BEFORE + NOISE + ORDER))
        last = np.floor(attacks).astype(np.int64) - self.step
        low_before(x, last, self.step, rows)
        self.found.append(rows)

    def spread(self, shift: np.ndarray, likely: np.ndarray) -> np.ndarray:
        """Error of each instant that comes of it [samples], about the median of the record.

        `shift` is what instants are later than their attacks; `likely` are the impacts that show
        how many begin early.
        """
        error = np.zeros(len(shift))
        if np.count_nonzero(likely) < LEAST:
            return error
        rows = np.concatenate(self.found)
        known = np.isfinite(rows[:, 0])
        which = np.flatnonzero(known & likely)
        if len(which) < LEAST:
            return error
        if len(which) > LOOK:
            some = rows[which[np.linspace(0, len(which) - 1, LOOK).astype(int)]]
            if _fractions(self._evidence(some), 0.0) is None:
                return error
        evidence, likely = self._evidence(rows[known]), likely[known]
        fraction = _fractions(evidence[likely], BEFORE)
        if fraction is None:
            return error
        share = fraction * _odds(evidence)
        share /= share.sum(axis=1, keepdims=True)
        early = self.step * np.arange(BEFORE + 1.0)
        late = np.where(early > 0.0, np.maximum(shift[known, None] + early, 0.0), 0.0)
        order = np.argsort(late[likely], axis=None)
        total = np.cumsum(share[likely].ravel()[order])
        usual = late[likely].ravel()[order][np.searchsorted(total, 0.5 * total[-1])]
        error[known] = np.sqrt(np.sum(share * (late - usual) ** 2, axis=1))
        return error

    def _evidence(self, rows: np.ndarray) -> np.ndarray:
        """Logarithm of the evidence of each number of early steps, from none on."""
        evidence, count = np.zeros((len(rows), BEFORE + 1)), rows.shape[1]
        power = median_energy(rows, BEFORE, count) / (count - BEFORE)
        if power > 0.0:
            rows = rows / np.sqrt(power)
            coefficients = np.empty(ORDER + 1)
            predictors(rows, BEFORE, coefficients)
            begun_before(rows, BEFORE, coefficients, POWERS, evidence[:, 1:])
        return evidence


def _odds(evidence: np.ndarray) -> np.ndarray:
    """Evidence over the greatest of each row."""
    return np.asarray(np.exp(evidence - evidence.max(axis=1, keepdims=True)))


def _fractions(evidence: np.ndarray, least: float) -> np.ndarray | None:
    """The fractions of impacts that begin so many steps early under which all are likeliest.

    They count if the logarithm of the probability gains more than `least`, one for each of them
    (Akaike): one impact in a hundred whose noise rises by chance would otherwise make all others
    uncertain. None if they do not.
    """
    fraction = np.full(evidence.shape[1], 0.1 / (evidence.shape[1] - 1))
    fraction[0] = 0.9
    gain = likeliest_fractions(evidence, least, ROUNDS, fraction)
    return fraction if gain > least else None
