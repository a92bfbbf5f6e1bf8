"""How much earlier than at their attacks sounds may have begun, by their low frequencies.

Attacks and shared modes are timed by what noise of rooms and hum leave: what is above some 800 Hz.
A membrane or a plate that is struck slowly begins below that, as much as 3 ms before the rest is
heard. Its low frequencies are those of triangular means, STEP apart, that room noise and hum are
predicted from, each by the ORDER ones before. How far before the attack their errors rise above
those of earlier ones has an evidence for each impact (`begun_before`), and the fraction of the
impacts that begin so early is that under which all are the most probable (empirical Bayes): where
hardly more rise than noise does, it is none. A filter that rings before a sound rings above these
frequencies, near half the rate, which a triangle of an even number of samples excludes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ._low_kernels import begun_before, low_before, prediction_sums

STEP = 0.25e-3  # [s], and time before the attack that is its own
BEFORE, NOISE, ORDER = 10, 24, 3  # steps in which sounds begin, that are noise, and that predict
POWERS = 2.0 ** np.arange(1, 8, 2)  # variance of what has begun over that of noise
LEAST = 8  # impacts that show it
ROUNDS = 25  # in which the fractions converge


@dataclass
class Beginnings:
    """Low frequencies before the attacks of a record."""

    rate: float
    step: int = field(init=False)  # [samples]
    found: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.step = 2 * max(round(0.5 * STEP * self.rate), 1)
        self.found.append(np.empty((0, BEFORE + NOISE + ORDER)))

    def add(self, x: np.ndarray, valid: tuple[int, int], attacks: np.ndarray) -> None:
        """Add the next attacks, halfway between two of the samples x, real from valid[0] on."""
        rows = np.empty((len(attacks), BEFORE + NOISE + ORDER))
        last = np.floor(attacks).astype(np.int64) - self.step
        low_before(x, last, valid[0], self.step, rows)
        self.found.append(rows)

    def spread(self, shift: np.ndarray, likely: np.ndarray) -> np.ndarray:
        """Error of each instant that comes of it [samples], about the median of the record.

        `shift` is what instants are later than their attacks; `likely` are the impacts that show
        how many begin early.
        """
        rows = np.concatenate(self.found)
        known = np.isfinite(rows.sum(axis=1))
        error = np.zeros(len(rows))
        if np.count_nonzero(known & likely) < LEAST:
            return error
        share = _shares(self._evidence(rows[known]), likely[known])
        if share is None:
            return error
        early = self.step * np.arange(BEFORE + 1.0)
        late = np.where(early > 0.0, np.maximum(shift[known, None] + early, 0.0), 0.0)
        order = np.argsort(late[likely[known]], axis=None)
        total = np.cumsum(share[likely[known]].ravel()[order])
        usual = late[likely[known]].ravel()[order][np.searchsorted(total, 0.5 * total[-1])]
        error[known] = np.sqrt(np.sum(share * (late - usual) ** 2, axis=1))
        return error

    def _evidence(self, rows: np.ndarray) -> np.ndarray:
        """Logarithm of the evidence of each number of early steps, from none on."""
        power = float(np.median(np.mean(rows[:, BEFORE:] ** 2, axis=1)))
        evidence = np.zeros((len(rows), BEFORE + 1))
        if power > 0.0:
            rows = rows / np.sqrt(power)
            sums = np.zeros((ORDER + 2, ORDER + 2))
            prediction_sums(rows, BEFORE, sums)
            sums += np.triu(sums, 1).T
            coefficients = np.linalg.lstsq(sums[1:, 1:], sums[1:, 0], rcond=None)[0]
            begun_before(rows, BEFORE, coefficients, POWERS, evidence[:, 1:])
        return evidence


def _shares(evidence: np.ndarray, likely: np.ndarray) -> np.ndarray | None:
    """Probability that each impact began so many steps early; None if none of them did.

    The fractions of the `likely` ones are those that maximise the probability of all. They count
    if its logarithm gains more than one for each of them (Akaike): one impact in a hundred whose
    noise rises by chance would otherwise make all others uncertain.
    """
    most = evidence.max(axis=1, keepdims=True)  # of none it is 0
    odds = np.exp(evidence - most)
    counted = odds[likely]
    none = np.all(np.mean(counted / counted[:, :1], axis=0) <= 1.0)
    if none or np.sum(most[likely]) <= BEFORE:
        return None  # no fraction of others gains as much
    fraction = np.full(odds.shape[1], 0.1 / (odds.shape[1] - 1))
    fraction[0] = 0.9
    for _ in range(ROUNDS):
        fraction *= np.mean(counted / (counted @ fraction)[:, None], axis=0)
    if np.sum(np.log(counted @ fraction / counted[:, 0])) <= BEFORE:
        return None
    share = fraction * odds
    return np.asarray(share / share.sum(axis=1, keepdims=True))
