"""A beam before a stop at its tip: what it costs to follow, and its apparent restitution.

First, of a beam driven near its first natural frequency, processor time and impacts per forcing
period over the number of modes. Then, of a beam that swings through its place of rest, where the
stop is, the apparent restitution coefficient over the number of modes for several coefficients of
the tip, rigid, and for a soft stop. Prints tables.

    python -m benchmarks.beam
"""

from __future__ import annotations

import math
import time
from dataclasses import replace

from impactsig import (
    BaseMotion,
    Cantilever,
    KelvinVoigt,
    Rigid,
    Stop,
    apparent_restitution,
    simulate,
)

BEAM = Cantilever(0.2, 0.025, 1e-3, 210e9, 7850.0)
FIRST = float(BEAM.frequencies(1)[0])
MODES = (1, 2, 4, 8, 12, 16, 24, 32, 64)


def speed(periods=200):
    forcing = BaseMotion(2e-4, 2 * math.pi * 20, stops=True)
    print("modes  microseconds  impacts  sticks, per forcing period")
    for modes in MODES[:-1]:
        options = {"modes": modes, "forcing": forcing, "periods": periods}
        spent = []
        for _ in range(3):
            start = time.thread_time()
            motion = simulate(replace(BEAM, stop=Stop(1e-3, Rigid(0.5))), **options)
            spent.append(time.thread_time() - start)
        print(
            f"{modes:5}  {1e6 * min(spent) / periods:12.1f}  {len(motion.impacts) / periods:7.2f}"
            f"  {len(motion.sticks) / periods:6.2f}"
        )


def apparent(ratio):
    stops = [Rigid(r) for r in (0.1, 0.5, 0.8, 0.95)] + [KelvinVoigt(2e4, 0.5)]
    print(f"\nthrown at a stop at its place of rest, damping ratio {ratio:g} of every mode")
    print("modes" + "".join(f"   tip {law.restitution:<4g}" for law in stops[:-1]) + "       soft")
    for modes in MODES:
        values = []
        for law in stops:
            motion = simulate(
                replace(BEAM, stop=Stop(0.0, law), modes=modes, damping_ratio=ratio),
                duration=0.8 / FIRST,
                initial=(0.0, 1.0),
            )
            values.append(apparent_restitution(motion).value)
        print(f"{modes:5}" + "".join(f"{value:11.4f}" for value in values))


if __name__ == "__main__":
    speed()
    for ratio in (0.03, 0.01, 0.0):
        apparent(ratio)
