"""A train as words: sequences of interval classes at the frequent phases.

The impacts of chaos come at few phases of the forcing, and their intervals gather in classes, say
about one period and about two. Jitter moves every instant, but no interval into another class: the
sequence of classes, cut into words, is what the measuring chain leaves of the orbit, and the mean
over all impacts with the same words around them is free of jitter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

PHASES = 64  # bins of a turn
THIN = 0.02  # of the fullest bin: phases that are rarer only false impacts come at
STEP = 0.05  # of a forcing period: the bins in which classes of intervals are separated
RARE = 0.03  # fraction of the intervals in a separate class
MOST_CLASSES, MOST_WORDS = 5, 27  # so that a word has two intervals or more
LONGEST = 4  # intervals in a word


class Train(NamedTuple):
    """Instants in forcing periods, strengths, and flights that are not joined.

    Of one train, or of several, one after another and not joined.
    """

    x: np.ndarray  # shape (n,)
    strength: np.ndarray | None  # shape (n,)
    joined: np.ndarray  # shape (n - 1,): whether no gap lies in the interval that follows
    starts: np.ndarray = np.zeros(1, np.intp)  # index of the first impact of each train

    @property
    def counts(self) -> np.ndarray:
        """Number of impacts of each train."""
        return np.diff(self.starts, append=len(self.x))

    @property
    def owner(self) -> np.ndarray:
        """Index of the train that each impact belongs to."""
        return np.repeat(np.arange(len(self.starts)), self.counts)

    def split(self) -> list[Train]:
        """The trains one by one."""
        found = []
        for first, count in zip(self.starts, self.counts, strict=True):
            own, after = slice(first, first + count), slice(first, max(first + count - 1, first))
            strength = None if self.strength is None else self.strength[own]
            found.append(Train(self.x[own], strength, self.joined[after]))
        return found


class Sifted(NamedTuple):
    """The impacts of trains at the frequent phases."""

    cycle: np.ndarray  # whole periods, shape (n,)
    phase: np.ndarray  # from the mean phase of the train, in periods, -0.5 to 0.5
    strength: np.ndarray | None  # by their mean in the train
    symbol: np.ndarray  # class of the interval that follows; -1 for none, shape (n - 1,)
    joined: np.ndarray  # whether no gap lies in that interval
    owner: np.ndarray  # number of the train, shape (n,)
    off: np.ndarray  # share of the impacts at other phases, shape (trains,)


class Words(NamedTuple):
    """The words of a train, in the order of time."""

    code: np.ndarray  # shape (w,), 0 to classes**length - 1
    first: np.ndarray  # index of the first impact of each


class Partition(NamedTuple):
    """The frequent phases, and the classes of intervals."""

    window: np.ndarray  # whether each bin of the phase counts, shape (PHASES,)
    classes: np.ndarray  # least and greatest interval of each, in periods, shape (c, 2)
    length: int  # of a word, in intervals

    @classmethod
    def of(cls, train: Train) -> Partition:
        """Choose the partition that suits one train, or several together."""
        phase = train.x - mean_phases(train)[train.owner]
        counts = np.bincount(_bins(phase), minlength=PHASES)
        window = counts > max(3.0, THIN * counts.max())
        # What jitter carries beyond the edge belongs to the same cluster.
        window |= np.roll(window, 1) | np.roll(window, -1)
        whole = cls(window, np.array([[0.0, np.inf]]), 1)
        sifted = whole.sift(train)
        interval = np.diff(sifted.cycle + sifted.phase)[sifted.symbol >= 0]
        classes = _classes(interval)
        length = 1
        while length < LONGEST and len(classes) ** (length + 1) <= MOST_WORDS:
            length += 1
        return cls(window, classes, length)

    def sift(self, train: Train) -> Sifted:
        """Remove impacts at other phases, and classify the intervals."""
        owner, number = train.owner, len(train.starts)
        x = train.x - mean_phases(train)[owner]
        kept = self.window[_bins(x)]
        stretch = np.concatenate(([0], np.cumsum(~train.joined)))[: len(x)][kept]
        x, owner = x[kept], owner[kept]
        cycle = np.rint(x)
        interval = np.diff(x)
        symbol = np.full(len(interval), -1)
        for name, (low, high) in enumerate(self.classes):
            symbol[(interval > low) & (interval <= high)] = name
        joined = np.diff(stretch) == 0
        symbol[~joined] = -1
        strength = None
        left = np.bincount(owner, minlength=number)
        if train.strength is not None:
            total = np.bincount(owner, train.strength[kept], minlength=number)
            strength = train.strength[kept] / np.maximum(total / np.maximum(left, 1), 1e-300)[owner]
        off = 1 - left / np.maximum(train.counts, 1)
        return Sifted(cycle, x - cycle, strength, symbol, joined, owner, off)

    def words(self, sifted: Sifted) -> Words:
        """All sequences of `length` classified intervals."""
        count = max(len(sifted.symbol) - self.length + 1, 0)
        code, whole = np.zeros(count, np.intp), np.ones(count, bool)
        for k in range(self.length):
            symbol = sifted.symbol[k : k + count]
            whole &= symbol >= 0
            code = code * len(self.classes) + symbol
        first = np.flatnonzero(whole)
        return Words(code[first], first)


def mean_phases(train: Train) -> np.ndarray:
    """Circular mean of the phases of each train, in periods."""
    owner, number = train.owner, len(train.starts)
    turn = 2 * np.pi * train.x
    sine = np.bincount(owner, np.sin(turn), minlength=number)
    cosine = np.bincount(owner, np.cos(turn), minlength=number)
    mean: np.ndarray = np.arctan2(sine, cosine) / (2 * np.pi)
    return mean


def _bins(x: np.ndarray) -> np.ndarray:
    return np.floor((x + 0.5) % 1.0 * PHASES).astype(np.intp) % PHASES


def _classes(interval: np.ndarray) -> np.ndarray:
    """Contiguous filled bins; halved if they are all contiguous."""
    number = np.floor(interval / STEP).astype(np.intp)
    counts = np.bincount(number)
    filled = np.flatnonzero(counts > max(1.0, 0.03 * RARE * len(interval)))
    runs = np.split(filled, np.flatnonzero(np.diff(filled) > 1) + 1)
    share = np.array([counts[run].sum() / len(interval) for run in runs])
    largest = np.sort(np.argsort(-share, kind="stable")[:MOST_CLASSES])
    own = [(runs[k][0] * STEP, (runs[k][-1] + 1) * STEP) for k in largest if share[k] > RARE]
    if not own:
        own = [(0.0, float(interval.max()))]
    edges = []
    for low, high in own:
        inside = interval[(interval > low) & (interval <= high)]
        wide = high - low > 0.5 and len(inside) > len(interval) / 2
        if len(own) == 1 or (wide and len(own) < MOST_CLASSES):
            middle = float(np.median(inside))
            edges += [(low, middle), (middle, high)]
        else:
            edges.append((low, high))
    return np.array(edges)
