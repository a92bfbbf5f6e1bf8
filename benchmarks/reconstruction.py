"""Reconstruction beside the tools a user would pick instead: time, memory, error.

The machine is shared, so that times are of the processor, tools take turns, and what is required
are ratios. Writes results/reconstruction.json and reconstruction.md.

    python -m benchmarks.reconstruction
"""

from __future__ import annotations

import multiprocessing
import platform
import resource
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from impactsig import correlation_dimension, correlation_sum, recurrence_quantification
from tests import naive_reconstruct

from .saving import save, versions


def henon(n: int) -> np.ndarray:
    """x of the Henon map, a = 1.4 and b = 0.3, after 1000 steps."""
    x, y, found = 0.1, 0.1, np.empty(n)
    for i in range(-1000, n):
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        if i >= 0:
            found[i] = x
    return found


def turns(
    tools: dict[str, Callable[[], Any]], rounds: int = 7, warm: bool = True
) -> dict[str, np.ndarray]:
    """Processor times [s] of tools that take turns, after a turn to warm up."""
    times: dict[str, list[float]] = {name: [] for name in tools}
    for turn in range(0 if warm else 1, rounds + 1):
        for name, work in tools.items():
            start = time.process_time()
            work()
            if turn:
                times[name].append(time.process_time() - start)
    return {name: np.array(each) for name, each in times.items()}


def apart(work: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    """What `work` returns in a process of its own, and the most memory that process held [MB]."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    child = context.Process(target=_apart, args=(there, work, arguments))
    child.start()
    there.close()
    try:
        found = here.recv()
    finally:
        child.join()
    return found


def _apart(pipe: Any, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    found = work(*arguments)
    pipe.send((found, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024))


def nolds_radii(x: np.ndarray) -> np.ndarray:
    """The radii that nolds takes by itself: 0.1 to 0.5 standard deviations, in steps of 1.03."""
    sd = np.std(x, ddof=1)
    return sd * 0.1 * 1.03 ** np.arange(1 + int(np.log(5) / np.log(1.03)))


def by_kdtree(x: np.ndarray, m: int, radii: np.ndarray) -> np.ndarray:
    """Pairs within each radius, those of a vector with itself left out."""
    from scipy.spatial import cKDTree

    tree = cKDTree(naive_reconstruct.delay_vectors(x, m, 1))
    return (tree.count_neighbors(tree, radii, p=np.inf) - tree.n) // 2


def by_nolds(n: int) -> float:
    import nolds

    x = henon(n)
    start = time.process_time()
    nolds.corr_dim(x, 2, rvals=nolds_radii(x), fit="poly")
    return time.process_time() - start


def by_twin(n: int) -> float:
    x = henon(n)
    start = time.process_time()
    naive_reconstruct.correlation_counts(x, (2,), 1, 0, nolds_radii(x))
    return time.process_time() - start


def counting_speed(n: int = 20_000) -> list[dict]:
    """Counts of dimension 2 at the radii of nolds, in one thread."""
    x = henon(n)
    radii = nolds_radii(x)
    ours = correlation_sum(x, [2], theiler=0, radii=radii, workers=1).counts[0]
    assert np.array_equal(ours, by_kdtree(x, 2, radii))
    small = radii[0] / 20 * np.geomspace(1 / 30, 1, len(radii))
    rows = []
    for name, each in (("0.1 to 0.5 sd", radii), ("1.7e-4 to 5e-3 sd", small)):
        times = turns(
            {
                "impactsig": lambda r=each: correlation_sum(x, [2], theiler=0, radii=r, workers=1),
                "scipy cKDTree": lambda r=each: by_kdtree(x, 2, r),
            }
        )
        first = times["impactsig"]
        for tool, took in times.items():
            rows.append(
                {
                    "radii": name,
                    "tool": tool,
                    "s": float(np.median(took)),
                    "time / ours": float(np.median(took / first)),
                }
            )
        if each is radii:
            for tool, work in (("nolds", by_nolds), ("row by row, numpy", by_twin)):
                took = apart(work, n)[0]  # once: its time is that of many turns of ours
                ratio = took / float(np.median(first))
                rows.append({"radii": name, "tool": tool, "s": took, "time / ours": ratio})
    return rows


def beside_kdtree(sizes: tuple[int, ...] = (2_000, 20_000, 200_000)) -> list[dict]:
    """Counts of dimension 2 and 3 beside cKDTree, each from the series on, in one thread."""
    spans = {
        "1e-3 sd": np.array([0.001]),
        "1e-3 to 1e-2 sd": np.geomspace(0.001, 0.01, 10),
        "0.5 sd": np.array([0.5]),
        "0.1 to 0.5 sd": np.geomspace(0.1, 0.5, 10),
    }
    rows = []
    for n in sizes:
        x = henon(n)
        for m in (2, 3):
            for name, span in spans.items():
                if n > 20_000 and span[-1] > 0.1:
                    span = span[:1]  # cKDTree takes minutes for each further one
                radii = span * np.std(x)
                rows.append({"n": n, "m": m, "radii": f"{name} ({len(radii)})"})
                rows[-1] |= _beside_kdtree(x, m, radii, 7 if n < 100_000 else 1)
    return rows


def _beside_kdtree(x: np.ndarray, m: int, radii: np.ndarray, rounds: int) -> dict:
    """Median times and their ratio; the counts must be equal."""
    found: dict[str, np.ndarray] = {}

    def ours() -> None:
        found["ours"] = correlation_sum(x, [m], theiler=0, radii=radii, workers=1).counts[0]

    def theirs() -> None:
        found["theirs"] = by_kdtree(x, m, radii)

    ours()  # not the compiler's time
    times = turns({"ours": ours, "theirs": theirs}, rounds, warm=False)
    assert np.array_equal(found["ours"], found["theirs"])
    return {
        "s": float(np.median(times["ours"])),
        "s of cKDTree": float(np.median(times["theirs"])),
        "time / ours": float(np.median(times["theirs"] / times["ours"])),
    }


def kernel_beside_kdtree(n: int = 10_000) -> list[dict]:
    """The Gaussian kernel at the scales of its rule beside counts within the same radii."""
    from scipy.spatial import cKDTree

    from impactsig.reconstruct.dimensions._kernel_sum import kernel_sum
    from tests import series

    rows = []
    for name, x, m, noise in (
        ("Henon", henon(n), 2, 0.0),
        ("Henon", henon(n), 3, 0.0),
        ("Henon", henon(n), 3, 0.01),
        ("Lorenz", series.lorenz_intervals(n), 5, 0.0),
        ("Lorenz", series.lorenz_intervals(n), 5, 0.02),
    ):
        sd = float(np.std(x))
        covariance = (noise * sd) ** 2 * np.eye(m)
        x = series.noisy(x, noise)
        vectors = naive_reconstruct.delay_vectors(x, m, 1)

        def ours(x=x, m=m, covariance=covariance):
            return kernel_sum(x, m, 1, 4, covariance, workers=1)

        scales = ours().scales
        times = turns({"ours": ours} | {
            f"cKDTree, p = {p:g}": lambda p=p, v=vectors, h=scales: (
                cKDTree(v).count_neighbors(cKDTree(v), h, p=p)
            )
            for p in (2, np.inf)
        })  # fmt: skip
        rows.append({"series": name, "m": m, "noise": noise, "scales": len(scales)})
        rows[-1]["s"] = float(np.median(times["ours"]))
        for tool in list(times)[1:]:
            rows[-1][f"{tool}: time / ours"] = float(np.median(times[tool] / times["ours"]))
    return rows


def all_dimensions_speed(n: int = 20_000) -> list[dict]:
    """Dimensions 1 to 10 in one pass, and the largest alone, in one thread."""
    x = henon(n)
    radii = np.geomspace(1e-3, np.ptp(x), 40)
    cases = {"m = 10": [10], "m = 1 to 10": range(1, 11)}
    times = turns(
        {
            name: lambda d=d: correlation_sum(x, d, theiler=1, radii=radii, workers=1)
            for name, d in cases.items()
        }
    )
    alone = times["m = 10"]
    return [
        {
            "dimensions": name,
            "s": float(np.median(took)),
            "time / largest alone": float(np.median(took / alone)),
        }
        for name, took in times.items()
    ]


def _default(n: int, dimensions: tuple[int, ...]) -> dict:
    correlation_sum(henon(31_000), dimensions, theiler=1)  # not the compiler's time
    x = henon(n)
    wall, processor = time.perf_counter(), time.process_time()
    found = correlation_sum(x, dimensions, theiler=1, workers=2)
    return {
        "n": n,
        "dimensions": ", ".join(map(str, dimensions)),
        "greatest radius": float(found.radii[-1]),
        "neighbours, m = 2": 2 * float(found.counts[dimensions.index(2), -1]) / n,
        "s of both processors": time.process_time() - processor,
        "s on the clock": time.perf_counter() - wall,
    }


def _slope(counts: np.ndarray, radii: np.ndarray) -> float:
    return float(np.polyfit(np.log(radii), np.log(counts), 1)[0])


def _slope_found(x: np.ndarray) -> float:
    found = correlation_dimension(x, theiler=1, value_error=0.0, workers=1).slope
    return np.nan if found is None else found.value


def _dimension(tool: str, n: int) -> tuple[float, float]:
    """D2 of the Henon map in two dimensions, and the processor time [s] it took."""
    x = henon(n)
    radii = nolds_radii(x)
    if tool == "neurokit2":
        import neurokit2
    elif tool == "nolds":
        import nolds
    work: dict[str, Callable[[], float]] = {
        "impactsig, slope": lambda: _slope(
            correlation_sum(x, [2], theiler=0, radii=radii, workers=1).counts[0], radii
        ),
        "impactsig": lambda: _slope_found(x),
        "nolds": lambda: nolds.corr_dim(x, 2, rvals=radii, fit="poly"),
        "neurokit2": lambda: neurokit2.fractal_correlation(x, dimension=2, radius="nolds")[0],
    }
    if tool.startswith("impactsig"):
        work[tool]()  # not the compiler's time
    start = time.process_time()
    return work[tool](), time.process_time() - start


def dimensions_found(n: int = 10_000, literature: float = 1.22) -> list[dict]:
    """D2 of the Henon map, its error, time and memory; "slope": at the radii of nolds.

    neurokit2 takes Euclidean distances, 21 bytes for each pair of vectors and more; it is left out
    where it is not installed.
    """
    tools = ["impactsig, slope", "impactsig", "nolds"]
    tools += ["neurokit2"] if find_spec("neurokit2") else []
    rows = []
    for tool in tools:
        (value, took), memory = apart(_dimension, tool, n)
        rows.append(
            {"tool": tool, "n": n, "D2": value, "error": value - literature, "s": took,
             "time / slope": took / rows[0]["s"] if rows else 1.0, "MB": memory}
        )  # fmt: skip
    return rows


def recurrence_speed(n: int = 10_000) -> list[dict]:
    """Recurrence quantification in one thread and in two: of both processors, and on the clock."""
    x = henon(n)
    recurrence_quantification(x[:100], 2, radius=0.1)  # not the compiler's time
    rows = []
    for workers in (1, 2):
        wall, processor = time.perf_counter(), time.process_time()
        recurrence_quantification(x, 2, radius=0.1, workers=workers)
        rows.append(
            {
                "threads": workers,
                "s of both processors": time.process_time() - processor,
                "s on the clock": time.perf_counter() - wall,
            }
        )
    return rows


def long_series(sizes: tuple[int, ...] = (100_000, 300_000, 1_000_000)) -> list[dict]:
    """Default radii of long series in two threads; the memory is that of the whole process."""
    rows = []
    for n in sizes:
        for dimensions in ((2,), (1, 2, 3, 4, 5, 6)):
            row, memory = apart(_default, n, dimensions)
            rows.append({**row, "MB": memory})
    return rows


def table(rows: list[dict]) -> str:
    heads = list(rows[0])
    lines = [heads, ["---"] * len(heads)]
    for row in rows:
        lines.append([f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()])
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def main() -> None:
    sections = {
        "counting": counting_speed(),
        "beside cKDTree": beside_kdtree(),
        "kernel beside cKDTree": kernel_beside_kdtree(),
        "all dimensions": all_dimensions_speed(),
        "dimensions": dimensions_found(),
        "recurrence": recurrence_speed(),
        "long series": long_series(),
    }
    results = {
        "machine": platform.processor() or platform.machine(),
        "about": versions("numpy", "scipy", "numba", "nolds"),
        **sections,
    }
    text = "\n\n".join(table(rows) for rows in sections.values())
    save("reconstruction", results, text)
    print(text)


if __name__ == "__main__":
    main()
