"""Posterior predictive check of a fit: trains drawn from the posterior, as bands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .._showing import Shown, drawn_on_figure_by
from ._judging import p_value
from ._machine import CHAIN, EXTRA, PARAMETERS
from .searching.simulated import Beginnings, simulated
from .trains.echoes import Echoes

if TYPE_CHECKING:
    from ..impacts import Impacts

BINS, CELLS = 24, 8
"""Bins of the intervals, and of either of the two that follow each other in the return map."""
LEVEL = 0.95
DOUBTED = 0.05
"""Of a p-value: from there on down the oscillator does not explain what is measured."""
NAMED = 3
"""Places of a misfit that are named."""
FEWEST = 10
"""Intervals of a simulated train that is compared."""


class Posterior(NamedTuple):
    """The distribution that trains are drawn from."""

    centre: np.ndarray  # (names,), on the scale of the search
    covariance: np.ndarray
    box: tuple[np.ndarray, np.ndarray]
    names: tuple[str, ...]
    known: dict[str, float]  # that are not drawn
    frequency: float  # of the forcing [Hz]
    periods: int
    impacts: float  # that the measured train has in as many periods
    beginnings: Beginnings
    heard: Echoes | None = None  # that the measured train was rid of


@dataclass(frozen=True, eq=False)
class Band(Shown):
    """Histogram of the measured intervals, with bands from simulated trains.

    Attributes
    ----------
    edges : ndarray, shape (bins + 1,)
        Edges of the bins of the intervals [s]: quantiles of all trains together.
    measured : ndarray
        Fraction of intervals in each bin, shape (bins,), or of successive pairs, shape (bins,
        bins).
    low, high : ndarray
        Limits that contain 95 % of the simulated trains, in each bin separately.
    p_value : float
        Fraction of all trains, including the measured one, whose distance from the mean of the
        others, over all bins, is at least that of the measured one.

    See Also
    --------
    results.Prediction

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig.results import Band
    >>> measured, low, high = np.array([[0.7, 0.3], [0.4, 0.4], [0.6, 0.6]])
    >>> band = Band(np.array([0.0, 0.1, 0.2]), measured, low, high, 0.02)
    >>> band.outside.round(3).tolist()
    [0.1, -0.1]
    """

    edges: np.ndarray
    measured: np.ndarray
    low: np.ndarray
    high: np.ndarray
    p_value: float

    @property
    def outside(self) -> np.ndarray:
        """Excess of each measured share over its band, shape of `measured`: negative below it."""
        above = np.maximum(self.measured - self.high, 0.0)
        return above - np.maximum(self.low - self.measured, 0.0)


@dataclass(frozen=True, eq=False)
class Prediction(Shown):
    """The measured train compared with trains drawn from a fit.

    Attributes
    ----------
    interval : Band
        Band of the intervals.
    return_map : Band
        Band of pairs of successive intervals.
    trains : int
        Number of simulated trains that were compared.
    failed : int
        Number of simulated trains with too few impacts to compare; the p-values count them as
        nearer.
    unexplained : tuple of str
        What the oscillator does not explain, in words; empty if the measured train agrees with the
        simulated ones.
    measured : ndarray
        The measured intervals [s].

    See Also
    --------
    results.OscillatorFit.predict, plot.prediction

    Examples
    --------
    >>> from impactsig import fit_oscillator, measure, scenes, simulate
    >>> beam = scenes.karpodinis(20.1)
    >>> motion = simulate(beam, periods=400, transient=300)
    >>> train = measure(motion.impacts, jitter=2e-4, seed=1).impacts
    >>> fit = fit_oscillator(train, 1 / 20.1, ["amplitude"], scene=beam)
    >>> fit.predict(60, seed=2).trains
    60
    """

    interval: Band
    return_map: Band
    trains: int
    failed: int
    unexplained: tuple[str, ...]
    measured: np.ndarray

    def describe(self) -> str:
        """What the oscillator explains and what not, in a few lines of words."""
        judged = (
            f"{self.trains} trains drawn from the fit: p {self.interval.p_value:.2g} of the "
            f"intervals, {self.return_map.p_value:.2g} of the return map"
        )
        if not self.unexplained:
            return f"{judged}\nthe measured train is among the simulated ones"
        return "\n".join((judged, *self.unexplained))

    plot = drawn_on_figure_by("prediction", "it")


def predicted(
    posterior: Posterior, measured: Impacts, trains: int, rng: np.random.Generator
) -> Prediction:
    """As `OscillatorFit.predict`."""
    own = measured.intervals()
    own_pairs = _pairs(measured.time, measured.interval_spans_gap())
    drawn = [one for one in _drawn(posterior, trains, rng) if len(one[0]) >= FEWEST]
    # Quantiles of all trains together: of the measured one alone they would fit it too well.
    all_intervals = np.concatenate([own, *(one for one, _ in drawn)])
    interval = _band(_edges(all_intervals, BINS), [(own,), *((one,) for one, _ in drawn)], trains)
    pairs = [own_pairs, *(one for _, one in drawn)]
    return_map = _band(_edges(all_intervals, CELLS), pairs, trains)
    return Prediction(
        interval,
        return_map,
        len(drawn),
        trains - len(drawn),
        tuple(_unexplained(interval, return_map)),
        own,
    )


def _drawn(
    posterior: Posterior, trains: int, rng: np.random.Generator
) -> Iterator[tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]]:
    """Intervals [s] of trains at parameters drawn from the posterior, and their successors."""
    vectors, squares = np.linalg.svd(posterior.covariance, hermitian=True)[:2]
    normal = rng.standard_normal((trains, len(squares)))
    psi = posterior.centre + normal * np.sqrt(squares) @ vectors.T
    psi = np.clip(psi, *posterior.box)
    kinds = PARAMETERS | EXTRA | CHAIN
    free = {name: kinds[name].value(psi[:, k]) for k, name in enumerate(posterior.names)}
    values = {n: np.broadcast_to(v, trains) for n, v in (posterior.known | free).items()}
    found = simulated(
        values, posterior.frequency, posterior.periods, posterior.impacts, posterior.beginnings,
        rng, posterior.heard,
    )  # fmt: skip
    for one in found.split():
        time = one.x / posterior.frequency
        yield np.diff(time)[one.joined], _pairs(time, ~one.joined)


def _pairs(time: np.ndarray, broken: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Intervals and their successors, without those that span a gap."""
    intervals, whole = np.diff(time), ~broken
    both = whole[:-1] & whole[1:]
    return intervals[:-1][both], intervals[1:][both]


def _edges(values: np.ndarray, count: int) -> np.ndarray:
    """Edges of bins that hold equally many values, or fewer if many are equal."""
    return np.unique(np.quantile(values, np.linspace(0, 1, count + 1)))


def _band(edges: np.ndarray, samples: Sequence[tuple[np.ndarray, ...]], trains: int) -> Band:
    """Band of the first sample among the others, in bins of one or two dimensions."""
    shares = []
    for sample in samples:
        held, _ = np.histogramdd(np.column_stack(sample), [edges] * len(sample))
        shares.append(held / max(held.sum(), 1.0))
    measured, others = shares[0], np.array(shares[1:])
    tail = 0.5 * (1 - LEVEL)
    low, high = np.quantile(others, [tail, 1 - tail], axis=0)
    return Band(edges, measured, low, high, _rank(np.array(shares), trains))


def _rank(shares: np.ndarray, trains: int) -> float:
    """p-value of the first by the rank of its distance from the mean of the others.

    Each train is compared with all others by one rule, so that all are exchangeable.
    """
    flat = shares.reshape(len(shares), -1)
    count, total, squares = len(flat) - 1, flat.sum(axis=0), np.sum(flat**2, axis=0)
    mean = (total - flat) / count
    variance = np.maximum((squares - flat**2) / count - mean**2, 0.0)
    # The weight of a bin with hardly any interval is the effect of one more.
    floor = np.mean(flat.sum(axis=1)) / flat.shape[1] / max(trains, 1)
    distance = np.mean((flat - mean) ** 2 / (variance + floor**2), axis=1)
    return p_value(float(distance[0]), distance[1:], trains)


def _unexplained(interval: Band, return_map: Band) -> Iterator[str]:
    """Features that are measured but not predicted, beyond chance."""
    if interval.p_value <= DOUBTED:
        yield f"the intervals are not those of the oscillator: {'; '.join(_places(interval))}"
    if return_map.p_value <= DOUBTED:
        yield f"the return map is not that of the oscillator: {'; '.join(_places(return_map))}"


def _places(band: Band) -> Iterator[str]:
    """Bins in which the measured shares are farthest from their bands."""
    outside = band.outside
    order = np.argsort(-abs(outside), axis=None, kind="stable")[:NAMED]
    for flat in order:
        place = np.unravel_index(flat, outside.shape)
        if outside[place] == 0:
            return
        spans = [f"{1e3 * band.edges[k]:.4g} to {1e3 * band.edges[k + 1]:.4g} ms" for k in place]
        yield (
            f"{band.measured[place]:.1%} at {' and then '.join(spans)}, simulated "
            f"{band.low[place]:.1%} to {band.high[place]:.1%}"
        )
