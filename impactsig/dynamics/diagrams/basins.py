"""Basins of attraction over a plane of starts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..._arguments import flag, number, thread_count, whole
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation.basis.events import DONE
from ...simulation.exact.exact import piecewise_linear
from ...studies.device import Executor, on_gpu
from ..arguments import parameter_values, recurring
from ._basins_of_starts import ends
from ._flow_sections import checked_section
from ._survey import OPEN, Survey
from .settling.settling import ground

FOR_GPU = "for a GPU, an oscillator that is linear between events"
RECHECKED = 256  # starts that are followed without being caught, scouts among them


@dataclass(frozen=True)
class Attractor(Shown):
    """A periodic attractor.

    Attributes
    ----------
    strobe : numpy.ndarray, shape (periods, d)
        Stroboscopic points: displacement and velocity, one per forcing period; for a cantilever
        those of its first mode, for a flow its states on the section.
    periods, impacts : int
        n and m of period(m, n): m impacts in n forcing periods. For a flow both count returns to
        the section, and (1, 0) is rest.
    radius : float
        A start, or a stroboscopic point, within this distance of one of its points (with velocity
        divided by the forcing frequency) was assigned to this attractor; 0 if every motion was
        simulated until it closed.

    See Also
    --------
    basins_of_attraction, results.Basins

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import basins_of_attraction, scenes
    >>> walls = scenes.begley_virgin(gamma=1.338, sigma=1.6, friction=0.05)
    >>> found = basins_of_attraction(walls, np.linspace(-1.5, 1.5, 3), np.linspace(-1, 1, 3))
    >>> first = found.attractors[0]
    >>> first.periods, first.impacts
    (2, 3)
    """

    strobe: np.ndarray = field(repr=False)
    periods: int
    impacts: int
    radius: float


@dataclass(frozen=True)
class Basins(Shown):
    """Basins of attraction on a grid of starts.

    Attributes
    ----------
    labels : numpy.ndarray, shape (len(v), len(x))
        Index of the attractor that a start leads to; -1 if its orbit did not close.
    attractors : tuple of Attractor
        The attractors, in descending order of their shares.
    shares, intervals : numpy.ndarray, shapes (n,) and (n, 2)
        Fraction of the starts that lead to each attractor, with 95 % intervals (Wilson) as for
        random starts.
    open_share : float
        Fraction of the starts whose orbit did not close: chaos, or too few periods.
    x, v : numpy.ndarray
        The starts.
    failed : int
        Starts whose motion ended early; they count as not closed.
    rechecked, differing : int
        Number of starts that were simulated again until their own orbit closed, and the number of
        these that led to another attractor.

    See Also
    --------
    basins_of_attraction, results.Attractor, plot.basins

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import basins_of_attraction, scenes
    >>> walls = scenes.begley_virgin(gamma=1.338, sigma=1.6, friction=0.05)
    >>> found = basins_of_attraction(walls, np.linspace(-1.5, 1.5, 3), np.linspace(-1, 1, 3))
    >>> found.labels.shape, round(float(found.shares.sum()) + found.open_share, 6)
    ((3, 3), 1.0)
    """

    labels: np.ndarray = field(repr=False)
    attractors: tuple[Attractor, ...]
    shares: np.ndarray
    intervals: np.ndarray = field(repr=False)
    open_share: float
    x: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    failed: int
    rechecked: int
    differing: int

    plot = drawn_by("basins", "the basins")


def basins_of_attraction(
    system: Oscillator | Cantilever | Flow,
    x: Any,
    v: Any,
    *,
    phase: float = 0.0,
    section: tuple[str | int, float] | None = None,
    periods: int = 1000,
    closed: float = 1e-8,
    catch: bool = True,
    executor: Executor = "threads",
    workers: int | None = None,
) -> Basins:
    """Basins of attraction: the attractor that each start of a grid leads to.

    Each motion is sampled once per forcing period until its orbit closes, that is until it returns
    and the estimated rest of the transient is below `closed`. Orbits with the same points are one
    attractor. A motion ends earlier if it comes near a point of a known attractor, closer than
    rings of starts around that point from all of which the motion was seen to return.

    Parameters
    ----------
    system : Oscillator, Cantilever, Flow or Controlled
        The system; a controlled one must be an oscillator under OGY. Oscillators and cantilevers
        need periodic forcing. Systems other than oscillators that are linear between events are
        simulated start by start.
    x, v : array_like
        Displacements and velocities of the starts, relative to the ground; for a cantilever those
        of its first mode, with the others at rest; for a flow its first two coordinates, with the
        others as in its initial state. Starts beyond a rigid stop are an error.
    phase : float
        Phase of the forcing at the starts and strobes [rad]. Not for flows.
    section : (str or int, float), optional
        For flows: name or number of a coordinate, and the level that it crosses upwards. A motion
        closes by its returns to this section, or by coming to rest.
    periods : int
        Greatest number of forcing periods, or of returns of a flow.
    closed : float
        Tolerance as a share of the size of displacement and velocity.
    catch : bool
        Whether to end a motion near a known attractor; otherwise every motion is simulated until
        its own orbit closes. `Basins.rechecked` starts are simulated again without this shortcut,
        and `Basins.differing` of them lead elsewhere.
    executor : {"threads", "gpu"}
        Where the oscillator is computed, as for `simulate_many`; a GPU takes no other system.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    Basins

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the forcing is not periodic.

    See Also
    --------
    simulate_many, periodicity_chart, plot.basins

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import basins_of_attraction, scenes
    >>> walls = scenes.begley_virgin(gamma=1.338, sigma=1.6, friction=0.05)
    >>> found = basins_of_attraction(walls, np.linspace(-1.5, 1.5, 3), np.linspace(-1, 1, 3))
    >>> [(one.impacts, one.periods) for one in found.attractors]
    [(3, 2), (2, 1), (3, 2)]
    """
    catch = flag("catch", catch)
    axes = parameter_values("x", x), parameter_values("v", v)
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    cut = checked_section(section)
    gpu = on_gpu(executor, workers)
    if not (isinstance(system, Oscillator) and system.noise is None and piecewise_linear(system)):
        if isinstance(system, Oscillator):
            recurring("system", system)
        if gpu:
            raise InvalidInput("system", system, FOR_GPU, 'Else take executor="threads"')
        label, orbits, failed = ends(
            system, grid, cut, number("phase", phase), whole("periods", periods, 1),
            number("closed", closed, above=0, most=1e-2), thread_count(workers),
        )  # fmt: skip
        found_of = [Attractor(own.points, len(own.points), own.impacts, 0.0) for own in orbits]
        return _basins(label, found_of, axes, failed)
    survey = Survey(system, phase, periods, closed, workers, gpu)
    places = survey.starts(*grid.T)
    scouts, found = survey.discover(places, catch)
    others = np.setdiff1d(np.arange(len(places)), scouts)
    catches = catch and len(survey.orbits) > 0
    status, label = np.empty((2, len(places)), int)
    status[scouts], label[scouts] = found.status, found.label
    left = np.arange(len(places)) if catches else others
    if len(left):
        own = survey.follow(places[left], catches)
        status[left], label[left] = own.status, own.label
    rechecked = differing = 0
    if catch:  # and more than the scouts, who were followed to their ends already
        more = np.random.default_rng(1).permutation(others)[: RECHECKED - len(scouts)]
        rechecked = len(scouts) + len(more)
        if catches:
            ends_at = survey.follow(places[more], False).label if len(more) else label[more]
            differing = int(
                np.count_nonzero(found.label != label[scouts])
                + np.count_nonzero(ends_at != label[more])
            )
    return _basins(
        label,
        [_attractor(survey, k) for k in range(len(survey.orbits))],
        axes,
        int(np.count_nonzero(status != DONE)),
        rechecked,
        differing,
    )


def _basins(
    label: np.ndarray,
    attractors: list[Attractor],
    axes: tuple[np.ndarray, np.ndarray],
    failed: int,
    rechecked: int = 0,
    differing: int = 0,
) -> Basins:
    """The result, with the attractor of most starts first."""
    counts = np.array([np.count_nonzero(label == k) for k in range(len(attractors))], int)
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    rank = np.full(len(counts) + 1, OPEN)
    rank[order] = np.arange(len(order))
    return Basins(
        rank[label].reshape(len(axes[1]), len(axes[0])),
        tuple(attractors[k] for k in order),
        counts[order] / len(label),
        np.array([_wilson(count, len(label)) for count in counts[order]]).reshape(-1, 2),
        float(np.mean(label == OPEN)),
        *axes,
        failed,
        rechecked,
        differing,
    )


def _attractor(survey: Survey, k: int) -> Attractor:
    """An attractor relative to the ground, in the oscillator's units."""
    orbit = survey.orbits[k]
    origin, unit = ground(survey.run.oscillator, survey.phase)
    strobe = origin + unit * orbit[:, :2]
    return Attractor(strobe, len(orbit), int(orbit[:, 2].sum()), survey.radii[k])


def _wilson(count: int, of: int) -> tuple[float, float]:
    """95 % Wilson interval of a proportion."""
    z = 1.959963984540054
    share = count / of
    middle = share + z * z / (2 * of)
    half = z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return (middle - half) / (1 + z * z / of), (middle + half) / (1 + z * z / of)
