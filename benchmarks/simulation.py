"""The exact engine beside general integrators: error against time on seven scenes.

Every scene is a mass and one stop, told by the gap between them, with a reference of forty digits
for its first 20 impacts (`tests/naive_simulate.py`). scipy's solvers start again at every event;
heyoka does in the callback of a terminal event what the stop does. Of ours and heyoka the time per
impact is that of a long run, of scipy that of the first 20. Writes results/simulation.json and
simulation.md.

    python -m benchmarks.simulation           # needs: pip install -e ".[benchmarks,test]"
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import impactsig
from impactsig import (
    FixedStep,
    Force,
    Friction,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    scenes,
)
from tests import naive, naive_simulate
from tests.naive_simulate import Machine

from .detection import markdown
from .saving import save, versions

COUNT = 20
REPEATS = 7
TOLERANCES = (1e-6, 1e-9, 1e-12)


@dataclass(frozen=True)
class Case:
    """A scene for the engine, and the same one by its gap, with the gap's start."""

    name: str
    oscillator: Oscillator
    initial: tuple[float, float]
    machine: Machine
    gap: float
    speed: float
    methods: tuple[str, ...] = ("RK45", "DOP853")


def one_sided(name: str, zeta, amplitude, omega, restitution, initial=(0.0, 0.0)) -> Case:
    oscillator = Oscillator(
        damping=2 * zeta, forces=Force(amplitude, omega), stops=(Stop(1, Rigid(restitution)),)
    )
    machine = naive_simulate.one_sided(zeta, amplitude, omega, restitution=restitution)
    return Case(name, oscillator, initial, machine, 1 - initial[0], -initial[1])


def moving_base(name: str, stop: str, stiffness: float = 2e5) -> Case:
    """Okolewski's machine at eta = 3, r = 0.6, let go 0.01 above the base."""
    oscillator = scenes.okolewski(3, 0.6, stop, stop_stiffness=stiffness)  # type: ignore[arg-type]
    known = {"restitution": 0.6}
    if stop == "soft":
        law = KelvinVoigt.equivalent(0.6, stiffness)
        known = {"stop_stiffness": law.stiffness, "stop_damping": law.damping}
    swing = 0.0025
    machine = Machine(1, 0.23, 0, -0.23 * 3 * swing, 9 * swing, 3, **known)
    methods = ("RK45", "DOP853") if stop == "hard" else ("RK45", "DOP853", "LSODA", "Radau")
    return Case(name, oscillator, (0.01, 0.0), machine, 0.01, -3 * swing, methods)


def rubbing(name: str) -> Case:
    """As Begley and Virgin's: theta'' + 2 h theta' + theta = 2 h g cos + sin, friction 0.05."""
    h, g, f = 0.02, 1.338, 0.05
    oscillator = Oscillator(
        damping=2 * h,
        forces=(Force(2 * h * g, g), Force(1, g, -np.pi / 2)),
        stops=(Stop(0.8, Rigid(0.6)),),
        friction=Friction(f),
    )
    machine = Machine(1, 2 * h, 0.8, -2 * h * g, -1, g, restitution=0.6, friction=f)
    return Case(name, oscillator, (0.0, 0.0), machine, 0.8, 0.0)


def cases() -> list[Case]:
    zeta, omega = 0.05, 0.8
    above = np.hypot(1 - omega**2, 2 * zeta * omega) * (1 + 1e-4)
    response = above / complex(1 - omega**2, 2 * zeta * omega)
    start = (response.real, -omega * response.imag)
    return [
        one_sided("chaotic", 0.05, 9.435, 2.7, 0.8),
        one_sided("periodic, 22.1 Hz beam", 0.03, 0.25, naive.frequency_ratio(22.1), 0.2),
        one_sided("grazing, 1e-4 above", zeta, above, omega, 0.5, start),
        moving_base("chattering", "hard"),
        moving_base("soft stop, 2e5", "soft", 2e5),
        moving_base("soft stop, 1e8", "soft", 1e8),
        rubbing("friction"),
    ]


METHODS = (
    *(FixedStep(steps) for steps in (30, 300, 3000)),
    *(RungeKutta(tolerance) for tolerance in (1e-8, 1e-10, 1e-13)),
)


# -- tools: (case, count) -> instants ----------------------------------------------------------


def by_impactsig(case: Case, count: int) -> np.ndarray:
    motion = impactsig.simulate(case.oscillator, periods=20 * count, initial=case.initial)
    return motion.impacts.time[:count]


def push(machine: Machine, t):
    angle = machine.omega * t
    return machine.load + machine.cosine * np.cos(angle) + machine.sine * np.sin(angle)


def by_scipy(method: str, rtol: float) -> Callable:
    """solve_ivp, begun again at each event: contact, its end, and a standstill under friction."""

    def find(case: Case, count: int) -> np.ndarray:
        machine = case.machine
        t, y, v, side, found = 0.0, case.gap, case.speed, 1, []
        while len(found) < count:
            k = machine.stiffness + (machine.stop_stiffness if side < 0 else 0)
            c = machine.damping + (machine.stop_damping if side < 0 else 0)
            way = np.sign(v)
            if machine.friction and v == 0:
                t = released(machine, t, y, k)
                way = np.sign(push(machine, t) - k * y)
            rub = machine.friction * way

            def rate(t, state, k=k, c=c, rub=rub):
                return state[1], push(machine, t) - rub - c * state[1] - k * state[0]

            def surface(t, state):
                return state[0]

            def halt(t, state):
                return state[1]

            surface.terminal, surface.direction = True, -side
            halt.terminal, halt.direction = True, -way
            events = (surface, halt) if machine.friction else (surface,)
            leg = solve_ivp(
                rate, (t, t + 60), (y, v), method=method, rtol=rtol, atol=rtol * 1e-3, events=events
            )
            if leg.status != 1:
                break
            t, (y, v) = leg.t[-1], leg.y[:, -1]
            if machine.friction and len(leg.t_events[1]):
                v = 0.0
            elif machine.restitution is None:
                found += [t] if side > 0 else []
                side = -side
                y = side * 1e-15  # an event at the start of a leg is not seen
            else:
                found.append(t)
                y, v = 1e-15, -machine.restitution * v
        return np.array(found)

    return find


def released(machine: Machine, t: float, y: float, k: float) -> float:
    """When friction lets go, by a scan of 1000 steps a period and a bracketed root."""

    def beyond(t):
        return abs(push(machine, t) - k * y) - machine.friction

    grid = t + np.linspace(0, 2 * np.pi / machine.omega, 1001)
    value = np.abs(push(machine, grid) - k * y) - machine.friction
    if value[0] > 0:
        return t
    first = int(np.argmax(value > 0))
    return brentq(beyond, grid[first - 1], grid[first], xtol=1e-15) + 1e-12


def by_heyoka(tol: float) -> Callable:
    """taylor_adaptive with the stop as a terminal event; compiled once for a case.

    The callback turns the velocity at a rigid stop round, and switches stiffness and damping, which
    are parameters, where a soft one is touched or left.
    """
    import heyoka as hy

    built: dict[str, Callable] = {}

    def build(case: Case) -> Callable:
        machine = case.machine
        y, v = hy.make_vars("y", "v")
        angle = machine.omega * hy.time
        drive = machine.load + machine.cosine * hy.cos(angle) + machine.sine * hy.sin(angle)
        found: list[float] = []
        rigid = machine.restitution is not None

        def meet(integrator, sign):
            if sign < 0:
                found.append(integrator.time)
            if rigid:
                integrator.state[0] = 0.0
                integrator.state[1] *= -machine.restitution
            else:
                integrator.pars[0] = machine.stiffness + (sign < 0) * machine.stop_stiffness
                integrator.pars[1] = machine.damping + (sign < 0) * machine.stop_damping
            return True

        way = hy.event_direction.negative if rigid else hy.event_direction.any
        stiffness, damping = machine.stiffness, machine.damping
        if not rigid:
            stiffness, damping = hy.par[0], hy.par[1]
        integrator = hy.taylor_adaptive(
            [(y, v), (v, drive - damping * v - stiffness * y)], [1.0, 0.0],
            t_events=[hy.t_event(y, callback=meet, direction=way)], tol=tol,
        )  # fmt: skip

        def run(count):
            found.clear()
            integrator.time, integrator.state[:] = 0.0, (case.gap, case.speed)
            if not rigid:
                integrator.pars[:] = machine.stiffness, machine.damping
            integrator.reset_cooldowns()
            while len(found) < count:
                integrator.propagate_for(max(count / 4, 1) * 2 * np.pi / machine.omega)
            return np.array(found[:count])

        return run

    def find(case: Case, count: int) -> np.ndarray:
        if case.name not in built:
            built[case.name] = build(case)
        return built[case.name](count)

    return find


# -- tables ------------------------------------------------------------------------------------


def seconds(work: Callable) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def missed(found: np.ndarray, truth: np.ndarray) -> int:
    """Reference impacts that none was found near to: nearer than half of the way to the next."""
    gap = np.diff(truth)
    room = np.minimum(np.append(gap, gap[-1]), np.append(gap[0], gap)) / 2
    return int(sum(not np.any(np.abs(found - t) < r) for t, r in zip(truth, room, strict=True)))


def line(case: Case, tool: str, found: np.ndarray, each: float, truth: np.ndarray) -> dict:
    same = min(len(found), len(truth))
    error = np.abs(found[:same] - truth[:same])
    row: dict = {"scene": case.name, "tool": tool, "us per impact": each * 1e6}
    if same:
        row["error of impact 1"] = float(error[0])
        row["error of the first 20"] = float(error.max())
    return row | {"missed": missed(found, truth)}


def long_run(case: Case, keep: Literal["all", "counts"]) -> Callable:
    """A long run of the engine."""
    return lambda: impactsig.simulate(
        case.oscillator, periods=20_000, initial=case.initial, keep=keep
    )


def scene_table(case: Case) -> list[dict]:
    instants, _ = naive_simulate.impacts(case.machine, COUNT, gap=case.gap, v=case.speed)
    truth = np.array([float(t) for t in instants])
    work, counting = long_run(case, "all"), long_run(case, "counts")
    impacts = work().impact_count
    counting()
    peers: dict[str, Callable] = {}
    rows = []
    if not case.machine.friction:
        for tol in (1e-15, 1e-18):
            try:
                peers[f"heyoka, tolerance {tol:g}"] = by_heyoka(tol)
            except ImportError:
                rows.append(
                    {"scene": case.name, "tool": "heyoka", "us per impact": "not installed"}
                )
    # A chatter has no end for a tool that does not sum it.
    many = COUNT if case.name == "chattering" else 3000
    for find in peers.values():
        find(case, COUNT)
    ours, counted, theirs = [], [], {name: [] for name in peers}
    for _ in range(REPEATS):  # in turns, so that all see the same machine
        ours.append(seconds(work) / impacts)
        counted.append(seconds(counting) / impacts)
        for name, find in peers.items():
            theirs[name].append(seconds(lambda f=find: f(case, many)) / many)
    own = by_impactsig(case, COUNT)
    rows.insert(0, line(case, "impactsig", own, float(np.median(ours)), truth))
    rows.insert(1, line(case, "impactsig, only counted", own, float(np.median(counted)), truth))
    for name, find in peers.items():
        rows.append(line(case, name, find(case, COUNT), float(np.median(theirs[name])), truth))
        rows[-1]["time / ours"] = float(np.median(np.divide(theirs[name], ours)))
    slow = [(f"scipy {m}, rtol {r:g}", by_scipy(m, r)) for m in case.methods for r in TOLERANCES
            if not (m == "Radau" and r < 1e-9)]  # fmt: skip
    for method in METHODS:
        stepped = partial(impactsig.simulate, case.oscillator, initial=case.initial, method=method)
        stepped(periods=1)  # compiles
        start = time.perf_counter()
        motion = stepped(periods=20 * COUNT)
        each = (time.perf_counter() - start) / max(motion.impact_count, 1)
        rows.append(line(case, f"impactsig, {method}", motion.impacts.time[:COUNT], each, truth))
        rows[-1]["time / ours"] = each / float(np.median(ours))
    for name, find in slow:
        start = time.perf_counter()
        found = find(case, COUNT)
        each = (time.perf_counter() - start) / COUNT
        rows.append(line(case, name, found, each, truth))
        rows[-1]["time / ours"] = each / float(np.median(ours))
    return rows


def main() -> None:
    rows = [row for case in cases() for row in scene_table(case)]
    text = markdown(rows)
    about = versions("numpy", "scipy", "numba", "heyoka")
    save("simulation", {"about": about, "scenes": rows}, text)
    print(text)


if __name__ == "__main__":
    main()
