"""The soft stop nearest to a rigid one: our optimiser beside scipy's, and the match of both stops.

Both optimisers have the same objective, box and contacts, ten seeds each; scipy's
differential_evolution as it comes, with and without its last polish. Then the share of the
(omega, A) plane in which the printed optimum and the rigid stop do the same, by our definition of
e_c and from our start at rest. Prints tables.

    python -m benchmarks.equivalence
"""

from __future__ import annotations

import time

import numpy as np
from scipy.optimize import differential_evolution

from impactsig import (
    ContactSamples,
    KelvinVoigt,
    equivalence_error,
    fit_soft_stop,
    match_rate,
    scenes,
    stop_damping,
)

RESTITUTION = 0.85
BOX = ((10.0, 1e4), (0.1, 1e3))
SEEDS = range(10)


def optimisers(samples: ContactSamples) -> None:
    def objective(x: np.ndarray) -> float:
        return equivalence_error(KelvinVoigt(*np.exp(x)), RESTITUTION, samples).value

    def ours(seed: int) -> tuple[float, int]:
        fit = fit_soft_stop(
            RESTITUTION, stiffness=BOX[0], damping=BOX[1], samples=samples, seed=seed
        )
        return fit.error.value, fit.evaluations

    def scipys(seed: int, polish: bool) -> tuple[float, int]:
        found = differential_evolution(objective, np.log(BOX), rng=seed, polish=polish)
        return found.fun, found.nfev

    tools = {
        "annealed evolution": ours,
        "scipy": lambda seed: scipys(seed, polish=False),
        "scipy, polished": lambda seed: scipys(seed, polish=True),
    }
    found: dict[str, list] = {name: [] for name in tools}
    spent = dict.fromkeys(tools, 0.0)
    for seed in SEEDS:
        for name, tool in tools.items():
            start = time.thread_time()
            found[name].append(tool(seed))
            spent[name] += time.thread_time() - start
    least = min(value for runs in found.values() for value, _ in runs)
    print(f"least e_g {least:.9f} over {len(samples)} contacts, {len(SEEDS)} seeds each")
    print(f"{'':20} {'evaluations':>11} {'worst e_g above least':>22} {'time, ours = 1':>15}")
    for name, runs in found.items():
        count = np.mean([evaluations for _, evaluations in runs])
        worst = max(value for value, _ in runs) / least - 1
        ratio = spent[name] / spent["annealed evolution"]
        print(f"{name:20} {count:11.0f} {worst:22.1e} {ratio:15.2f}")


def stops(samples: ContactSamples) -> None:
    fit = fit_soft_stop(RESTITUTION, samples=samples, seed=0)
    dampings = {
        "fitted": fit.stop.damping,
        "printed": 10.3288336,
        "formula A": stop_damping(RESTITUTION, 1e4),
        "formula B": stop_damping(RESTITUTION, 1e4, formula="force"),
        "formula C": stop_damping(RESTITUTION, 1e4, formula="work"),
    }
    print(f"\n{'stiffness 1e4':20} {'damping':>9} {'e_g':>12}")
    for name, damping in dampings.items():
        error = equivalence_error(KelvinVoigt(1e4, damping), RESTITUTION, samples)
        print(f"{name:20} {damping:9.4f} {error.value:12.9f}")


def plane(cells: int) -> None:
    start = time.process_time()
    found = match_rate(
        lambda omega, amplitude: scenes.tian(omega, amplitude, "hard"),
        lambda omega, amplitude: scenes.tian(omega, amplitude, "soft"),
        np.linspace(0.5, 4, cells),
        np.linspace(0.1, 2, cells),
    )
    spent = time.process_time() - start
    print(f"\nmatch on {cells} x {cells} cells: {found.rate:.1%} ({found.failed} failed);")
    print(f"{spent / found.distance.size * 1e3:.2f} ms of CPU a cell, both stops, 300 periods each")


def main() -> None:
    samples = ContactSamples.draw(1000, seed=0)
    equivalence_error(KelvinVoigt(1e4, 10.0), RESTITUTION, samples)  # compiled
    optimisers(samples)
    stops(samples)
    plane(200)


if __name__ == "__main__":
    main()
