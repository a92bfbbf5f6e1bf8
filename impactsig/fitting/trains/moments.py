"""Moments over the words of a train, by which measured and simulated trains are compared.

With w the words of the intervals' classes, phi_k the phase of an impact and s_k its strength by the
mean of all,

    P(w),  E[1_w (phi_k - m_w)],  E[1_w (s_k - m_w)],  E[1_c (phi_j - m_c) (phi_l - m_c)]

where m are the measured means, k is the middle impact of the word, and j, l are the two impacts of
an interval of class c: the intervals' distribution, their return map and the strengths beside it.
Known strengths determine better than a jittered phase where on the attractor an impact is. With b
the fifth of the strengths of its class in which the first impact of an interval lies,

    P(b, c),  E[1_bc (phi_k - m_bc)],  E[1_bc (phi_{k+1} - m_bc)],  E[1_bc (s_{k+1} - m_bc)]

are the map from one impact to the next. In addition there are the fractions of impacts in no word,
which depend on missed and spurious impacts, and the impacts per period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .partition import Partition, Sifted, Train

BINS = 5  # of the strengths in a class
FALSE = 3  # last moments, which depend on missed and spurious impacts


class Groups(NamedTuple):
    """Impacts in groups, with quantities of each member."""

    group: np.ndarray  # of each member, shape (members,)
    owner: np.ndarray  # number of the train of each
    values: np.ndarray  # shape (quantities, members)

    def means(self, number: int) -> np.ndarray:
        """Mean of every quantity in every group over all trains, shape (quantities, number)."""
        count = np.maximum(np.bincount(self.group, minlength=number), 1)
        totals = [np.bincount(self.group, one, minlength=number) for one in self.values]
        return np.array(totals) / count

    def moments(self, centre: np.ndarray, trains: int) -> np.ndarray:
        """Fraction of each group, and the mean deviation of its members from the centre, per train.

        Of each train, shape (trains, moments).
        """
        number = centre.shape[1]
        place, size = self.owner * number + self.group, trains * number
        off = (None, *(self.values - centre[:, self.group]))
        totals = [np.bincount(place, one, minlength=size).reshape(trains, number) for one in off]
        members = totals[0].sum(axis=1, keepdims=True)
        return np.hstack(totals) / np.maximum(members, 1)


class Moments(NamedTuple):
    """The moments of a train, defined once for measured and simulated trains."""

    partition: Partition
    words: np.ndarray  # measured means over each word, shape (1 or 2, words)
    edges: np.ndarray | None  # between fifths of the strengths, shape (classes, BINS - 1)
    steps: np.ndarray | None  # measured means over each fifth, shape (3, classes * BINS)
    centre: np.ndarray  # measured phases at both ends of an interval, shape (2, classes)

    @classmethod
    def of(cls, train: Train) -> Moments:
        """Choose the moments that suit one train, or several together."""
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
        """Number of leading moments that are shares of words."""
        return self.words.shape[1]

    def __call__(self, train: Train) -> np.ndarray:
        """The moments of each train, shape (trains, moments); NaN if it has no word."""
        sifted, trains = self.partition.sift(train), len(train.starts)
        words = _words(self.partition, sifted)
        parts = [words.moments(self.words, trains)]
        if self.edges is not None and self.steps is not None:
            parts.append(_steps(self.edges, sifted).moments(self.steps, trains))
        ends = _ends(sifted)
        first, second = ends.values - self.centre[:, ends.group]
        squares = ends._replace(values=np.array([first**2, first * second, second**2]))
        parts.append(squares.moments(np.zeros((3, self.centre.shape[1])), trains))
        parts.append(self._false(train, sifted))
        found = np.hstack(parts)
        found[np.bincount(words.owner, minlength=trains) == 0] = np.nan
        return found

    def _false(self, train: Train, sifted: Sifted) -> np.ndarray:
        """Fraction of impacts in no word, and impacts per period, of each train."""
        trains = len(train.starts)
        within = sifted.owner[1:] == sifted.owner[:-1]
        owner = sifted.owner[:-1]
        alone = np.bincount(owner[within & (sifted.symbol < 0)], minlength=trains)
        lone = alone / np.maximum(np.bincount(owner[within], minlength=trains), 1)
        counts = train.counts
        ends = np.append(train.x, 0.0)  # a train without impacts has neither
        span = ends[train.starts + counts - 1] - ends[train.starts]
        return np.column_stack((sifted.off, lone, counts / np.where(span > 0, span, np.inf)))


def _words(partition: Partition, sifted: Sifted) -> Groups:
    """The middle impact of every word."""
    words = partition.words(sifted)
    middle = words.first + partition.length // 2
    known = [sifted.phase] if sifted.strength is None else [sifted.phase, sifted.strength]
    return Groups(words.code, sifted.owner[middle], np.array([one[middle] for one in known]))


def _ends(sifted: Sifted) -> Groups:
    """Phases at both ends of every interval, by its class."""
    at = np.flatnonzero(sifted.symbol >= 0)
    both = np.array([sifted.phase[at], sifted.phase[at + 1]])
    return Groups(sifted.symbol[at], sifted.owner[at], both)


def _steps(edges: np.ndarray, sifted: Sifted) -> Groups:
    """Every interval by its class and the strength of its first impact."""
    assert sifted.strength is not None
    at = np.flatnonzero(sifted.symbol >= 0)
    symbol = sifted.symbol[at]
    fifth = np.sum(sifted.strength[at, None] > edges[symbol], axis=1)
    known = (sifted.phase[at], sifted.phase[at + 1], sifted.strength[at + 1])
    return Groups(symbol * BINS + fifth, sifted.owner[at], np.array(known))
