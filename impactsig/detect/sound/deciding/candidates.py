"""Candidate impacts of a passage of sound, with their log-odds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

HOPELESS = -4.0  # log-odds that are worked out no further


class Candidates(NamedTuple):
    """Candidate impacts of a passage in order of time."""

    frame: np.ndarray  # of the octaves
    coarse: np.ndarray  # bool: from narrow bands alone, and so only known to some 10 ms
    spread: np.ndarray  # standard deviation of the instant as given by the frame [s]
    odds: np.ndarray  # logarithm of those of an impact
    pulse: np.ndarray  # bool: no impact because it is one of many, as pulses of a voice
    crowded: np.ndarray  # bool: none because many come as densely, though little lies in between
    by_octaves: np.ndarray  # evidence
    narrow: np.ndarray  # bool: likelier by narrow bands or a single octave than by all octaves
    beyond_tails: np.ndarray  # share of C that exceeds the tails of earlier crests

    @property
    def probability(self) -> np.ndarray:
        """Probability that each is an impact."""
        likely: np.ndarray = 1.0 / (1.0 + np.exp(-np.maximum(self.odds, -50.0)))
        return likely


def with_others(
    found: Candidates, frame: np.ndarray, spread: np.ndarray, odds: np.ndarray
) -> Candidates:
    """Add candidates, in ascending order, to which rules for pulses and crowds do not apply."""
    order = np.argsort(np.concatenate((frame, found.frame)), kind="stable")
    no, none = np.zeros(len(frame), bool), np.zeros(len(frame))
    new = Candidates(frame, no, spread, odds, no, no, none, ~no, none + 1.0)
    pairs = zip(new, found, strict=True)
    return Candidates(*(np.concatenate(pair)[order] for pair in pairs))
