"""Whether results are the same to the last bit: a hash of each of 91 short runs.

Every engine, every law of a stop and every question is among them. The hash is of the numbers of
the result alone, not of its names. What is the same on two versions of the code says that a change
of the one to the other is one of form. The hashes depend on the machine and on the versions of
numpy, scipy and numba, so none are kept in the repository.

    python -m benchmarks.bits > before.txt        # then change the code
    python -m benchmarks.bits --against before.txt
    python -m benchmarks.bits flow beam           # only those whose names hold one of the words
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

import impactsig as im

Run = Callable[[], Any]


# What moves.


def hard(amplitude: float = 1.0, damping: float = 0.1, **options: Any) -> im.Oscillator:
    return one(im.Rigid(0.7), amplitude, damping, **options)


def one(kind: Any, amplitude: float = 1.0, damping: float = 0.1, **options: Any) -> im.Oscillator:
    """A mass before one stop."""
    return im.Oscillator(
        damping=damping,
        forces=(im.Force(amplitude, 0.9),),
        stops=(im.Stop(0.5, kind),),
        **options,
    )


def between(kind: Any, **options: Any) -> im.Oscillator:
    """A mass between two stops."""
    stops = im.Stop(0.5, kind), im.Stop(-0.6, kind, "lower")
    return im.Oscillator(damping=0.1, forces=(im.Force(1.0, 0.9),), stops=stops, **options)


def rubbing(law: Any = None, static: float | None = 0.3) -> im.Oscillator:
    stops = (im.Stop(0.5, law),) if law else ()
    return im.Oscillator(
        damping=0.02,
        forces=(im.Force(0.8, 0.7),),
        stops=stops,
        friction=im.Friction(0.2, static),
    )


def chattering() -> im.Oscillator:
    """A weight on a shaken table."""
    table = im.Stop(0.0, im.Rigid(0.6), "lower")
    return im.Oscillator(stiffness=0.01, load=-1.0, forces=(im.Force(1.2, 1.0),), stops=(table,))


def slowing(v: float) -> float:
    """Restitution by the approach velocity."""
    return 0.9 / (1.0 + 0.1 * v)


def cubic(t: float, x: float, v: float) -> float:
    return -0.3 * x * x * x - 0.05 * v * abs(v)


def ringing(t: float, y: Any, a: float, w: float) -> Any:
    return y[1], -y[0] - 0.1 * y[1] - y[0] ** 3 + a * np.cos(w * t)


def noisy(intensity: float = 0.1, stop: float | None = None, **options: Any) -> im.Oscillator:
    stops = (im.Stop(stop, im.Rigid(0.8)),) if stop is not None else ()
    return im.Oscillator(damping=0.2, noise=im.Noise(intensity), stops=stops, **options)


BEAM = im.Cantilever(0.2, 0.02, 0.001, 2e11, 7800.0)
SHAKEN = im.BaseMotion(1e-3, 10.0)


# Questions.


def motion(oscillator: im.Oscillator, **options: Any) -> list[Any]:
    """All that a motion says: events, impacts, counts, samples, sections."""
    options = {"periods": 60.0, "transient": 5.0, **options}
    found = im.simulate(oscillator, **options)
    return seen(found)


def seen(found: Any) -> list[Any]:
    time = np.linspace(found.start, found.stop, 501)
    return [
        found._segments, found.impacts, found.sticks, found.impact_count, found.stick_count,
        found.energy_lost, found.final, found.sample(time), found.stroboscopic(0.3),
    ]  # fmt: skip


def counts(oscillator: im.Oscillator, **options: Any) -> list[Any]:
    found = im.simulate(oscillator, keep="counts", **{"periods": 300.0, **options})
    return [found.impact_count, found.stick_count, found.energy_lost, found.final]


def beam(stop: Any, **options: Any) -> list[Any]:
    parts = {"modes": 4, "forcing": SHAKEN, "stop": stop}
    parts |= {name: options.pop(name) for name in ("modes", "forcing") if name in options}
    found = im.simulate(replace(BEAM, **parts), **{"periods": 40.0, "transient": 3.0, **options})
    time = np.linspace(found.start, found.start + found.duration, 201)
    return [found._rows, found.impacts, found.sticks, found.final, found.sample(time)]


def restitution_of_beam() -> Any:
    stop = im.Stop(1e-3, im.Rigid(0.7))
    found = im.simulate(replace(BEAM, stop=stop, modes=3, forcing=SHAKEN), periods=30)
    return im.apparent_restitution(found)


def states(flow: im.Flow) -> Any:
    time = 5.0 + 0.1 * np.arange(300)
    return im.simulate(flow, duration=time[-1] - 5.0, transient=5.0).sample(time)


def ringing_flow() -> im.Flow:
    return im.Flow(ringing, (1.0, 0.0), (0.5, 1.2))


def delayed(oscillator: im.Oscillator, **options: Any) -> list[Any]:
    feedback = im.DelayedFeedback(**{"gain": 0.15, **options})
    found = im.simulate(im.Controlled(oscillator, feedback, start=4.0), periods=30)
    return [seen(found), found.force(np.linspace(found.start, found.stop, 301))]


def delayed_flow() -> list[Any]:
    feedback = im.DelayedFeedback(0.2, delay=5.88, signal="y")
    found = im.simulate(im.Controlled(im.flows.rossler(), feedback, start=20.0), duration=80.0)
    time = np.linspace(0.0, 80.0, 201)
    return [found.sample(time), found.force(time)]


@cache
def saddle() -> im.results.PeriodicOrbit:
    found = im.find_periodic_orbits(im.scenes.karpodinis(20.1), guesses=60)
    return next(orbit for orbit in found if abs(orbit.multipliers).max() > 1)


def nudged() -> list[Any]:
    found = im.simulate(
        im.Controlled(im.scenes.karpodinis(20.1), im.OGY(saddle(), 0.1)), periods=120
    )
    return seen(found)


def stability(oscillator: im.Oscillator) -> list[Any]:
    orbit = im.find_periodic_orbit(oscillator)
    return [orbit, im.orbit_stability(orbit, im.DelayedFeedback(0.1), laps=100)]


def ensemble(oscillator: im.Oscillator, **options: Any) -> Any:
    return im.simulate_ensemble(oscillator, **{"paths": 40, "duration": 40.0, "seed": 1, **options})


def path(oscillator: im.Oscillator, **options: Any) -> Any:
    found = im.simulate(oscillator, **{"duration": 40.0, "seed": 1, **options})
    return [found.time, found.x, found.v, found.impacts, found.step]


def flow_orbit() -> list[Any]:
    orbit = im.find_periodic_orbit(im.flows.rossler(), period=5.88)
    feedback = im.DelayedFeedback(0.2, delay=orbit.period, signal="y")
    return [orbit, im.orbit_stability(orbit, feedback, laps=60)]


def sections() -> list[Any]:
    found = im.simulate(hard(), periods=40)
    return [im.impact_map(found), im.displacement_section(found, 0.1, "both")]


def instruments() -> list[Any]:
    found = im.simulate(hard(), periods=30)
    return [
        im.synthesize(found.impacts, "force", rate=2000.0, seed=1).samples,
        im.synthesize(found.impacts, "sound", rate=20_000.0, seed=1).samples,
        im.synthesize(
            im.simulate(one(im.KelvinVoigt(50.0, 0.5)), periods=9).impacts, rate=2000.0, seed=2
        ),
        im.measure(found, jitter=0.01, missed=0.1, spurious=0.05, echoes=0.1, seed=3),
        im.measure(found, noise=0.01, rate=200.0, seed=4),
        found.power_spectrum(rate=5.0),
    ]


def soft(amplitude: float, damping: float = 0.1) -> im.Oscillator:
    return one(im.KelvinVoigt(50.0, 0.5), amplitude, damping)


def hertz(amplitude: float) -> im.Oscillator:
    return one(im.Hertz(50.0, damping=0.05), amplitude)


AMPLITUDES = np.linspace(0.8, 1.4, 7)

RUNS: dict[str, Run] = {
    # The exact engine
    "exact, free": partial(motion, im.Oscillator(damping=0.1, forces=(im.Force(1.0, 0.9),))),
    "exact, hard": partial(motion, hard()),
    "exact, hard, two stops": partial(motion, between(im.Rigid(0.8))),
    "exact, restitution a function": partial(motion, one(im.Rigid(slowing))),
    "exact, soft": partial(motion, one(im.KelvinVoigt(50.0, 0.5))),
    "exact, soft, force": partial(motion, one(im.KelvinVoigt(50.0, 2.0, "force"))),
    "exact, soft, two stops": partial(motion, between(im.KelvinVoigt(80.0, 1.0))),
    "exact, soft and hard": partial(
        motion,
        im.Oscillator(
            damping=0.1,
            forces=(im.Force(2.0, 0.9),),
            stops=(im.Stop(0.3, im.KelvinVoigt(9.0, 0.1)), im.Stop(0.6, im.Rigid(0.6))),
        ),
    ),
    "exact, trilinear": partial(motion, between(im.KelvinVoigt(4.0))),
    "exact, friction": partial(motion, rubbing()),
    "exact, friction, hard": partial(motion, rubbing(im.Rigid(0.6))),
    "exact, friction, soft": partial(motion, rubbing(im.KelvinVoigt(60.0, 0.2), None)),
    "exact, chatter and stick": partial(motion, chattering()),
    "exact, two forces": partial(
        motion,
        im.Oscillator(
            damping=0.1,
            forces=(im.Force(0.8, 0.9), im.Force(0.5, 1.7, 0.4)),
            stops=(im.Stop(0.4, im.Rigid(0.7)),),
        ),
    ),
    "exact, moving base": partial(motion, im.scenes.karpodinis(22.1)),
    "exact, moving stops": partial(
        motion,
        im.Oscillator(
            damping=0.1,
            base=im.BaseMotion(0.8, 0.9, stops=True),
            stops=(im.Stop(0.3, im.KelvinVoigt(40.0, 0.3)),),
        ),
    ),
    "exact, overdamped": partial(motion, one(im.KelvinVoigt(20.0, 30.0))),
    "exact, no forcing": partial(
        motion,
        im.Oscillator(load=0.3, damping=0.05, stops=(im.Stop(0.2, im.Rigid(0.8)),)),
        periods=None,
        duration=80.0,
        initial=(-1.0, 0.0),
    ),
    "exact, counts": partial(counts, hard()),
    "exact, scenes": lambda: [
        motion(im.scenes.tian(1.2, 0.9)),
        motion(im.scenes.begley_virgin(0.5, 0.4, 0.1)),
        motion(im.scenes.okolewski(1.3, 0.7, "soft")),
    ],
    "exact, many": lambda: [
        seen(own) for own in im.simulate_many([hard(), hard(1.2)], periods=20, workers=1)
    ],
    # The stepping engine
    "stepped, hertz": partial(motion, one(im.Hertz(50.0, damping=0.05))),
    "stepped, hertz, two stops": partial(motion, between(im.Hertz(80.0, damping=0.1))),
    "stepped, hertz, restitution": partial(motion, one(im.Hertz(50.0, restitution=0.7))),
    "stepped, law": partial(motion, one(im.Rigid(0.7), law=cubic)),
    "stepped, law, hertz": partial(motion, between(im.Hertz(80.0), law=cubic)),
    "stepped, linear": partial(motion, hard(), method=im.RungeKutta(1e-9)),
    "stepped, restitution a function": partial(
        motion, one(im.Rigid(slowing)), method=im.RungeKutta()
    ),
    "stepped, soft": partial(
        motion, between(im.KelvinVoigt(50.0, 2.0, "force")), method=im.RungeKutta()
    ),
    "stepped, friction": partial(motion, rubbing(im.Rigid(0.6)), method=im.RungeKutta()),
    "stepped, chatter and stick": partial(motion, chattering(), method=im.RungeKutta()),
    "stepped, moving base, law": partial(
        motion,
        im.Oscillator(
            damping=0.1,
            base=im.BaseMotion(0.8, 0.9, stops=True),
            stops=(im.Stop(0.3, im.Rigid(0.7)),),
            law=cubic,
        ),
    ),
    "stepped, fixed step": partial(motion, hard(), method=im.FixedStep(200)),
    "stepped, fixed step, hertz": partial(
        motion, one(im.Hertz(50.0, damping=0.05)), method=im.FixedStep(400)
    ),
    "stepped, counts": partial(counts, one(im.Hertz(50.0, damping=0.05)), periods=100.0),
    # The modal engine
    "beam, rigid": partial(beam, im.Stop(1e-3, im.Rigid(0.7))),
    "beam, rigid, plastic": partial(beam, im.Stop(1e-3, im.Rigid(0.0))),
    "beam, soft": partial(beam, im.Stop(1e-3, im.KelvinVoigt(5e4, 2.0))),
    "beam, soft, lower": partial(
        beam, im.Stop(-1e-3, im.KelvinVoigt(5e4, 2.0), "lower"), forcing=im.Force(0.5, 60.0)
    ),
    "beam, no stop": partial(beam, None),
    "beam, restitution": restitution_of_beam,
    # Flows
    "flow, lorenz": partial(states, im.flows.lorenz()),
    "flow, rossler": partial(states, im.flows.rossler()),
    "flow, forced": lambda: states(ringing_flow()),
    "flow, firing": lambda: [
        im.integrate_and_fire(im.flows.rossler(), 5.0, count=60),
        im.integrate_and_fire(im.flows.lorenz(), 20.0, count=60),
    ],
    "flow, crossings": lambda: [
        im.threshold_crossings(im.flows.rossler(), 0.0, count=60),
        im.threshold_crossings(im.flows.lorenz(), 5.0, signal="x", direction="both", count=60),
    ],
    "flow, exponents": lambda: im.lyapunov_spectrum(im.flows.lorenz(), duration=30.0),
    "flow, orbit and stability": flow_orbit,
    # Feedback
    "delayed, hard": lambda: delayed(hard()),
    "delayed, displacement, limit": lambda: delayed(hard(), signal="displacement", limit=0.05),
    "delayed, memory": lambda: delayed(hard(), memory=0.4),
    "delayed, soft": lambda: delayed(one(im.KelvinVoigt(50.0, 0.5))),
    "delayed, hertz, law": lambda: delayed(one(im.Hertz(50.0, damping=0.05), law=cubic)),
    "delayed, friction": lambda: delayed(rubbing(im.Rigid(0.6)), limit=0.03),
    "delayed, chatter and stick": lambda: delayed(chattering(), gain=0.05),
    "delayed, flow": delayed_flow,
    "delayed, stability": lambda: stability(hard()),
    "ogy": nudged,
    # Noise
    "noisy, splitting": lambda: ensemble(noisy(stop=0.4)),
    "noisy, splitting, friction": lambda: ensemble(
        im.scenes.van_der_pol_duffing(), paths=20, duration=20.0
    ),
    "noisy, runge-kutta": lambda: ensemble(noisy(stop=0.4), method="runge-kutta"),
    "noisy, zhuravlev": lambda: ensemble(noisy(stop=0.0), method="zhuravlev"),
    "noisy, gaussian": lambda: ensemble(noisy(stop=0.4), method="gaussian"),
    "noisy, path, splitting": lambda: path(noisy(stop=0.4)),
    "noisy, path, runge-kutta": lambda: path(noisy(stop=0.4), method="runge-kutta"),
    "noisy, path, gaussian": lambda: path(noisy(stop=0.4), method="gaussian"),
    "noisy, averaging": lambda: im.averaged_density(im.scenes.van_der_pol_duffing()),
    # Questions of dynamics
    "tangent, exact": lambda: im.tangent_map(hard(), periods=9),
    "tangent, exact, soft": lambda: im.tangent_map(between(im.KelvinVoigt(80.0, 1.0)), periods=9),
    "tangent, exact, friction": lambda: im.tangent_map(rubbing(im.Rigid(0.6)), periods=9),
    "tangent, stepped": lambda: im.tangent_map(one(im.Hertz(50.0, restitution=0.7)), periods=9),
    "exponents, exact": lambda: im.lyapunov_spectrum(between(im.Rigid(0.8)), periods=200),
    "exponents, stick": lambda: im.lyapunov_spectrum(rubbing(im.Rigid(0.6)), periods=100),
    "exponents, stepped": lambda: im.lyapunov_spectrum(one(im.Hertz(50.0)), periods=40),
    "orbit, hard": lambda: im.find_periodic_orbit(hard()),
    "orbit, hertz": lambda: im.find_periodic_orbit(hertz(1.0)),
    "orbits": lambda: im.find_periodic_orbits(hard(), guesses=8),
    "saddle": saddle,
    "continuation": lambda: im.continue_orbit(hard, [1.0, 1.1]),
    "diagram": lambda: im.bifurcation_diagram(
        hard, AMPLITUDES, periods=30, transient=60, exponents=True, workers=1
    ),
    "diagram, soft, carried": lambda: im.bifurcation_diagram(
        soft, AMPLITUDES, periods=30, transient=60, carry=True, workers=1
    ),
    "diagram, hertz": lambda: im.bifurcation_diagram(
        hertz, AMPLITUDES[:3], periods=8, transient=10, workers=1
    ),
    "chart": lambda: im.periodicity_chart(
        hard, AMPLITUDES, [0.05, 0.1, 0.2], periods=120, workers=1
    ),
    "chart, soft": lambda: im.periodicity_chart(
        soft, AMPLITUDES, [0.05, 0.1], periods=120, workers=1
    ),
    "response": lambda: im.response_spectrum(hard, AMPLITUDES, periods=10, transient=60, workers=1),
    "basins": lambda: im.basins_of_attraction(
        hard(), np.linspace(-1, 0.4, 9), np.linspace(-1, 1, 9), workers=1
    ),
    "sections": sections,
    "period": lambda: im.orbit_period(im.simulate(hard(), periods=60, transient=200)),
    "equivalence": lambda: [
        im.equivalence_error(im.KelvinVoigt(1000.0, 5.0), 0.7),
        im.fit_soft_stop(0.7, evaluations=200, seed=0),
    ],
    "match rate": lambda: im.match_rate(
        hard, soft, AMPLITUDES[:3], [0.1, 0.2], periods=9, transient=20, workers=1
    ),
    # Instruments
    "instruments": instruments,
}


# Hashes.


def hash_of(value: Any) -> str:
    """First 16 hexadecimal digits of the SHA-256 of all numbers in it, in order."""
    digest = hashlib.sha256()
    _add(value, digest)
    return digest.hexdigest()[:16]


def _add(value: Any, digest: Any) -> None:
    if value is None or isinstance(value, (str, im.Oscillator, im.Flow)):
        digest.update(b"-")
    elif isinstance(value, np.ndarray) and value.dtype == object:
        _add(value.tolist(), digest)
    elif isinstance(value, (bool, int, float, complex, np.ndarray, np.generic)):
        array = np.ascontiguousarray(value)
        if array.dtype.kind in "iub":
            array = array.astype(np.int64)
        digest.update(repr(array.shape).encode() + array.tobytes())
    elif isinstance(value, Mapping):
        _add(list(value.values()), digest)
    elif isinstance(value, (list, tuple)):
        for part in value:
            _add(part, digest)
    elif is_dataclass(value):
        _add([getattr(value, f.name) for f in fields(value) if f.name[0] != "_"], digest)
    elif not callable(value):
        raise TypeError(f"no numbers are known of a {type(value).__name__}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("words", nargs="*", help="only runs whose names hold one of them")
    parser.add_argument("--against", type=Path, help="hashes to compare with")
    options = parser.parse_args()
    before: dict[str, str] = {}
    if options.against:
        lines = options.against.read_text().splitlines()
        before = {name: own for own, name in (line.split("  ", 1) for line in lines)}
    differ, done = 0, 0
    for name, run in RUNS.items():
        if options.words and not any(word in name for word in options.words):
            continue
        found = hash_of(run())
        done += 1
        if not options.against:
            print(f"{found}  {name}", flush=True)
        elif before.get(name) != found:
            differ += 1
            print(f"differs: {name}: {before.get(name, 'none')} before, {found} now", flush=True)
    if options.against:
        missing = set() if options.words else set(before) - set(RUNS)
        print(
            f"{done - differ} of {done} runs are the same"
            + (f"; missing: {missing}" * bool(missing))
        )
        return int(differ > 0 or bool(missing))
    return 0


if __name__ == "__main__":
    sys.exit(main())
