"""Ensembles under random forces: weak error against time for each method and step, and speed.

The linear oscillator with elastic impacts at 0, damping 0.5 and temperature 1 has the mean energy
1 and the density exp(-H); with restitution 0.8 the truth is the exact transition's. The Van der
Pol-Duffing scene is compared with runs of a small step and with stochastic averaging. Errors come
with the standard error of what they are measured by; times are of processor, one thread. Prints
tables.

    python -m benchmarks.stochastic
"""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np

from impactsig import Friction, Noise, Oscillator, Rigid, Stop, averaged_density, scenes
from impactsig import simulate_ensemble as ensemble
from impactsig.stochastic.paths import _splitting
from impactsig.stochastic.paths._random import draw, room
from impactsig.stochastic.paths.equation import BLOCK, COLUMNS, V
from impactsig.stochastic.paths.running import LANES, Mover, key_of

ELASTIC = Oscillator(damping=0.5, stops=(Stop(0.0, Rigid(1.0), "lower"),), noise=Noise(0.5))
LOSSY = replace(ELASTIC, stops=(Stop(0.0, Rigid(0.8), "lower"),), load=-0.5)
RUBBING = replace(ELASTIC, stops=(), stiffness=0.0, damping=0.0, friction=Friction(0.8))
# Steps, and paths: as many as a moderate time allows.
STEPS = {
    "splitting": ((0.8, 0.4, 0.2), 3000),
    "runge-kutta": ((0.8, 0.4, 0.2), 1200),
    "zhuravlev": ((0.8, 0.4, 0.2), 1200),
    "gaussian": ((0.8, 0.2), 600),
}


def clocked(function, *arguments, **options):
    """What a function returns, and the processor time that it takes."""
    start = time.process_time()
    found = function(*arguments, **options)
    return found, time.process_time() - start


def long_run(machine, method, step, seed, paths=400, duration=4000.0):
    return clocked(
        ensemble, machine, paths=paths, duration=duration, transient=30.0, seed=seed,
        method=method, step=step, every=max(0.8, step), bins=40, energy_range=(0.0, 8.0), workers=1,
    )  # fmt: skip


def order(steps, errors, doubts):
    """Order of convergence by weighted regression, of errors that stand out of their doubt."""
    there = [(h, e, d) for h, e, d in zip(steps, errors, doubts, strict=True) if abs(e) > 3 * d]
    if len(there) < 2:
        return "  -"
    h, e, d = np.abs(np.array(there)).T
    weight = np.minimum(e / d, 20)  # beyond, the next order says more than chance
    return f"{np.polyfit(np.log(h), np.log(e), 1, w=weight)[0]:.2f}"


def weak_errors():
    truth, _ = long_run(LOSSY, "gaussian", 0.4, seed=99, paths=1500)
    edges = truth.energy.edges
    known = {
        "elastic, r = 1": (ELASTIC, 1.0, 0.0, -np.diff(np.exp(-edges)) / np.diff(edges), 0.0),
        "r = 0.8, load -0.5": (
            LOSSY, truth.energy.mean, truth.energy.mean_error, truth.energy.density,
            truth.energy.standard_error,
        ),
    }  # fmt: skip
    seed = 0
    for name, (machine, mean, doubt, density, scatter) in known.items():
        print(f"\n{name}: mean energy {mean:.5f} +- {doubt:.5f}")
        print(f"{'method':12} {'step':>5} {'ns/step':>8} {'error of mean H':>22}", end="")
        print(f" {'L1 error of p(H)':>17} {'by chance':>10}  order")
        for method, (steps, paths) in STEPS.items():
            errors, doubts, rows = [], [], []
            for step in steps:
                seed += 1
                found, spent = long_run(machine, method, step, seed, paths)
                energy = found.energy
                errors.append(energy.mean / mean - 1)
                doubts.append(math.hypot(energy.mean_error, doubt) / mean)
                width = np.diff(edges)
                off = np.sum(np.abs(energy.density - density) * width)
                chance = np.sum(np.hypot(energy.standard_error, scatter) * width) * 0.8
                cost = spent / (paths * 4030 / found.step) * 1e9
                rows.append((step, cost, errors[-1], doubts[-1], off, chance))
            for k, (step, cost, error, spread, off, chance) in enumerate(rows):
                print(f"{method:12} {step:5g} {cost:8.1f} {error:12.2%} +- {spread:6.2%}", end="")
                print(f" {off:17.4f} {chance:10.4f}", end="")
                print(f"  {order(steps, errors, doubts)}" if k == 0 else "")


def friction_errors():
    print("\nfriction alone, f = 0.8: mean energy D^2 / f^2, weak error")
    exact = (0.5 / 0.8) ** 2
    for step in (0.8, 0.4, 0.2, 0.1):
        found = ensemble(
            RUBBING, paths=400, duration=3000.0, transient=30.0, step=step, every=0.8, seed=1
        ).energy
        error, doubt = found.mean / exact - 1, found.mean_error / exact
        print(f"splitting {step:5g} {error:9.2%} +- {doubt:.2%}")


SCENES = {0.99: (0.0, 4.4), 0.95: (0.5, 0.5)}  # restitution, and where paths start


def scene_bias():
    """Mean energy at multiples of the default step; the error of each by H = H0 (1 + c h^2)."""
    print("\nVan der Pol-Duffing, f_k = 1: weak error of the mean energy by step")
    for restitution, initial in SCENES.items():
        machine = scenes.van_der_pol_duffing(restitution)
        options = {"initial": initial, "workers": 1, "transient": 1500.0}
        default = ensemble(machine, paths=8, duration=1500.0, seed=1, **options).step
        factors = np.array([4.0, 8 / 3, 2.0, 1.0, 0.5])
        found = [
            ensemble(
                machine, paths=640, duration=1e6 * default, step=factor * default,
                every=8 * default, seed=k, **options,
            ).energy
            for k, factor in enumerate(factors)
        ]  # fmt: skip
        mean, doubt = np.transpose([(one.mean, one.mean_error) for one in found])
        basis = np.stack([np.ones(len(factors)), factors**2], axis=1) / doubt[:, None]
        covariance = np.linalg.inv(basis.T @ basis)
        limit, slope = covariance @ basis.T @ (mean / doubt)
        off = slope / limit, math.sqrt(covariance[1, 1]) / limit
        chi = np.sum((mean / doubt - basis @ [limit, slope]) ** 2)
        error = math.sqrt(covariance[0, 0])
        print(f"r = {restitution}: mean H {limit:.4f} +- {error:.4f} in the limit,", end=" ")
        print(f"chi^2 {chi:.1f} of 3, order {order(factors, mean / limit - 1, doubt / limit)}")
        for factor, one, spread in zip(factors, mean, doubt, strict=True):
            print(f"  step {factor * default:.4f} ({factor:4.2f} of the default):", end=" ")
            print(f"{one:.4f} +- {spread:.4f}, {one / limit - 1:7.2%} +- {spread / limit:.2%}")
        print(f"  at the default step by the fit: {off[0]:.2%} +- {off[1]:.2%}")


def scene():
    print("\nVan der Pol-Duffing, f_k = 1: mean energy, in the time of the first row")
    for restitution, initial in SCENES.items():
        machine = scenes.van_der_pol_duffing(restitution)
        options = {"paths": 600, "transient": 600.0, "initial": initial, "workers": 1}
        first, spent = clocked(ensemble, machine, duration=1500.0, seed=1, **options)
        rows = [("splitting", first, spent)]
        for method, factor in (
            ("splitting", 3), ("splitting", 1 / 3), ("runge-kutta", 3), ("zhuravlev", 3),
        ):  # fmt: skip
            rows.append((method, *clocked(
                ensemble, machine, duration=1500.0, seed=2, method=method,
                step=min(factor * first.step, 0.09), **options,
            )))  # fmt: skip
        print(f"{'':26} {'step':>7} {'mean H':>20} {'time':>6}")
        for method, found, cost in rows:
            energy = found.energy
            print(f"r = {restitution}, {method:16} {found.step:8.4f}", end=" ")
            print(f"{energy.mean:10.4f} +- {energy.mean_error:.4f} {cost / spent:6.2f}")
        for impact in ("logarithmic", "linearised", "exact"):
            (curve, cost) = clocked(averaged_density, machine, impact=impact)
            print(f"r = {restitution}, averaged, {impact:18} {curve.mean:9.4f} ", end="")
            print(f"{cost / spent:17.5f}")


def strong_errors():
    """Distance of paths from those of a fine step, driven by the same noise."""
    print("\nsplitting, strong error at t = 4 (mean distance of x)")
    steps, paths = (0.1, 0.05, 0.025, 0.0125, 0.0125 / 32), 400
    fine = steps[-1] / 2  # kicks stand for a step from middle to middle
    normal = np.random.default_rng(5).standard_normal((paths, round(4.2 / fine)))
    brownian = math.sqrt(fine) * np.cumsum(normal, axis=1)
    cubic = Oscillator(damping=0.3, stiffness=0.0, law=_cubic, noise=Noise(0.5))
    for name, machine in (("no stop", cubic), ("elastic impacts", ELASTIC)):
        ends = []
        for step in steps:
            many = round(step / fine)
            middles = brownian[:, many // 2 - 1 :: many][:, : round(4 / step) + 1]
            z = np.diff(middles, axis=1) / math.sqrt(step)
            ends.append(driven(machine, step, z, kick=middles[:, 0])[:, -1])
        errors = [np.mean(np.abs(end - ends[-1])[:, 0]) for end in ends[:-1]]
        slope = np.polyfit(np.log(steps[:-1]), np.log(errors), 1)[0]
        print(f"{name:16}", *(f"{error:.1e}" for error in errors), f"order {slope:.2f}")


def driven(machine, step, z, every=None, kick=None):
    """States of the splitting with given random numbers, at the end or every so many steps."""
    paths, count = z.shape
    mover = Mover(machine, step, "splitting", 0.0, key_of(1))
    group = mover.start(np.full(paths, 1.0), np.zeros(paths), np.arange(paths))
    if kick is not None:  # the half of a kick at the start, where the force of both machines is -1
        group.state[V] = -step / 2 + kick
    every = every or count
    seen = np.empty((paths, count // every, 2))
    normal = np.ascontiguousarray(z.T)
    _splitting.advance(
        mover.problem, mover.functions, group.scratch, normal, normal, group.state, group.count,
        0, count, every, 0, seen, np.empty((0, COLUMNS)),
    )  # fmt: skip
    return seen


def _cubic(t, x, v):
    return -x * x * x


def increments():
    """Whether three-point increments, which are as good for weak order 2, would serve."""
    print("\nsplitting, what the noise is made of: error of mean H, r = 0.8, load -0.5")
    rng = np.random.default_rng(3)
    truth, _ = long_run(LOSSY, "gaussian", 0.4, seed=98, paths=600)
    for step in (0.8, 0.4):
        count = round(4000 / step)
        for name, values in (
            ("normal", rng.standard_normal((200, count))),
            ("three-point", rng.choice(math.sqrt(3) * np.array([-1, 0, 0, 0, 0, 1]), (200, count))),
        ):
            seen = driven(LOSSY, step, values, every=round(0.8 / step))[:, 50:]
            energy = ((seen**2).sum(axis=2) / 2 + 0.5 * seen[..., 0]).mean(axis=1)
            energy /= truth.energy.mean
            error = energy.std(ddof=1) / math.sqrt(len(energy))
            print(f"{name:12} step {step}: {energy.mean() - 1:8.2%} +- {error:.2%}")


def speed():
    print("\nspeed")
    key, r, z = key_of(1), room(BLOCK), np.empty(BLOCK)
    draw(r, key, 0, 0, z)
    z = np.empty(1 << 16)
    r = room(len(z))
    _, spent = clocked(lambda: [draw(r, key, 0, block, z) for block in range(100)])
    print(f"normal numbers: {spent / 100 / len(z) * 1e9:.1f} ns each")
    cases = {
        "Van der Pol-Duffing, r = 0.99": (scenes.van_der_pol_duffing(0.99), 1500.0),
        "Van der Pol-Duffing, r = 0.95": (scenes.van_der_pol_duffing(0.95), 2500.0),
        "linear, elastic": (ELASTIC, 20_000.0),
    }
    for name, (machine, duration) in cases.items():
        for workers in (1, 2):
            options = {"paths": 16 * LANES, "duration": duration, "initial": (0.5, 1.0)}
            ensemble(machine, seed=1, workers=workers, **options | {"duration": duration / 100})
            best, busy = math.inf, math.inf
            for _ in range(3):
                start = time.perf_counter()
                found, spent = clocked(ensemble, machine, seed=1, workers=workers, **options)
                best, busy = min(best, time.perf_counter() - start), min(busy, spent)
            steps = found.paths * found.duration / found.step
            print(f"{name:30} {workers} threads: {steps / best / 1e6:5.1f} million steps", end=" ")
            print(f"and {found.paths / best:.0f} paths of {duration:g} s a second;", end=" ")
            print(f"{steps / busy / 1e6:.1f} million a second of processor")


def main():
    speed()
    weak_errors()
    friction_errors()
    strong_errors()
    increments()
    scene_bias()
    scene()


if __name__ == "__main__":
    main()
