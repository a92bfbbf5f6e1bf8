"""Counts and sums of one group of paths, from which an ensemble is made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ._arguments import Course
from .paths.running import Mover

if TYPE_CHECKING:
    from .paths.accumulating import Kept, Potential

BATCH = 512  # looks between two visits of the kernels
SLICES = 32  # of the course of the mean energy


@dataclass
class Part:
    """Counts and sums of one group of paths."""

    counts: list[np.ndarray]
    squares: list[np.ndarray]
    sums: np.ndarray
    course: np.ndarray
    impacts: np.ndarray


def look_at_group(
    mover: Mover, found: Course, table: Potential, edges: list[np.ndarray], first: int, last: int
) -> Part:
    """Simulate a group of paths to the end, and accumulate its counts."""
    from .paths.accumulating import energies, keep

    paths = np.arange(first, last)
    group = mover.start(found.q[first:last], found.v[first:last], paths)
    group.move(found.before)
    kept = _nothing_kept(len(paths), edges)
    apart = found.step * found.every
    done = 0
    while done < found.looks:
        some = min(BATCH, found.looks - done)
        at = group.step * found.step
        seen = group.move(some * found.every, found.every, some)
        energy = np.empty(seen.shape[:2])
        energies(mover.problem, table, mover.functions.law, seen, at + apart, apart, energy)
        keep(kept, seen, energy, found.looks)
        done += some
    return _part_of(kept, group.count)


def look_at_group_on_gpu(
    mover: Mover, found: Course, table: Potential, edges: list[np.ndarray], first: int, last: int
) -> Part:
    """As `look_at_group`, by a GPU."""
    from .paths.gpu import look_at

    paths = np.arange(first, last)
    group = mover.start(found.q[first:last], found.v[first:last], paths)
    kept = _nothing_kept(len(paths), edges)
    span = found.before, found.every, found.looks, BATCH
    look_at(mover.problem, table, mover.key, group.paths, group.state, group.count, span, kept)
    return _part_of(kept, group.count)


def _part_of(kept: Kept, impacts: np.ndarray) -> Part:
    """Counts and sums of those paths of a group that have stayed finite."""
    finite = np.isfinite(kept.sums).all(axis=1)
    counts = [each[finite] for each in (kept.energy, kept.x, kept.v, kept.joint)]
    return Part(
        [each.sum(axis=0, dtype=np.int64) for each in counts],
        [np.square(each, dtype=np.int64).sum(axis=0) for each in counts],
        kept.sums[finite],
        kept.course[finite],
        impacts[finite],
    )


def _nothing_kept(lanes: int, edges: list[np.ndarray]) -> Kept:
    from .paths.accumulating import SUMS, Kept

    size = len(edges[0]) - 1
    scale = [(each[0], size / (each[-1] - each[0])) for each in edges]
    return Kept(
        edges=np.array(scale),
        energy=np.zeros((lanes, size), np.int32),
        x=np.zeros((lanes, size), np.int32),
        v=np.zeros((lanes, size), np.int32),
        joint=np.zeros((lanes, size // 2, size // 2), np.int32),
        sums=np.zeros((lanes, SUMS)),
        course=np.zeros((lanes, SLICES)),
        looks=np.zeros(lanes, np.int64),
    )
