"""Size and power of the surrogate test: how often it rejects linear processes, and chaos in noise.

Nulls: autoregressive processes of the first and second order, their cubes and exponentials, 1/f
noise, and the same with two groups of values, z + c sign z. Alternatives: Hénon's map, intervals of
Lorenz' flow and of an impacting beam, with noise as a share of their standard deviation. A run of a
case is a series and a test with seeds of its own; counts are kept in results/surrogates.json, and a
further run of the command continues where the last one ended.

    python -m benchmarks.surrogates [--cases NAME ...] [--lengths N ...] [--series COUNT]
        [--statistic NAME] [--surrogates COUNT]
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.signal import lfilter

from impactsig import scenes, simulate, surrogate_test
from tests import firing

from .saving import result_file

FIRST = [1.0, -0.6]
SECOND = [1.0, -2 * 0.9 * np.cos(0.7), 0.81]  # poles 0.9 exp(+-0.7 i)
Draw = Callable[[int, np.random.Generator], np.ndarray]


def linear(recursion: list[float], n: int, rng: np.random.Generator) -> np.ndarray:
    """An autoregressive process of variance 1."""
    answer = lfilter([1.0], recursion, np.eye(1, 5000)[0])
    noise = rng.standard_normal(n + 1000)
    return lfilter([1.0], recursion, noise)[1000:] / np.linalg.norm(answer)


def coloured(exponent: float, n: int, rng: np.random.Generator) -> np.ndarray:
    """Part of a longer series with a power 1/f^exponent; of variance 1 over the part."""
    frequency = np.fft.rfftfreq(8 * n)
    frequency[0] = np.inf
    normal = rng.standard_normal((2, len(frequency)))
    x = np.fft.irfft((normal[0] + 1j * normal[1]) * frequency ** (-exponent / 2), 8 * n)[:n]
    return (x - x.mean()) / x.std()


def split(x: np.ndarray, by: float) -> np.ndarray:
    """Two groups of values."""
    return x + by * np.sign(x)


NULLS: dict[str, Draw] = {
    "white": lambda n, rng: rng.standard_normal(n),
    "AR(0.6)": lambda n, rng: linear(FIRST, n, rng),
    "AR(0.6)^3": lambda n, rng: linear(FIRST, n, rng) ** 3,
    "exp AR(0.6)": lambda n, rng: np.exp(linear(FIRST, n, rng)),
    "AR(0.9)": lambda n, rng: linear([1.0, -0.9], n, rng),
    "AR(0.9)^3": lambda n, rng: linear([1.0, -0.9], n, rng) ** 3,
    "AR(2)": lambda n, rng: linear(SECOND, n, rng),
    "AR(2)^3": lambda n, rng: linear(SECOND, n, rng) ** 3,
    "exp AR(2)": lambda n, rng: np.exp(linear(SECOND, n, rng)),
    "1/f": lambda n, rng: coloured(1.0, n, rng),
    "1/f^1.5": lambda n, rng: coloured(1.5, n, rng),
    "1/f^2": lambda n, rng: coloured(2.0, n, rng),
    "AR(0.6), two groups": lambda n, rng: split(linear(FIRST, n, rng), 6.0),
    "AR(2), two groups": lambda n, rng: split(linear(SECOND, n, rng), 12.0),
    "1/f, two groups": lambda n, rng: split(coloured(1.0, n, rng), 6.0),
}


def noisy(x: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """With noise, as a share of the standard deviation."""
    return x + share * x.std() * rng.standard_normal(len(x))


def henon(n: int, rng: np.random.Generator) -> np.ndarray:
    """Hénon's map from a start at random."""
    x, y = rng.uniform(-0.1, 0.1, 2)
    found = np.empty(n + 200)
    for k in range(n + 200):
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        found[k] = x
    return found[200:]


def lorenz(n: int, rng: np.random.Generator) -> np.ndarray:
    """Integrate-and-fire intervals of Lorenz' flow."""
    return firing.intervals("lorenz", n, int(rng.integers(2**31)))


@cache
def _beam() -> np.ndarray:
    impacts = simulate(scenes.karpodinis(20.1), periods=100_000, transient=300).impacts
    assert impacts is not None
    intervals: np.ndarray = impacts.intervals()
    return intervals


def beam(n: int, rng: np.random.Generator) -> np.ndarray:
    """Intervals of the impacting beam at 20.1 Hz."""
    start = int(rng.integers(len(_beam()) - n))
    return _beam()[start : start + n]


CHAOS: dict[str, Draw] = {
    "Henon, 70 % noise": lambda n, rng: noisy(henon(n, rng), 0.7, rng),
    "Lorenz, 60 % noise": lambda n, rng: noisy(lorenz(n, rng), 0.6, rng),
    "beam, 10 % noise": lambda n, rng: noisy(beam(n, rng), 0.1, rng),
    "beam, 20 % noise": lambda n, rng: noisy(beam(n, rng), 0.2, rng),
    "beam, 40 % noise": lambda n, rng: noisy(beam(n, rng), 0.4, rng),
}
CASES = NULLS | CHAOS


def rejected(case: str, n: int, run: int, statistic: str, count: int) -> dict[str, bool]:
    """What one test says."""
    rng = np.random.default_rng([run, n, sorted(CASES).index(case), 1919])
    found = surrogate_test(CASES[case](n, rng), statistic, count=count, seed=run)  # type: ignore[arg-type]
    return {
        "rejected": found.rejected,
        "below": found.p_value <= 0.05,
        "undecided": not found.decided,
        "power law": any("1/f" in warning for warning in found.warnings),
    }


def main() -> None:
    """Add series to every case that has too few, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--lengths", nargs="+", type=int, default=[300, 2000])
    parser.add_argument("--series", type=int, default=1000)
    parser.add_argument("--statistic", default="prediction_error")
    parser.add_argument("--surrogates", type=int, default=19)
    parser.add_argument("--file", default="surrogates.json")
    chosen = parser.parse_args()
    path = result_file(chosen.file)
    told: dict[str, dict[str, float]] = json.loads(path.read_text()) if path.exists() else {}
    for n in chosen.lengths:
        for case in chosen.cases:
            key = f"{case}; {n}; {chosen.statistic}; {chosen.surrogates}"
            row = told.setdefault(key, {"series": 0, "seconds": 0.0})
            while row["series"] < chosen.series:
                begin = time.process_time()
                one = rejected(case, n, int(row["series"]), chosen.statistic, chosen.surrogates)
                row["series"] += 1
                row["seconds"] += time.process_time() - begin
                for name, value in one.items():
                    row[name] = row.get(name, 0) + value
                if row["series"] % 50 == 0 or row["series"] == chosen.series:
                    path.write_text(json.dumps(told, indent=1))
            shares = ", ".join(
                f"{name} {100 * row[name] / row['series']:.1f} %"
                for name in ("rejected", "below", "undecided", "power law")
            )
            print(f"{key}: {int(row['series'])} series, {shares}", flush=True)


if __name__ == "__main__":
    main()
