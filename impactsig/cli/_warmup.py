"""`impactsig warmup`: compile kernels once, on all cores, before they are first needed.

A kernel is compiled for the types of its arguments, so the surest way to have it is to do what
needs it. Each task here does on something short what a command or a function does; processes
that need the same kernel wait for the one that compiles it.
"""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from .._running.watched import watched
from ..errors import ImpactsigError


def warmed_up(workers: int | None) -> Iterator[str]:
    """Run the tasks on so many processes; yields the output line by line."""
    from ..studies.each import each

    began = time.monotonic()
    # From the beginning, where somebody watches: the first task ends late.
    ends = each(_do, list(TASKS), workers=workers, progress=watched() or None)
    failed = [
        f"{name}: {error}" for name, error in zip(TASKS, ends, strict=True) if error is not None
    ]
    if failed:
        raise ImpactsigError(f"not all kernels could be compiled: {'; '.join(failed)}")
    yield f"compiled for this machine in {time.monotonic() - began:.0f} s"


def _do(name: str) -> None:
    with contextlib.redirect_stdout(io.StringIO()), TemporaryDirectory() as folder:
        TASKS[name](Path(folder))


def _force(folder: Path) -> None:
    from ..report import analyse_to_page
    from ._files import sample

    record = sample("loadcell_chaotic_20.1Hz.wav")
    analyse_to_page(record, folder / "page.html", unit="V", forcing_period=1 / 20.1)


def _uncommon_force(_: Path) -> None:
    """Pulses that the family of shapes misses, and some that touch: few records have any."""
    from ..detect import detect_impacts
    from ..recording import Recording

    rng, u = np.random.default_rng(1), np.arange(40) / 40.0
    half_sine = np.sin(np.pi * u)
    samples = 1e-3 * rng.standard_normal(40_000)
    for first in range(1000, 38_000, 1000):
        if first % 4000:
            samples[first : first + 40] += half_sine * (1.0 + 0.3 * np.sin(9.0 * u))
        else:
            samples[first : first + 40] += half_sine
            samples[first + 34 : first + 74] += 0.8 * half_sine
    detect_impacts(Recording(samples, 20_000.0, sensor="force"))


def _sound(folder: Path) -> None:
    from ..report import analyse_to_page
    from ._files import sample

    analyse_to_page(sample("sound_chaotic_20.1Hz.flac"), folder / "page.html")


def _dynamics_of_intervals(folder: Path) -> None:
    from ..oscillators import scenes
    from ..simulation import simulate
    from . import main

    impacts = simulate(scenes.karpodinis(20.1), periods=300, transient=50).impacts
    assert impacts is not None
    impacts.to_csv(folder / "impacts.csv")
    main(["dimension", str(folder / "impacts.csv"), "--surrogates", "--exponent"])


def _machines(_: Path) -> None:
    from ..oscillators import scenes
    from ..simulation import simulate, simulate_many

    karpodinis = scenes.karpodinis(20.1)
    for machine in (
        karpodinis,
        scenes.begley_virgin(1.338, 1.6, 0.05),
        scenes.okolewski(2.6, 0.6, "soft"),
    ):
        simulate(machine, periods=20).plot()
    simulate_many([karpodinis] * 2, periods=5, workers=1)


def _stepped(_: Path) -> None:
    from ..oscillators import flows, scenes
    from ..simulation import RungeKutta, simulate

    simulate(scenes.karpodinis(), periods=5, method=RungeKutta())
    simulate(flows.rossler(), duration=20.0)
    quiet = replace(scenes.van_der_pol_duffing(), noise=None)
    simulate(quiet, duration=20.0, initial=(0.5, 0.0))


def _noise(_: Path) -> None:
    from ..oscillators import scenes
    from ..stochastic.ensembles import simulate_ensemble

    simulate_ensemble(scenes.van_der_pol_duffing(), paths=4, duration=20.0, seed=1)


def _exponents(_: Path) -> None:
    from ..dynamics.tangents.lyapunov import lyapunov_spectrum
    from ..oscillators import scenes

    lyapunov_spectrum(scenes.karpodinis(20.1), periods=20)
    both = scenes.karpodinis(np.array([20.1, 22.1]))  # type: ignore[arg-type]
    lyapunov_spectrum(both, periods=20)


def _orbits(_: Path) -> None:
    from ..dynamics.diagrams.diagrams import bifurcation_diagram
    from ..dynamics.periodic.continuation import continue_orbit
    from ..oscillators import scenes

    continue_orbit(scenes.karpodinis, [22.1, 22.12])
    bifurcation_diagram(scenes.karpodinis, [22.1, 22.2], periods=5, transient=5, seed=1)


def _maps(_: Path) -> None:
    from ..dynamics.diagrams.basins import basins_of_attraction
    from ..dynamics.diagrams.charts import periodicity_chart
    from ..oscillators import scenes

    basins_of_attraction(scenes.karpodinis(), [0.0, 0.5], [0.0, 0.5])
    periodicity_chart(
        lambda f, a: scenes.karpodinis(f, amplitude=a), [22.1], [0.25, 0.26], periods=5, workers=1
    )


def _control(_: Path) -> None:
    from ..control.controlling import Controlled
    from ..control.feedback import DelayedFeedback
    from ..oscillators import scenes
    from ..simulation import RungeKutta, simulate

    locked = Controlled(scenes.karpodinis_control(), DelayedFeedback(0.1))
    for method in (None, RungeKutta()):  # by power series, and by steps as Hertz stops are
        simulate(locked, periods=10, method=method)


TASKS: dict[str, Callable[[Path], None]] = {
    "force": _force,
    "uncommon force": _uncommon_force,
    "machines": _machines,
    "sound": _sound,
    "dynamics of intervals": _dynamics_of_intervals,
    "stepped": _stepped,
    "exponents": _exponents,
    "control": _control,
    "maps": _maps,
    "noise": _noise,
    "orbits": _orbits,
}
"""The longest first."""
