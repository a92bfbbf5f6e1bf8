"""Spikes of a threshold detector on a noisy displacement, just short of the stop."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...errors import InvalidInput
from ..motion import Motion

SAMPLES_PER_PERIOD = 2500
"""By default; the thesis' 50 to 60 kS/s at 20 to 24 Hz."""

TRIGGER = 3.0
"""Standard deviations of the noise from the stop to the threshold."""

RELEASE = 11.0
"""Standard deviations of the noise from the stop to where an excursion is over.

A sample halfway between has to be off by four standard deviations to be taken for either.
"""

CUT = 8.0
"""Standard deviations at which the noise is cut, so that what is skipped is skipped for certain."""

LATE = 4
"""Samples that a spike may come after its impact; the noise must hide the stop in all of them."""

BLOCK = 4096  # samples that share a random stream: noise belongs to a sample, skipped or not
CHUNK = 64 * BLOCK  # samples that are held at a time
COARSE = 0.1  # [rad] of the fastest that goes on between stops, from one coarse sample to the next
STRIDE = 64  # samples from one coarse sample to the next, at most


class Spikes(NamedTuple):
    """Instant counted for each impact, NaN if it was missed, and the spurious ones."""

    of_impact: np.ndarray
    spurious: np.ndarray
    stop: np.ndarray  # that the spurious ones are taken to have hit


class _View(NamedTuple):
    """The sampled displacement: `size` instants from the start on, `step` apart [s]."""

    motion: Motion
    step: float
    size: int
    stride: int  # samples from one coarse sample to the next
    skip: bool

    def time(self, index: np.ndarray) -> np.ndarray:
        """Instants of the samples [s]."""
        return np.minimum(self.motion.start + index * self.step, self.motion.stop)


class _Level(NamedTuple):
    """Threshold and release level, as distances from the stop."""

    sigma: float  # standard deviation of the noise
    trigger: float
    release: float
    certain: float  # further away no noise can matter
    sag: float  # greatest rise above its ends that a coarse step can hide


def spikes(
    motion: Motion, noise: float, rate: float | None, rng: np.random.Generator, skip: bool = True
) -> Spikes:
    """Spikes at all stops; with `skip` False every sample is evaluated, with the same result."""
    view = _view(motion, rate, skip)
    impacts = motion.impacts
    assert impacts is not None  # the caller has seen to it
    level = _level(view, noise)
    key = rng.integers(2**63, size=2).tolist()
    of_impact = np.full(len(impacts), np.nan)
    spurious, stops = [np.empty(0)], [np.empty(0, np.intp)]
    for side, own in _sides(motion):
        time = impacts.time[own]
        begin, end = _excursions(view, side, level, time, key)
        # A spike is of the first impact of its excursion.
        first = np.searchsorted(time, begin - LATE * view.step)
        real = first < len(time)
        real[real] = time[first[real]] <= end[real]
        real[real] = np.diff(first[real], prepend=-1) > 0
        of_impact[own[first[real]]] = begin[real]
        spurious.append(begin[~real])
        stop = motion.system.stops.index(motion.system.stops_on(side)[0])
        stops.append(np.full(len(spurious[-1]), stop))
    instants = np.concatenate(spurious)
    order = np.argsort(instants, kind="stable")
    return Spikes(of_impact, instants[order], np.concatenate(stops)[order])


def _view(motion: Motion, rate: float | None, skip: bool) -> _View:
    oscillator = motion.system
    if not oscillator.stops:
        raise InvalidInput("noise", repr(motion), "a motion with a stop to measure from")
    pace = [oscillator.angular_natural_frequency, oscillator.damping / oscillator.mass]
    pace += [force.angular_frequency for force in oscillator.forces]
    if oscillator.base:
        pace.append(oscillator.base.angular_frequency)
    if rate is None:
        counted = (oscillator.angular_frequencies or (oscillator.angular_natural_frequency,))[0]
        if not counted:
            raise InvalidInput("rate", rate, "samples per second, without forcing")
        rate = SAMPLES_PER_PERIOD * counted / (2 * math.pi * oscillator.time_unit)
    coarse = COARSE / max(*pace, 1e-300) * oscillator.time_unit * rate
    return _View(
        motion,
        1 / rate,
        int(motion.duration * rate) + 1,
        max(1, int(min(coarse, STRIDE))),
        skip and oscillator.law is None,  # of a user's own force no bound is known
    )


def _sides(motion: Motion) -> Iterator[tuple[str, np.ndarray]]:
    """Each side that has a stop, with the indices of the impacts on it."""
    impacts, oscillator = motion.impacts, motion.system
    assert impacts is not None
    upper, lower = oscillator.stops_on("upper"), oscillator.stops_on("lower")
    above = np.full(len(impacts), bool(upper))
    if upper and lower:
        at = motion._from_stops(impacts.time)[0]
        above = at > 0.5 * (upper[0].position + lower[0].position)
    if upper:
        yield "upper", np.flatnonzero(above)
    if lower:
        yield "lower", np.flatnonzero(~above)


def _level(view: _View, noise: float) -> _Level:
    """The levels, from the spread of the displacement and a bound of |x''| between stops."""
    motion, oscillator, base = view.motion, view.motion.system, view.motion.system.base
    total, squares, far, fast = 0.0, 0.0, 0.0, 0.0
    origin = None
    for coarse in _chunks(view):
        time = view.time(coarse[:-1])
        x, v = motion.sample(time)
        far, fast = max(far, float(np.abs(x).max())), max(fast, float(np.abs(v).max()))
        x = x - motion._stops_at(*motion._instants(time))[0]
        origin = x[0] if origin is None else origin
        total += float(np.sum(x - origin))
        squares += float(np.sum((x - origin) ** 2))
    count = -(-view.size // view.stride)
    sigma = noise * math.sqrt(max(squares / count - (total / count) ** 2, 0.0))

    push = sum(abs(force.amplitude) for force in oscillator.forces) + abs(oscillator.load)
    push += oscillator.stiffness * far + oscillator.damping * fast
    bend = 0.0
    if base:
        swing = abs(base.amplitude)
        push += (oscillator.stiffness + oscillator.damping * base.angular_frequency) * swing
        bend = swing * base.angular_frequency**2
    if oscillator.friction:
        push += oscillator.friction.static or 0.0
    # Twice: between coarse samples x and v may be greater than at them, by some per cent.
    bend = 2 * (bend + push / oscillator.mass)
    step = view.step / oscillator.time_unit
    speed = motion.impacts.approach_velocity if motion.impacts is not None else None
    fastest = float(speed.max()) if speed is not None and len(speed) else 0.0
    short = 0.5 * fastest * step  # no impact is further than that from one of the samples
    return _Level(
        sigma,
        TRIGGER * sigma + short,
        RELEASE * sigma + short,
        (RELEASE + CUT) * sigma + short,
        bend * (view.stride * step) ** 2 / 8,
    )


def _chunks(view: _View) -> Iterator[np.ndarray]:
    """Coarse samples, chunk by chunk; the last of each is the first of the next."""
    cells = -(-view.size // view.stride)
    held = max(CHUNK // view.stride, 1)
    for first in range(0, cells, held):
        coarse = np.arange(first, min(first + held, cells) + 1) * view.stride
        yield np.minimum(coarse, view.size)


def _excursions(
    view: _View, side: str, level: _Level, impacts: np.ndarray, key: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Begin and end [s] of every excursion over the threshold and back to the release."""
    begin: list[float] = []
    end: list[float] = []
    over: bool | None = None
    for coarse in _chunks(view):
        index = np.arange(coarse[0], coarse[-1])
        if view.skip:
            near = _near(view, side, level, impacts, coarse)
            index = index[np.repeat(near, np.diff(coarse))]
        if not len(index):
            continue
        seen = _distance(view, index, side)
        seen += (1 if side == "upper" else -1) * level.sigma * _noise(key, index)
        above = seen > -level.trigger
        if over is None:
            over = bool(above[0])
            if over:  # what had begun before is no spike, but must be marked to be ended
                begin.append(math.nan)
        # Between the levels all stays as it was. So it does over what was skipped: the sample
        # after that is a coarse one, and below the release.
        beyond = np.flatnonzero(above | (seen < -level.release))
        state = np.concatenate(([over], above[beyond]))
        turns = view.time(index[beyond[np.flatnonzero(state[1:] != state[:-1])]])
        begin.extend(turns[int(over) :: 2])
        end.extend(turns[1 - int(over) :: 2])
        over = bool(state[-1])
    if over:
        end.append(view.motion.stop)
    spans = np.array([begin, end])
    spans = spans[:, ~np.isnan(spans[0])]
    return spans[0], spans[1]


def _near(
    view: _View, side: str, level: _Level, impacts: np.ndarray, coarse: np.ndarray
) -> np.ndarray:
    """Whether noise could matter between each two coarse samples."""
    distance = _distance(view, coarse, side)
    near = np.maximum(distance[:-1], distance[1:]) + level.sag > -level.certain
    low, high = np.searchsorted(impacts, view.time(coarse[[0, -1]]))
    cell = np.searchsorted(view.time(coarse), impacts[low:high], side="right") - 1
    near[np.minimum(cell, len(near) - 1)] = True
    return near


def _distance(view: _View, index: np.ndarray, side: str) -> np.ndarray:
    """Distance from the first stop of a side to the mass, negative on the free side."""
    time = view.time(index)
    at = view.motion._from_stops(time)[0]
    position = view.motion.system.stops_on(side)[0].position
    return at - position if side == "upper" else position - at


def _noise(key: list[int], index: np.ndarray) -> np.ndarray:
    """Unit Gaussian noise at these samples, independent of which others are evaluated."""
    drawn = np.empty(len(index))
    block = index // BLOCK
    edges = np.concatenate(([0], np.flatnonzero(np.diff(block)) + 1, [len(index)]))
    for first, last in pairwise(edges.tolist()):
        number = int(block[first])
        stream = np.random.Generator(np.random.Philox(key=key, counter=[0, 0, 0, number]))
        drawn[first:last] = stream.standard_normal(BLOCK)[index[first:last] - number * BLOCK]
    return np.clip(drawn, -CUT, CUT, out=drawn)
