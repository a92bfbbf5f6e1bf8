"""What a measured train and simulated ones are compared by: moments over the words of the train.

With w the words of the intervals' classes, phi_k the phase of an impact and s_k its strength by the
mean of all,

    P(w),  E[1_w (phi_k - m_w)],  E[1_w (s_k - m_w)],  E[1_c (phi_j - m_c) (phi_l - m_c)]

where m are the measured means, k is the middle impact of the word, and j, l are the two impacts of
an interval of class c: the intervals' distribution, their return map and the strengths beside it.
Where strengths are known they tell better than a jittered phase where on the attractor an impact
is. With b the fifth of the strengths of its class in which the first impact of an interval lies,

    P(b, c),  E[1_bc (phi_k - m_bc)],  E[1_bc (phi_{k+1} - m_bc)],  E[1_bc (s_{k+1} - m_bc)]

are the map from one impact to the next. To all these come the shares of what is in no word, which
tell of missed and of spurious impacts, and the impacts per period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._partition import Partition, Sifted, Train

BINS = 5  # of the strengths in a class
FALSE = 3  # last moments, which tell of missed and of spurious impacts


class Groups(NamedTuple):
    """Impacts in groups, and what is asked of the members of each."""

    group: np.ndarray  # of each member, shape (members,)
    values: np.ndarray  # shape (quantities, members)

    def means(self, number: int) -> np.ndarray:
        """Of every quantity in every group, shape (quantities, number)."""
        count = np.maximum(np.bincount(self.group, minlength=number), 1)
        return self._totals(self.values, number) / count

    def moments(self, centre: np.ndarray) -> np.ndarray:
        """Share of each group, and mean over all of what its members are off the centre."""
        off = np.vstack((np.ones(len(self.group)), self.values - centre[:, self.group]))
        return self._totals(off, centre.shape[1]).ravel() / max(len(self.group), 1)

    def _totals(self, values: np.ndarray, number: int) -> np.ndarray:
        return np.array([np.bincount(self.group, one, minlength=number) for one in values])


class Moments(NamedTuple):
    """What is asked of a train; the same of a measured one and of simulated ones."""

    partition: Partition
    words: np.ndarray  # measured means over each word, shape (1 or 2, words)
    edges: np.ndarray | None  # between fifths of the strengths, shape (classes, BINS - 1)
    steps: np.ndarray | None  # measured means over each fifth, shape (3, classes * BINS)
    centre: np.ndarray  # measured phases at both ends of an interval, shape (2, classes)

    @classmethod
    def of(cls, train: Train) -> Moments:
        """Those that suit a train."""
        partition = Partition.of(train)
        sifted = partition.sift(train)
        number = len(partition.classes)
        words = _words(partition, sifted).means(number**partition.length)
        edges = steps = None
        if sifted.strength is not None:
            share = np.arange(1, BINS) / BINS
            first = sifted.strength[:-1]
            edges = np.array(
                [np.quantile(first[sifted.symbol == symbol], share) for symbol in range(number)]
            )
            steps = _steps(edges, sifted).means(number * BINS)
        return cls(partition, words, edges, steps, _ends(sifted).means(number))

    @property
    def shares(self) -> int:
        """How many of the first moments are shares of words."""
        return self.words.shape[1]

    def __call__(self, train: Train) -> np.ndarray | None:
        """The moments of a train; None where it has no word."""
        sifted = self.partition.sift(train)
        words = _words(self.partition, sifted)
        if not len(words.group):
            return None
        parts = [words.moments(self.words)]
        if self.edges is not None and self.steps is not None:
            parts.append(_steps(self.edges, sifted).moments(self.steps))
        ends = _ends(sifted)
        first, second = ends.values - self.centre[:, ends.group]
        squares = Groups(ends.group, np.array([first**2, first * second, second**2]))
        parts.append(squares.moments(np.zeros((3, self.centre.shape[1]))))
        lone = float(np.mean(sifted.symbol < 0))
        span = train.x[-1] - train.x[0]
        parts.append(np.array([sifted.off, lone, len(train.x) / span]))
        return np.concatenate(parts)


def _words(partition: Partition, sifted: Sifted) -> Groups:
    """The middle impact of every word."""
    words = partition.words(sifted)
    middle = words.first + partition.length // 2
    known = [sifted.phase] if sifted.strength is None else [sifted.phase, sifted.strength]
    return Groups(words.code, np.array([one[middle] for one in known]))


def _ends(sifted: Sifted) -> Groups:
    """The phases at both ends of every interval, by its class."""
    at = np.flatnonzero(sifted.symbol >= 0)
    return Groups(sifted.symbol[at], np.array([sifted.phase[at], sifted.phase[at + 1]]))


def _steps(edges: np.ndarray, sifted: Sifted) -> Groups:
    """Every interval by its class and how strong its first impact is."""
    assert sifted.strength is not None
    at = np.flatnonzero(sifted.symbol >= 0)
    symbol = sifted.symbol[at]
    fifth = np.sum(sifted.strength[at, None] > edges[symbol], axis=1)
    known = (sifted.phase[at], sifted.phase[at + 1], sifted.strength[at + 1])
    return Groups(symbol * BINS + fifth, np.array(known))
