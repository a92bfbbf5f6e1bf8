"""Runs beyond one Motion: in pieces of bounded memory, and many at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from typing import Any

import numpy as np

from .._arguments import entries, instance, number, reals, thread_count
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ._run import Run, without_noise
from .motion import Motion
from .simulation import simulate


def simulate_blocks(
    oscillator: Oscillator, *, block: float = 10_000, **options: Any
) -> Iterator[Motion]:
    """The motion as `simulate` has it, in pieces that follow one another.

    Memory is that of one piece. All pieces are on the same clock; a contact or stick that the end
    of a piece cuts goes on in the next.

    Parameters
    ----------
    oscillator : Oscillator
        What moves.
    block : float
        Length of a piece: in forcing periods with `periods`, in seconds with `duration`.
    **options
        As for `simulate`.

    Yields
    ------
    Motion
        The last may be shorter; a motion whose status is not "complete" is the last.

    Raises
    ------
    InvalidInput
        As `simulate` does, when called.

    See Also
    --------
    simulate, read_blocks

    Examples
    --------
    >>> from impactsig import scenes, simulate_blocks
    >>> pieces = simulate_blocks(scenes.karpodinis(22.1), block=50, periods=120, transient=500)
    >>> [piece.impact_count for piece in pieces]
    [50, 50, 20]
    """
    if "keep" in options:
        raise InvalidInput(
            "keep", options["keep"], "no such option of pieces",
            'Use simulate(..., keep="counts") to count without keeping',
        )  # fmt: skip
    run = Run(oscillator, **options)
    return _pieces(run, number("block", block, above=0))


def _pieces(run: Run, block: float) -> Iterator[Motion]:
    done = 0.0
    while done < run.length:
        done = min(done + block, run.length)
        motion = run.motion(done)
        yield motion
        if motion.status != "complete":
            return


MACHINES = "an Oscillator or several"


def simulate_many(
    oscillators: Oscillator | Sequence[Oscillator],
    *,
    initial: Any = (0.0, 0.0),
    phase: Any = 0.0,
    workers: int | None = None,
    **options: Any,
) -> tuple[Motion, ...]:
    """Many motions in parallel: each is what `simulate` gives for it, to the last bit.

    Parameters
    ----------
    oscillators : Oscillator or sequence of Oscillator
        One for all, or one each.
    initial : array_like, shape (2,) or (n, 2)
        Displacement and velocity at t = 0, one for all or one each.
    phase : float or array_like, shape (n,)
        Phase of the forcing at t = 0 [rad].
    workers : int, optional
        Threads; as many as there are cores unless given.
    **options
        As for `simulate`; the same for all.

    Returns
    -------
    tuple of Motion
        In the order of what was given.

    Raises
    ------
    InvalidInput
        If the numbers of oscillators, initial states and phases differ, or as `simulate` does.

    See Also
    --------
    simulate, sweep

    Examples
    --------
    >>> from impactsig import scenes, simulate_many
    >>> beams = [scenes.karpodinis(frequency) for frequency in (22.0, 22.1)]
    >>> motions = simulate_many(beams, periods=50, transient=500, workers=1)
    >>> [motion.impact_count for motion in motions]
    [50, 50]
    """
    threads = thread_count(workers)
    starts = reals("initial", initial, "of each start a displacement and a velocity")
    phases = reals("phase", phase, "an angle [rad], or one for each start")
    if starts.ndim not in (1, 2) or starts.shape[-1] != 2:
        raise InvalidInput("initial", f"shape {starts.shape}", "shape (2,) or (n, 2)")
    alone = isinstance(oscillators, Oscillator)
    machines = [oscillators] if alone else list(entries("oscillators", oscillators, MACHINES))
    for machine in machines:
        without_noise(instance("oscillators", machine, Oscillator, MACHINES))
    counts = {len(machines), len(np.atleast_2d(starts)), phases.size} - {1}
    if len(counts) > 1 or phases.ndim > 1:
        raise InvalidInput(
            "oscillators, initial, phase",
            f"{len(machines)}, {len(np.atleast_2d(starts))}, {phases.size} of them",
            "as many of each, or one for all",
        )
    n = counts.pop() if counts else 1
    each = list(
        zip(
            machines * n if len(machines) == 1 else machines,
            np.broadcast_to(starts, (n, 2)),
            np.broadcast_to(phases, n),
            strict=True,
        )
    )

    def some(cases: list[tuple[Oscillator, np.ndarray, float]]) -> list[Motion]:
        return [
            simulate(machine, initial=(x, v), phase=at, **options) for machine, (x, v), at in cases
        ]

    size = max(1, min(64, n // (8 * threads)))  # short runs are not worth a task each
    tasks = [each[k : k + size] for k in range(0, n, size)]
    with ThreadPoolExecutor(threads) as pool:
        return tuple(chain.from_iterable(pool.map(some, tasks)))
