"""Posterior probabilities of the kinds of motion, from a lock and its residuals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .locking import Lock
from .structure import Structure

KINDS = ("periodic", "drifting", "quasi-periodic", "banded", "chaotic", "irregular")


DRIFT_PRIOR = -3.0  # log-odds of a speed that changes, against a steady one
BAND_SAID = np.log(5)  # log-odds from which on a band is said to be there, not to be hidden


class Verdict(NamedTuple):
    """How probable each kind of motion is."""

    probability: dict[str, float]
    hidden: float  # part of "banded" in bands that the jitter hides

    @property
    def kind(self) -> str:
        """The most probable kind; bands count only if they are visible."""
        seen = {**self.probability, "banded": self.probability["banded"] - self.hidden}
        return max(seen, key=lambda kind: seen[kind])


def locked_verdict(lock: Lock, found: Structure, locked: float, chaos: float) -> Verdict:
    """Probabilities for a train with slots.

    The kinds of motion about slots share `locked`, the probability that there are slots, in the
    ratio of their evidence; a tone and a band come with any drift. The rest is chaotic or irregular
    by the odds given.
    """
    drift = lock.drift.log_odds + DRIFT_PRIOR
    recurs = float(np.logaddexp(0.0, drift))
    tone = found.tone.log_odds if found.tone is not None else -np.inf
    # two readings of the same prior: powers of any map, and the amplitude of one like the logistic
    band, like = found.band - np.log(2), np.log(found.hidden / 2)
    log = np.array([0.0, drift, recurs + tone, recurs + band + max(tone, 0.0), recurs + like])
    share = np.exp(log - log.max())
    share *= locked / share.sum()
    unseen = np.logaddexp(band, like) < BAND_SAID
    hidden = float(share[3] + share[4]) if unseen else 0.0
    chaotic = (1 - locked) * _logistic(chaos)
    values = (*share[:3], share[3] + share[4], chaotic, 1 - locked - chaotic)
    return Verdict(dict(zip(KINDS, map(float, values), strict=True)), hidden)


def unlocked_verdict(locked: float, chaos: float) -> Verdict:
    """Probabilities for a train without slots."""
    chaotic = (1 - locked) * _logistic(chaos)
    values = (locked, 0.0, 0.0, 0.0, chaotic, max(1 - locked - chaotic, 0.0))
    return Verdict(dict(zip(KINDS, map(float, values), strict=True)), 0.0)


def _logistic(log_odds: float) -> float:
    return float(1 / (1 + np.exp(-np.clip(log_odds, -700, 700))))
