"""A measured train of instants, and the orbit of an oscillator beside it.

As in `orbit`, at given parameters the orbit is found by `smooth`, but it begins at the likeliest
course of the oscillator through the train (`_path`), which has found already what is false and what
was missed. Velocities are not measured: they are held to where they were a step before, so that
they pull at no parameter once these rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ._laying_kernels import CLOSE, ITERATIONS, lay
from ._path import course
from ._path_kernels import LOST, Chain
from .orbit import machine_of
from .orbit_kernels import PARAMETERS, STRENGTH, Noise, project, smooth

SLACKS = np.array([3e-4, 3e-5])
HELD, MOVED, FREE = 0.3, 1.0, 50.0
"""Of the velocities, in gaps times omega_n: at first, as the parameters move, and in what these
are found from, so that the velocities do not hold them back."""
GRAZING = 0.03
"""Velocity of an impact, in gaps times omega_n, below which a leg is left out: its sensitivity to
the parameters is unbounded, and linear in no neighbourhood."""
TORN = 300.0
"""Chi squared of a leg from a soft stop, above which it is left out: whether the contact of a weak
impact ends at once depends on the forcing, and no step leads across that kink."""
TOLD = np.delete(np.arange(PARAMETERS), STRENGTH)
"""Parameters that instants can determine."""
BEGUN = Chain(jitter=0.02, missed=0.02, spurious=0.01)
"""Initial measuring chain: wide, so that every orbit can start."""
FINEST = 3e-3
"""Forcing periods between an impact and the nearest of the few hundred states of a course:
instants known better than that, as of load cells, would be taken for false ones."""
TEARS = 4  # times that legs are left out, at one step
FEWEST = 0.25  # legs that an orbit follows, by the impacts
SHRINK, GROW = 0.5, 1.2  # of the jitter, from one round to the next


class Seen(NamedTuple):
    """A measured train."""

    frequency: float  # of the forcing
    x: np.ndarray  # forcing periods
    joined: np.ndarray
    kind: str  # of machine
    chain: Chain  # the jitter is found; were the shares, many missed would explain anything

    def shown(self, jitter: float) -> Seen:
        """With another jitter."""
        return self._replace(chain=self.chain._replace(jitter=jitter))


class Laid(NamedTuple):
    """An orbit at some parameters, with its information about them."""

    loss: float  # half of the objective
    gradient: np.ndarray
    information: np.ndarray
    orbit: Followed
    jitter: float  # that the distances show

    @property
    def total(self) -> float:
        """The loss, and what it costs that legs are not followed."""
        return self.loss + self.orbit.broken * self.orbit.lost


@dataclass(frozen=True, eq=False)
class Followed:
    """A train, and the orbit beside it."""

    seen: Seen
    real: np.ndarray  # which instants are not false
    side: np.ndarray  # of the stop, 1 or -1
    led: np.ndarray  # legs that the orbit follows
    node: np.ndarray  # of the orbit: instants and approach velocities
    missed: int
    broken: int

    @classmethod
    def of(cls, seen: Seen, theta: np.ndarray, seed: int) -> Followed | None:
        """At the most likely course; None if the oscillator follows hardly any impact."""
        chain = seen.chain._replace(jitter=max(seen.chain.jitter, FINEST))
        path = course(theta, seen.kind, seen.frequency, seen.x, seen.joined, chain, seed)
        if path is None or path.joined.sum() < FEWEST * len(seen.x):
            return None
        node, led = np.abs(path.node), path.joined.copy()
        side = np.where(path.node[:, 1] < 0, -1.0, 1.0)
        noise, held = Noise(seen.chain.jitter, HELD), _held(seen, path.real, side, node)
        lay(machine_of(theta, seen.kind), 1.0, noise, SLACKS, held, led, node)
        if not np.isfinite(node).all():
            return None
        broken = path.broken + int((path.joined & ~led).sum())
        return cls(seen, path.real, side, led & _hard(node), node, path.missed, broken)

    def laid(self, theta: np.ndarray) -> Laid:
        """The orbit at other parameters nearby, with its information about them."""
        machine = machine_of(theta, self.seen.kind)
        jitter, node, led = self.seen.chain.jitter, self.node.copy(), self.led
        for _ in range(TEARS):
            found = smooth(
                machine, 1.0, Noise(jitter, MOVED), SLACKS[-1], self.held, led, node,
                ITERATIONS, CLOSE,
            )  # fmt: skip
            torn = led & ~(found.release < TORN)
            if self.seen.kind != "soft" or not torn.any():
                break
            led, node = led & ~torn, np.where(np.isfinite(node), node, self.node)
        broken = self.broken + int(np.sum(self.led & ~led))
        held = _held(self.seen, self.real, self.side, node)
        gradient, information = project(
            machine, 1.0, Noise(jitter, FREE), SLACKS[-1], held, led & _hard(node), node
        )
        gradient, information = gradient[TOLD], information[np.ix_(TOLD, TOLD)]
        shown = math.sqrt(found.squares[0] / max(found.freedom[0], 1.0))
        loss = found.objective / 2 if np.isfinite(information).all() else math.inf
        return Laid(
            loss, gradient, information, replace(self, node=node, led=led, broken=broken), shown
        )

    @property
    def held(self) -> np.ndarray:
        """What was measured, and the velocities, as `smooth` takes them."""
        return _held(self.seen, self.real, self.side, self.node)

    @property
    def cost(self) -> float:
        """What false and missed impacts cost, as a logarithm of the likelihood."""
        jitter, missed, spurious = self.seen.chain
        false = math.log(1 / spurious) - math.log(math.sqrt(2 * math.pi) * jitter)
        paid = np.sum(~self.real) * false + self.missed * math.log(1 / missed)
        return float(paid) + self.broken * self.lost

    @property
    def lost(self) -> float:
        """What it costs that the course breaks off."""
        return math.log(1 / LOST) - math.log(self.seen.chain.jitter)

    @property
    def score(self) -> float:
        """Cost, and the logarithm of the jitter: with the loss, what a round is judged by."""
        return self.cost + len(self.real) * math.log(self.seen.chain.jitter)

    def jitter(self, shown: float) -> float:
        """The one that the orbit shows, not too far from the one before."""
        was = self.seen.chain.jitter
        return min(max(shown, SHRINK * was), GROW * was)

    @property
    def shares(self) -> tuple[float, float]:
        """Of impacts that were missed, and of false ones."""
        return self.missed / (len(self.real) + self.missed), float(np.mean(~self.real))


def _hard(node: np.ndarray) -> np.ndarray:
    """Legs from and to impacts that do not graze."""
    hard = node[:, 1] > GRAZING
    legs: np.ndarray = hard[1:] & hard[:-1]
    return legs


def _held(seen: Seen, real: np.ndarray, side: np.ndarray, node: np.ndarray) -> np.ndarray:
    return np.column_stack((seen.x[real], node[:, 1], np.ones(len(node)), side))
