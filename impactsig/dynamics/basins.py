"""Where a motion ends, over a plane of starts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import flag
from .._showing import Shown
from ..oscillators import Oscillator
from ..simulate._events import DONE
from ._arguments import parameter_values
from ._settling import ground
from ._survey import OPEN, Survey

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RECHECKED = 256  # starts that are followed again without being caught


@dataclass(frozen=True)
class Attractor(Shown):
    """A periodic attractor.

    Attributes
    ----------
    strobe : numpy.ndarray, shape (periods, 2)
        Displacement and velocity at the phase of the strobe, one a forcing period.
    periods, impacts : int
        period(m, n): how many impacts in how many forcing periods.
    radius : float
        A start, or a strobe, within this distance of one of its points (velocity over forcing
        frequency) was taken to end here.

    See Also
    --------
    basins_of_attraction, Basins

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
        Which of the attractors a start ends at; -1 where its orbit had not closed.
    attractors : tuple of Attractor
        In the order of their shares.
    shares, intervals : numpy.ndarray, shapes (n,) and (n, 2)
        Share of the starts each attractor has, with 95 % intervals (Wilson) as if the starts had
        been drawn.
    open_share : float
        Share of the starts whose orbit had not closed: chaos, or too few periods.
    x, v : numpy.ndarray
        The starts.
    failed : int
        Starts whose motion ended early; they count as not closed.
    rechecked, differing : int
        How many starts were followed again until their own orbit closed, and how many of these
        ended elsewhere than where they had been caught.

    See Also
    --------
    basins_of_attraction, Attractor, plot.basins

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

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the basins; see `impactsig.plot.basins`."""
        from ..plot import basins

        return basins(self, ax=ax)


def basins_of_attraction(
    oscillator: Oscillator,
    x: Any,
    v: Any,
    *,
    phase: float = 0.0,
    periods: int = 1000,
    closed: float = 1e-8,
    catch: bool = True,
    workers: int | None = None,
) -> Basins:
    """Where the motions from a grid of starts end.

    Each is strobed once a forcing period until its orbit closes: until it is back with what is
    left of the transient, as it shrinks, below `closed`. The orbits are matched by their points.
    A start is spared the end of its way once it comes near a point of an attractor that is known,
    nearer than starts all around that point from which the motion was seen to come back.

    Parameters
    ----------
    oscillator : Oscillator
        What moves; linear between events, and under forcing that recurs.
    x, v : array_like
        Displacements and velocities of the starts, against the ground. Starts beyond a rigid stop
        are refused.
    phase : float
        Phase of the forcing at the starts and strobes [rad].
    periods : int
        Forcing periods after which an orbit that has not closed is left open.
    closed : float
        Tolerance as a share of the size of displacement and velocity.
    catch : bool
        Whether to end a motion near an attractor that is known. Without it every motion is
        followed until its own orbit closes. The result tells how many starts were followed again
        without it, and how many ended elsewhere.
    workers : int, optional
        Threads; as many as there are cores unless given. The result does not depend on it.

    Returns
    -------
    Basins

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the oscillator is stepped or has no forcing that recurs.

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
    survey = Survey(oscillator, phase, periods, closed, workers)
    axes = parameter_values("x", x), parameter_values("v", v)
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    places = survey.starts(*grid.T)
    survey.discover(places, catch)
    found = survey.follow(places, catch)

    chosen = np.random.default_rng(1).permutation(len(places))[: RECHECKED if catch else 0]
    again = survey.follow(places[chosen], False) if len(chosen) else None
    counts = np.array([np.count_nonzero(found.label == k) for k in range(len(survey.orbits))], int)
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    rank = np.full(len(counts) + 1, OPEN)
    rank[order] = np.arange(len(order))
    return Basins(
        rank[found.label].reshape(len(axes[1]), len(axes[0])),
        tuple(_attractor(survey, k) for k in order),
        counts[order] / len(places),
        np.array([_wilson(count, len(places)) for count in counts[order]]).reshape(-1, 2),
        float(np.mean(found.label == OPEN)),
        *axes,
        int(np.count_nonzero(found.status != DONE)),
        len(chosen),
        int(np.count_nonzero(again.label != found.label[chosen])) if again else 0,
    )


def _attractor(survey: Survey, k: int) -> Attractor:
    """An attractor against the ground and in the oscillator's units."""
    orbit = survey.orbits[k]
    origin, unit = ground(survey.run.oscillator, survey.phase)
    strobe = origin + unit * orbit[:, :2]
    return Attractor(strobe, len(orbit), int(orbit[:, 2].sum()), survey.radii[k])


def _wilson(count: int, of: int) -> tuple[float, float]:
    """95 % interval of a share."""
    z = 1.959963984540054
    share = count / of
    middle = share + z * z / (2 * of)
    half = z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return (middle - half) / (1 + z * z / of), (middle + half) / (1 + z * z / of)
