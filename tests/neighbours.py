"""Derivatives of a motion's end by its start, by differences of neighbouring motions."""

from __future__ import annotations

import numpy as np

import impactsig
from impactsig.simulation.basis.events import MARK


def events(motion):
    """Kind and stop of every event."""
    rows = motion._segments
    return [(int(kind), int(stop)) for kind, stop in rows[rows[:, 2] != MARK, 2:4]]


def derivative(machine, start, step, **options):
    """The 2 x 2 derivative by Romberg's central differences, and how far off it may be.

    None where neighbours meet other events.
    """
    known = events(impactsig.simulate(machine, initial=start, **options))
    matrix, error = np.empty((2, 2)), 0.0
    for j, h in enumerate(step):
        table = []
        for k in range(5):
            ends = []
            for sign in (1, -1):
                moved = list(start)
                moved[j] += sign * h / 2**k
                motion = impactsig.simulate(machine, initial=tuple(moved), **options)
                if events(motion) != known:
                    return None
                ends.append(np.array(motion.final[:2]))
            row = [(ends[0] - ends[1]) / (2 * h / 2**k)]
            for n, before in enumerate(table[-1] if table else []):
                row.append(row[n] + (row[n] - before) / (4 ** (n + 1) - 1))
            table.append(row)
        best = [(np.abs(row[-1] - row[-2]).max(), row[-1]) for row in table[2:]]
        least, column = min(best, key=lambda pair: pair[0])
        matrix[:, j] = column
        error = max(error, least)
    return matrix, error
