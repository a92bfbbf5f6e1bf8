"""Variational equation about an orbit under delayed feedback, lap by lap.

Between events it is a linear equation with a delay, solved by collocation at Chebyshev's nodes; a
delay is so many laps of the orbit, so that pieces meet pieces. At an event differences jump by the
saltation matrix. There, what is fed back makes no difference of first order in a derivative, but
in a pulse: an impact that comes ds later than the delayed one leaves a force of finite height,
``gain * jump of the velocity`` or the limit, for a time ds. What it gives to the velocity is linear
in ds, but not with the same factor for either sign: before the impact it loses by the restitution.
So under feedback of the velocity at a rigid stop the map of a lap is linear only in cones; it is
positively homogeneous.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...dynamics.periodic.collocation import NODES, solve
from ...errors import InvalidInput
from ..feedback import DelayedFeedback

FAINT = 1e-15  # share of a memory


@dataclass(frozen=True)
class Piece:
    """The motion from one event to the next; d is 2 for an oscillator."""

    end: np.ndarray  # (d, d) of the difference at the end by that at the beginning
    driven: np.ndarray  # (d, nodes) of the end by what is fed back
    course: np.ndarray  # (nodes, d) of the signal at the nodes by the difference at the beginning
    echo: np.ndarray  # (nodes, nodes) and by what is fed back
    jump: np.ndarray  # (d, d) saltation at its end
    lag: np.ndarray  # (d,) how much later the event is, by the difference just before it
    height: float = 0.0  # of the pulse of control force per unit of what is late, before the limit
    kept: float = 1.0  # what an impact makes of a velocity


@dataclass(frozen=True)
class Variation:
    """The map of deviations from an orbit over one lap of it."""

    pieces: list[Piece]
    laps: int  # of the orbit, in a delay
    memory: float
    gain: float  # in the units of the pieces
    limit: float = np.inf
    along: State | None = None  # the difference along the orbit, which stays: of flows

    @property
    def linear(self) -> bool:
        """Whether the map is linear, that is, without pulses."""
        return not (self.gain and any(piece.height for piece in self.pieces))

    @property
    def forgets(self) -> bool:
        """Whether every lap has an instant without deviations, such as rest at a stop.

        What is fed back is then all that makes new ones, from there on, and each time less: the
        map has no eigenvalue but 0 and, of what the memory holds, the memory.
        """
        return any(not piece.jump.any() for piece in self.pieces)

    @property
    def dimension(self) -> int:
        """Number of coordinates of a deviation at an instant."""
        return len(self.pieces[0].end)

    def start(self, rng: np.random.Generator, count: int) -> State:
        """Random deviations, `count` of them side by side."""
        size = len(self.pieces)
        return State(
            rng.standard_normal((self.dimension, count)),
            [rng.standard_normal((size, NODES, count)) for _ in range(self.laps)],
            [np.zeros((size, 1, count)) for _ in range(self.laps)],
        )

    def lap(self, state: State) -> State:
        """The deviations one lap later."""
        z = state.now
        late, came = state.late[0], state.came[0]
        count = z.shape[1]
        fed = np.empty((len(self.pieces), NODES, count))
        lags = np.zeros((len(self.pieces), 1, count))
        for j, piece in enumerate(self.pieces):
            own = piece.course @ z + piece.echo @ late[j]
            fed[j] = (1 - self.memory) * own + self.memory * late[j]
            before = piece.end @ z + piece.driven @ late[j]
            lags[j, 0] = piece.lag @ before
            z = piece.jump @ before
            if piece.height and self.gain:
                z[1] += self._pulse(piece, lags[j, 0], came[j])
        kept = lags
        if self.memory > 0:
            room = 1 + int(np.ceil(np.log(FAINT) / np.log(self.memory)))
            kept = np.concatenate([lags, came], axis=1)[:, :room]
        return State(z, [*state.late[1:], fed], [*state.came[1:], kept])

    def _pulse(self, piece: Piece, own: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Gain of the velocity after an impact, from the force between it and the delayed one.

        `others` are how late the delayed impacts were, a row for each delay.
        """
        shares = (1 - self.memory) * self.memory ** np.arange(len(others))
        shares[-1] = self.memory ** (len(others) - 1)
        edges = np.sort(np.concatenate([others, own[None]]), axis=0)
        middle = (edges[1:] + edges[:-1]) / 2
        early = middle < own  # than the impact itself
        ahead = np.einsum("m,mei->ei", shares, others[:, None] > middle) - early
        force = np.clip(self.gain * piece.height * ahead, -self.limit, self.limit)
        return np.sum(force * np.diff(edges, axis=0) * np.where(early, piece.kept, 1.0), axis=0)


@dataclass(frozen=True)
class State:
    """Deviations from the orbit: the present ones, and those in the delayed signal."""

    now: np.ndarray  # (d, count)
    late: list[np.ndarray]  # for each lap of the delay: (pieces, nodes, count)
    came: list[np.ndarray]  # how late its impacts were: (pieces, remembered, count)

    def size(self) -> np.ndarray:
        """Norms of the deviations, shape (count,)."""
        parts = [np.abs(self.now).max(axis=0)]
        parts += [np.abs(late).max(axis=(0, 1)) for late in self.late]
        return np.max(parts, axis=0)

    def divided(self, by: np.ndarray) -> State:
        """All deviations divided by numbers."""
        late, came = [own / by for own in self.late], [own / by for own in self.came]
        return State(self.now / by, late, came)

    def flat(self) -> np.ndarray:
        """One deviation as a vector, without the pulses of impacts."""
        return np.concatenate([self.now.ravel(), *(own.ravel() for own in self.late)])


def moving(length: float, slopes: np.ndarray, row: int, signal: int, gain: float) -> Piece:
    """A piece without an event at its end.

    Parameters
    ----------
    length : float
        Of the piece.
    slopes : ndarray, shape (nodes, d, d)
        Derivatives of the rates by the coordinates at the nodes, without control.
    row, signal : int
        Coordinate whose rate the feedback is added to, and that which is fed back.
    gain : float
        Of the feedback.
    """
    d = slopes.shape[1]
    slopes = slopes.copy()
    slopes[:, row, signal] -= gain
    by_start, by_late = solve(length, slopes, gain * (np.arange(d) == row))
    return Piece(
        by_start[-1], by_late[-1], by_start[:, signal], by_late[:, signal], np.eye(d), np.zeros(d)
    )


def laps_in(feedback: DelayedFeedback, period: float, told: str) -> int:
    """Delay in laps of the orbit.

    Raises
    ------
    InvalidInput
        If it is none of their multiples.
    """
    laps = round(feedback.delay / period)
    if laps < 1 or abs(feedback.delay - laps * period) > 1e-12 * feedback.delay:
        raise InvalidInput(
            "delay", feedback.delay, f"a multiple of {told}",
            "With another delay it is no orbit of the controlled system",
        )  # fmt: skip
    return laps
