"""Runs beyond one Motion: in pieces of bounded memory, and many at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from ..._arguments import choice, entries, flag, instance, number, reals, thread_count
from ..._running.threads import in_threads
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...oscillators.batch import OscillatorBatch
from ...studies.device import Executor, on_gpu
from ..basis.columns import Columns, columns_of_forms, spread
from ..exact.exact import piecewise_linear
from ..exact.modes import stacks
from ..exact.starts import first_phases
from ..motion import Motion
from ..run import Run, span, without_noise
from ..simulation import CHATTER, simulate
from .motions import Motions
from .moving import Moving, takes


def simulate_blocks(
    oscillator: Oscillator, *, block: float = 10_000, **options: Any
) -> Iterator[Motion]:
    """Simulate a system in consecutive blocks; joined, they equal the motion of `simulate`.

    Memory is that of one block. All blocks have the same clock; a contact or stick at the end of a
    block continues in the next.

    Parameters
    ----------
    oscillator : Oscillator
        The system.
    block : float
        Length of a block: in forcing periods with `periods`, in seconds with `duration`.
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
NO_GPU = "threads where a law, a Hertz stop or method= has motions stepped"
EXACT = frozenset(
    ("periods", "duration", "transient", "method", "chatter", "keep", "skip_unreachable")
)


def simulate_many(
    oscillators: Oscillator | Sequence[Oscillator],
    *,
    initial: Any = (0.0, 0.0),
    phase: Any = 0.0,
    executor: Executor = "threads",
    workers: int | None = None,
    **options: Any,
) -> Motions:
    """Simulate many systems in parallel; each motion equals that of `simulate` bit for bit.

    Oscillators that are linear between events are moved together by one compiled call a thread.

    Parameters
    ----------
    oscillators : Oscillator, OscillatorBatch or sequence of Oscillator
        One oscillator for all motions, or one each. A batch, made by a scene from arrays, is
        fastest.
    initial : array_like, shape (2,) or (n, 2)
        Displacement and velocity at t = 0, one for all or one each.
    phase : float or array_like, shape (n,)
        Phase of the forcing at t = 0 [rad].
    executor : {"threads", "gpu"}
        Where they are computed. A GPU (NVIDIA, with ``impactsig[gpu]``) takes oscillators that are
        linear between events, with numbers as restitution coefficients. Its trigonometric functions
        may differ in the last bits, which changes a chaotic motion.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.
    **options
        As for `simulate`; the same for all.

    Returns
    -------
    Motions
        A sequence of `Motion` in the given order, each created on access, and arrays of their
        numbers.

    Raises
    ------
    InvalidInput
        If the numbers of oscillators, initial states and phases differ, if there is no GPU or it
        does not support them, or as `simulate` does.
    MissingExtra
        If ``impactsig[gpu]`` is needed and not there.

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
    gpu = on_gpu(executor, workers)
    threads = thread_count(workers)
    starts = reals("initial", initial, "of each start a displacement and a velocity")
    phases = reals("phase", phase, "an angle [rad], or one for each start")
    alone = isinstance(oscillators, Oscillator)
    batch = oscillators if isinstance(oscillators, OscillatorBatch) else None
    if starts.ndim == 0 or starts.shape[-1] != 2:
        raise InvalidInput("initial", f"shape {starts.shape}", "shape (2,) or (n, 2)")
    machines: Any = batch
    if batch is None:
        machines = [oscillators] if alone else list(entries("oscillators", oscillators, MACHINES))
        for machine in machines:
            without_noise(instance("oscillators", machine, Oscillator, MACHINES))
    counts = {len(machines), starts.size // 2, phases.size} - {1}
    if len(counts) > 1 or (batch is None and (starts.ndim > 2 or phases.ndim > 1)):
        raise InvalidInput(
            "oscillators, initial, phase",
            f"{len(machines)}, {starts.size // 2}, {phases.size} of them",
            "as many of each, or one for all",
        )
    n = counts.pop() if counts else 1
    starts = np.ascontiguousarray(np.broadcast_to(starts.reshape(-1, 2), (n, 2)))
    phases = np.ascontiguousarray(np.broadcast_to(phases.ravel(), n))
    exact, others = _sorted(machines, n, options)
    if others and gpu:
        raise InvalidInput("executor", executor, NO_GPU, 'Take executor="threads"')

    def one(k: int) -> Motion:
        machine = machines[k if len(machines) > 1 else 0]
        start = tuple(starts[k].tolist())
        return simulate(machine, initial=start, phase=float(phases[k]), **options)

    found = dict(zip(others, in_threads(one, others, threads, " runs"), strict=True))
    moved = _moved(exact, starts, phases, threads, gpu, **options) if exact else []
    shape: tuple[int, ...] = (n,)
    parameters: Mapping[str, np.ndarray] = {}
    if batch is not None and len(batch) == n:
        shape, parameters = batch.shape, batch.parameters
    return Motions(machines, shape, moved, found, options.get("keep") != "counts", parameters)


def move(batch: OscillatorBatch, *, initial: Any = (0.0, 0.0), phase: Any = 0.0,
    periods: float | None = None, duration: float | None = None, transient: float = 0.0,
    chatter: float = CHATTER, keep: Literal["all", "counts"] = "all",
    skip_unreachable: bool = True,
) -> Motions:  # fmt: skip
    """The motions of a batch."""
    return simulate_many(
        batch, initial=initial, phase=phase, periods=periods, duration=duration,
        transient=transient, chatter=chatter, keep=keep, skip_unreachable=skip_unreachable,
    )  # fmt: skip


def _sorted(
    machines: Any, n: int, options: dict[str, Any]
) -> tuple[list[tuple[np.ndarray, Columns]], list[int]]:
    """Numbers and columns of the machines of each form; and those to be moved one by one."""
    if options.get("method") is not None or not set(options) <= EXACT:
        return [], list(range(n))
    if isinstance(machines, OscillatorBatch):
        return [(np.arange(n), spread(machines.columns, n))], []
    if len(machines) == 1:
        if piecewise_linear(machines[0]):
            return [(np.arange(n), spread(machines[0], n))], []
        return [], list(range(n))
    others = [k for k, machine in enumerate(machines) if not piecewise_linear(machine)]
    exact = np.setdiff1d(np.arange(n), others)
    forms = columns_of_forms([machines[k] for k in exact])
    return [(exact[which], columns) for which, columns in forms], others


def _moved(
    exact: list[tuple[np.ndarray, Columns]], starts: np.ndarray, phases: np.ndarray, threads: int,
    gpu: bool, *, periods: float | None = None, duration: float | None = None,
    transient: float = 0.0, method: None = None, chatter: float = CHATTER, keep: str = "all",
    skip_unreachable: bool = True,
) -> list[tuple[np.ndarray, Moving]]:  # fmt: skip
    """Machines moved past the transient and through the span, stack by stack."""
    choice("keep", keep, ("all", "counts"))
    chatter = number("chatter", chatter, above=0, most=1e-2)
    skip = flag("skip_unreachable", skip_unreachable)
    phases = first_phases(phases)
    if not np.isfinite(starts).all():
        raise InvalidInput("initial", starts, "finite displacements and velocities")
    found = []
    for which, columns in exact:
        if gpu:
            takes(columns.form)
        forced = columns.form.forces > 0 or columns.form.base is not None
        length, before = span(periods, duration, transient, forced)
        for stack in stacks(columns, chatter, skip):
            mine = which[stack.which]
            moving = Moving(stack, starts[mine], phases[mine])
            moving.on_gpu = gpu
            per_turn = moving.per_turn(duration is not None)
            if before > 0:
                moving.to(before * per_turn, False, threads)
            moving.forget()
            moving.to((before + length) * per_turn, keep == "all", threads)
            found.append((mine, moving))
    return found
