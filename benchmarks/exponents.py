"""The largest Lyapunov exponent: error against time, beside nolds and neurokit2.

Hénon (m = 2, delay 1), the logistic map (m = 1) and Lorenz x (dt 0.04, m = 3, delay 4), N = 1000 to
20 000, several beginnings of each; all tools are given the same embedding and Theiler window. nolds
and neurokit2 keep all distances and are left out where these take more than 1 GB; neurokit2 is left
out where it is not installed. Coverage is of 100 beginnings at N = 2000: how often the 95 %
interval holds the exponent, and its median width over that of the scatter; and, of as many
beginnings under a known noise, of Hénon's map in two dimensions, of Lorenz' integrate-and-fire
intervals in four, one fewer than these take, and of Rössler's, whose neighbours keep their phase.
Writes results/exponents.json and exponents.md.

    python -m benchmarks.exponents
"""

from __future__ import annotations

import time
import warnings

import numpy as np

from impactsig import lyapunov_exponent
from impactsig.reconstruct import classic
from tests import naive_reconstruct_embed as series
from tests.series import henon, lorenz_intervals, noisy, roessler_intervals

from .saving import save, versions

SIZES = (1000, 2000, 5000, 20_000)
SEEDS = 8
PEER_SEEDS = 3
COVERAGE_SEEDS, COVERAGE_SIZE = 100, 2000
FIRST_SEED = 660_000
MOST_BYTES = 1e9

CASES = {
    "henon": (lambda n, s: series.henon(n, 0.01 * s), 0.4192, 1.0, (2, 1, 4), 12),
    "logistic": (lambda n, s: series.logistic(n, 0.31 + 0.01 * s), np.log(2), 1.0, (1, 1, 1), 8),
    "lorenz": (lambda n, s: series.lorenz_x(n, start=(1 + s, 1, 20)), 0.9056, 0.04, (3, 4, 50), 60),
}
"""Series by length and seed; exponent; time step; dimension, delay, Theiler window; steps."""


def ours(method: str):
    def run(x, step, embedding, steps):
        dimension, delay, theiler = embedding
        found = lyapunov_exponent(
            x, dimension=dimension, delay=delay, theiler=theiler, step=step, method=method
        )
        return found.per_second, found.interval_per_second

    return run


def by_nolds(x, step, embedding, steps):
    dimension, delay, theiler = embedding
    found = classic.lyap_r(
        x, dimension=dimension, delay=delay, theiler=theiler, steps=steps, step=step
    )
    return found, None


def by_neurokit(x, step, embedding, steps):
    import neurokit2

    dimension, delay, theiler = embedding
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found, _ = neurokit2.complexity_lyapunov(
            x, dimension=dimension, delay=delay, separation=theiler, method="rosenstein1993",
            len_trajectory=steps,
        )  # fmt: skip
    return found / step, None


TOOLS = {
    "impactsig rosenstein": ours("rosenstein"),
    "impactsig kantz": ours("kantz"),
    "nolds lyap_r": by_nolds,
    "neurokit2": by_neurokit,
}


def row(tool: str, case: str, n: int) -> dict | None:
    """Bias, scatter, coverage and median time of a tool on some beginnings of a series."""
    make, truth, step, embedding, steps = CASES[case]
    own = tool.startswith("impactsig")
    if not own and 8 * n**2 > MOST_BYTES:
        return None
    found, held, times = [], [], []
    for seed in range(SEEDS if own else PEER_SEEDS):
        x = make(n, seed)
        if own and seed == 0:
            TOOLS[tool](x, step, embedding, steps)  # compile
        begin = time.perf_counter()
        value, interval = TOOLS[tool](x, step, embedding, steps)
        times.append(time.perf_counter() - begin)
        if value is not None:
            found.append(value)
            if interval is not None:
                held.append(interval[0] <= truth <= interval[1])
    return {
        "tool": tool, "series": case, "n": n, "truth": truth, "runs": len(times),
        "answers": len(found),
        "mean": float(np.mean(found)) if found else None,
        "sd": float(np.std(found)) if found else None,
        "error": float(np.mean(found) / truth - 1) if found else None,
        "coverage": float(np.mean(held)) if held else None,
        "seconds": float(np.median(times)),
    }  # fmt: skip


def coverage(case: str, method: str) -> dict:
    """How often the interval holds the exponent, over many beginnings."""
    make, truth, step, embedding, steps = CASES[case]
    found = [
        ours(method)(make(COVERAGE_SIZE, 0.1 * seed), step, embedding, steps)
        for seed in range(COVERAGE_SEEDS)
    ]
    values = np.array([value for value, _ in found if value is not None])
    low, high = np.array([interval for _, interval in found if interval is not None]).T
    return {
        "series": case, "method": method, "n": COVERAGE_SIZE, "runs": len(found),
        "answers": len(values),
        "mean": float(values.mean()), "sd": float(values.std()), "truth": truth,
        "holds truth": float(np.mean((low <= truth) & (truth <= high))),
        "holds own mean": float(np.mean((low <= values.mean()) & (values.mean() <= high))),
        "half width / 1.96 sd": float(np.median(high - low) / 2 / 1.96 / values.std()),
    }  # fmt: skip


def known_noise() -> list[dict]:
    """The same where the errors of the values are known: errors and widths as shares."""
    rows = []
    for name, make, rate, dimension, sizes in (
        ("henon", henon, None, 2, (500, 2000)),
        ("lorenz intervals", lorenz_intervals, 0.9056, 4, (2000, 5000)),
        ("rossler intervals", roessler_intervals, 0.0714, 3, (2000, 5000)),
    ):
        for n in sizes:
            for noise in (0.0, 0.02):
                errors, halves = [], []
                for seed in range(FIRST_SEED, FIRST_SEED + COVERAGE_SEEDS):
                    x = make(n, seed)
                    truth = 0.4192 if rate is None else rate * x.mean()
                    found = lyapunov_exponent(
                        noisy(x, noise, seed), dimension=dimension, value_error=noise * x.std()
                    )
                    if found.interval is not None:
                        errors.append(found.exponent / truth - 1)
                        halves.append((found.interval[1] - found.interval[0]) / 2 / truth)
                rows.append({
                    "series": name, "m": dimension, "n": n, "noise": noise,
                    "runs": COVERAGE_SEEDS, "answers": len(errors),
                    "bias": float(np.mean(errors)), "sd": float(np.std(errors)),
                    "half width": float(np.mean(halves)),
                    "holds truth": float(np.mean(np.abs(errors) <= np.array(halves))),
                })  # fmt: skip
    return rows


def known_noise_table(rows: list[dict]) -> str:
    lines = [
        "| series | m | N | noise | answers | error ± SD | half-width | holds the exponent |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in rows:
        lines.append(
            f"| {one['series']} | {one['m']} | {one['n']} | {one['noise']:.0%} "
            f"| {one['answers']}/{one['runs']} | {one['bias']:+.1%} ± {one['sd']:.1%} "
            f"| {one['half width']:.1%} | {one['holds truth']:.0%} |"
        )
    return "\n".join(lines)


def coverage_table(rows: list[dict]) -> str:
    lines = [
        "| series | method | mean ± SD | holds the exponent | its own mean | width / scatter |",
        "|---|---|---|---|---|---|",
    ]
    for one in rows:
        lines.append(
            f"| {one['series']} | {one['method']} | {one['mean']:.3f} ± {one['sd']:.3f} "
            f"| {one['holds truth']:.0%} of {one['answers']} | {one['holds own mean']:.0%} "
            f"| {one['half width / 1.96 sd']:.2f} |"
        )
    return "\n".join(lines)


def table(rows: list[dict]) -> str:
    lines = [
        "| series | N | tool | exponent | error | 95 % holds | answers | time |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in rows:
        value = error = "none"
        if one["mean"] is not None:
            value, error = f"{one['mean']:.3f} ± {one['sd']:.3f}", f"{one['error']:+.1%}"
        held = "" if one["coverage"] is None else f"{one['coverage']:.0%}"
        lines.append(
            f"| {one['series']} | {one['n']} | {one['tool']} | {value} | {error} | {held} "
            f"| {one['answers']}/{one['runs']} | {1e3 * one['seconds']:.0f} ms |"
        )
    return "\n".join(lines)


def main() -> None:
    tools = dict(TOOLS)
    about = versions("nolds", "neurokit2")
    if about["neurokit2"] == "absent":
        del tools["neurokit2"]
    rows = [row(tool, case, n) for case in CASES for n in SIZES for tool in tools]
    rows = [one for one in rows if one is not None]
    known = known_noise()
    covered = [coverage(case, method) for case in CASES for method in ("rosenstein", "kantz")]
    text = f"{table(rows)}\n\n{coverage_table(covered)}\n\n{known_noise_table(known)}\n"
    data = {"about": about, "rows": rows, "coverage": covered, "known noise": known}
    save("exponents", data, text)
    print(text)


if __name__ == "__main__":
    main()
