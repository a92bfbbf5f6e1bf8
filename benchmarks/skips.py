"""What each skip of the simulator saves: the same scene with and without it, and whether the
results are equal. Both are timed in turns in one process; writes results/skips.json and skips.md.

    python -m benchmarks.skips
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import impactsig
from impactsig import Force, Friction, Oscillator, Rigid, Stop, scenes
from impactsig.results import Motion

from .detection import markdown
from .saving import save, versions
from .simulation import seconds

REPEATS = 7


def compared(skip: str, scene: str, spare: Callable, full: Callable, differ: Callable) -> dict:
    """One row: `spare` skips the work that `full` does; `differ` says by how much they disagree."""
    less, more = spare(), full()
    times = np.array([(seconds(spare), seconds(full)) for _ in range(REPEATS)])
    return {
        "skip": skip,
        "scene": scene,
        "ms with": float(np.median(times[:, 0])) * 1e3,
        "ms without": float(np.median(times[:, 1])) * 1e3,
        "gain": float(np.median(times[:, 1] / times[:, 0])),
        "greatest difference": float(differ(less, more)),
    }


def ends(a: Motion, b: Motion) -> float:
    """Difference of the last states; infinite where impacts or sticks are not as many."""
    if (a.impact_count, a.stick_count) != (b.impact_count, b.stick_count):
        return np.inf
    return float(np.max(np.abs(np.subtract(a.final[:2], b.final[:2]))))


def unreachable() -> list[dict]:
    """A motion that can reach its stop no more is ended in one step."""
    rows = []
    for periods in (1e2, 1e4, 1e6):
        quiet = Oscillator(damping=0.1, forces=Force(0.1, 0.5), stops=(Stop(1, Rigid(0.5)),))

        def run(skip, quiet=quiet, periods=periods):
            return impactsig.simulate(
                quiet, periods=periods, initial=(0.9, 2.0), keep="counts", skip_unreachable=skip
            )

        rows.append(compared(
            "unreachable stop", f"decaying, {periods:g} periods", lambda run=run: run(True),
            lambda run=run: run(False), ends,
        ))  # fmt: skip
    beam = scenes.karpodinis(20.1)
    rows.append(compared(
        "unreachable stop", "chaotic beam: nothing to skip",
        lambda: impactsig.simulate(beam, periods=1e4, keep="counts"),
        lambda: impactsig.simulate(beam, periods=1e4, keep="counts", skip_unreachable=False), ends,
    ))  # fmt: skip
    return rows


def unasked() -> list[dict]:
    """Events are kept, and a motion is sampled, only where someone asks for it."""
    beam = scenes.karpodinis(20.1)

    def run(keep):
        return impactsig.simulate(beam, periods=1e4, keep=keep)

    def sampled():
        motion = run("all")
        motion.sample(np.linspace(motion.start, motion.stop, 1_000_000))
        return motion

    scene = "chaotic beam, 1e4 periods"
    return [
        compared("events not kept", scene, lambda: run("counts"), lambda: run("all"), ends),
        compared(
            "no samples, against 100 a period", scene, lambda: run("all"), sampled,
            lambda a, b: np.max(np.abs(a.impacts.time - b.impacts.time)),
        ),
    ]  # fmt: skip


def absent() -> list[dict]:
    """A scene pays for what it has: parts that do nothing, added to one that lacks them."""
    beam = scenes.karpodinis(22.1)
    parts = {
        "no friction, against one of 1e-300": replace(beam, friction=Friction(1e-300)),
        "one stop, against a second out of reach": replace(
            beam, stops=(*beam.stops, Stop(-1e6, Rigid(0.2), "lower"))
        ),
        "one force, against a second of 1e-300": replace(
            beam, forces=(*beam.forces, Force(1e-300, 0.7))
        ),
    }

    def run(machine):
        return impactsig.simulate(machine, periods=2e4, transient=100, keep="counts")

    return [
        compared(name, "periodic beam, 2e4 periods", lambda: run(beam), lambda m=more: run(m), ends)
        for name, more in parts.items()
    ]


def chatter() -> list[dict]:
    """Rebounds below a share of the greatest speed are summed, not followed one by one."""
    scene = scenes.okolewski(3, 0.6)

    def run(cut):
        return impactsig.simulate(scene, periods=4000, keep="counts", chatter=cut)

    return [
        compared(
            "chatter summed from 1e-6, against 1e-14", "moving base, 4000 periods",
            lambda: run(1e-6), lambda: run(1e-14),
            lambda a, b: np.max(np.abs(np.subtract(a.final[:2], b.final[:2]))),
        )
    ]  # fmt: skip


def main() -> None:
    rows = unreachable() + unasked() + absent() + chatter()
    text = markdown(rows)
    save("skips", {"about": versions("numpy", "numba"), "skips": rows}, text)
    print(text)


if __name__ == "__main__":
    main()
