"""What a measured train and simulated ones are compared by: moments over the words of the train.

With w the words of the intervals' classes, phi_k the phase of an impact and s_k its strength by the
mean of all,

    P(w),  E[1_w (phi - m_w)],  E[1_w (s - n_w)],  E[1_c a b]

where m_w and n_w are the measured means and a, b run over phi_k, phi_{k+1}, s_k, s_{k+1} about
their means over the intervals of class c: the intervals' distribution, their return map and the
strengths beside it. To these come the shares of what is in no word, which tell of missed and of
spurious impacts, and the impacts per period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._partition import Partition, Sifted, Train


class Moments(NamedTuple):
    """What is asked of a train; the same of a measured one and of simulated ones."""

    partition: Partition
    phase: np.ndarray  # measured mean of the middle impact of each word, shape (words,)
    strength: np.ndarray | None  # likewise
    centre: np.ndarray  # measured means over the intervals of each class, shape (classes, 2 or 4)

    @classmethod
    def of(cls, train: Train) -> Moments:
        """Those that suit a train."""
        partition = Partition.of(train)
        sifted = partition.sift(train)
        words = partition.words(sifted)
        number = len(partition.classes) ** partition.length
        count = np.maximum(np.bincount(words.code, minlength=number), 1)
        middle = words.first + partition.length // 2

        def mean(values: np.ndarray) -> np.ndarray:
            return np.bincount(words.code, values[middle], minlength=number) / count

        pairs = _pairs(sifted)
        centre = [
            pairs[:, sifted.symbol == symbol].mean(1) for symbol in range(len(partition.classes))
        ]
        strength = None if sifted.strength is None else mean(sifted.strength)
        return cls(partition, mean(sifted.phase), strength, np.array(centre))

    def __call__(self, train: Train) -> np.ndarray | None:
        """The moments of a train; None where it has no word."""
        sifted = self.partition.sift(train)
        words = self.partition.words(sifted)
        if not len(words.code):
            return None
        number, count = len(self.phase), len(words.code)
        middle = words.first + self.partition.length // 2

        def total(values: np.ndarray) -> np.ndarray:
            return np.bincount(words.code, values, minlength=number) / count

        parts = [total(np.ones(count)), total(sifted.phase[middle] - self.phase[words.code])]
        if self.strength is not None and sifted.strength is not None:
            parts.append(total(sifted.strength[middle] - self.strength[words.code]))
        pairs = _pairs(sifted)
        upper = np.triu_indices(len(pairs))
        for symbol, centre in enumerate(self.centre):
            own = pairs[:, sifted.symbol == symbol] - centre[:, None]
            parts.append((own @ own.T)[upper] / len(sifted.symbol))
        lone = float(np.mean(sifted.symbol < 0))
        span = train.x[-1] - train.x[0]
        parts.append(np.array([sifted.off, lone, len(train.x) / span]))
        return np.concatenate(parts)


def _pairs(sifted: Sifted) -> np.ndarray:
    """Phases, and strengths, at both ends of every interval, shape (2 or 4, n - 1)."""
    known = [sifted.phase] if sifted.strength is None else [sifted.phase, sifted.strength]
    return np.array([side for one in known for side in (one[:-1], one[1:])])
