"""Ensembles on a GPU, a thread a path, by the kernels that move groups of paths on CPUs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ...studies.device_kernels import Each
from ._random import Room
from ._splitting import Lanes, move
from .accumulating import Kept, Potential, energies, keep
from .equation import BLOCK, Functions, Problem


class Work(NamedTuple):
    """Work arrays of `Lanes` and samples, with a first axis for the threads."""

    words: np.ndarray  # uint64, shape (n, 2, BLOCK / 2)
    real: np.ndarray  # shape (n, BLOCK / 2)
    pair: np.ndarray  # shape (n, 2)
    numbers: np.ndarray  # shape (n, 2, BLOCK, 1)
    lines: np.ndarray  # shape (n, 10, 1)
    seen: np.ndarray  # shape (n, 1, looks, 2)
    energy: np.ndarray  # shape (n, 1, looks)
    none: np.ndarray  # of events and of halved steps, which there are none of here, shape (0, 3)


def work(threads: int, looks: int) -> Work:
    """Allocate for so many threads, and so many looks at a time."""
    return Work(
        np.empty((threads, 2, BLOCK // 2), np.uint64),
        np.empty((threads, BLOCK // 2)),
        np.empty((threads, 2)),
        np.zeros((threads, 2, BLOCK, 1)),
        np.zeros((threads, 10, 1)),
        np.empty((threads, 1, looks, 2)),
        np.empty((threads, 1, looks)),
        np.empty((0, 3)),
    )


@inlined
def no_law(_t, _x, _v):
    """Stands in for a law, which no oscillator here has."""
    return math.nan


@inlined
def no_laws(_t, _x, _v, _out):
    """Stands in for a law of many paths."""


@inlined
def no_restitution(_v):
    """Stands in for a restitution function."""
    return math.nan


@inlined
def own(w, slot):
    """Work arrays of a thread."""
    words, real, lines = w.words[slot], w.real[slot], w.lines[slot]
    room = Room(words[0], words[1], real, real.view(np.uint64), w.pair[slot], w.none)
    return Lanes(
        room, w.numbers[slot, 0], w.numbers[slot, 1], lines[0], lines[1], lines[2], lines[3],
        lines[4], lines[5], lines[6], lines[7], lines[8], lines[9],
    )  # fmt: skip


@kernel
def look_at_one(
    k, slot, p, u, read, span, w, state, count, energy, x, v, joint, sums, course, looks
):
    """Move path k from its start to its end, and add what is sampled to its counts and sums."""
    key, paths, edges = read
    before, every, total, together = span
    f = Functions(no_law, no_laws, no_restitution, no_restitution)
    part = slice(k, k + 1)
    lanes, mine, hits = own(w, slot), state[:, part], count[part]
    kept = Kept(
        edges, energy[part], x[part], v[part], joint[part], sums[part], course[part], looks[part]
    )
    move(p, f, key, paths[part], lanes, mine, hits, 0, before, 1, w.seen[slot, :, :0], w.none)
    apart, at, done = p.step * every, before, 0
    while done < total:
        some = min(together, total - done)
        seen, found = w.seen[slot, :, :some], w.energy[slot, :, :some]
        last = at + some * every
        move(p, f, key, paths[part], lanes, mine, hits, at, last, every, seen, w.none)
        energies(p, u, no_law, seen, at * p.step + apart, apart, found)
        keep(kept, seen, found, total)
        at, done = last, done + some


_look = Each(look_at_one)


def look_at(
    p: Problem, u: Potential, key: np.ndarray, paths: np.ndarray, state: np.ndarray,
    count: np.ndarray, span: tuple[int, int, int, int], kept: Kept,
) -> None:  # fmt: skip
    """Move paths that have begun from step 0 to their ends; counts, sums and impacts are added.

    `span` is how many steps are not looked at, steps from look to look, looks, and looks at a time.
    """
    edges, *counts = kept
    order = np.arange(len(paths))
    w = work(len(paths), min(span[2], span[3]))
    _look(order, p, u, (key, paths, edges), span, w, state, count, *counts)
