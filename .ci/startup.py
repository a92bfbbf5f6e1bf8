"""Starting up must cost next to nothing: what is imported, and for how long."""

from __future__ import annotations

import subprocess
import sys
import time

HEAVY = {"numba", "matplotlib", "pandas", "scipy", "soundfile"}
PROBE = f"import impactsig, sys; print(*sorted({HEAVY!r} & set(sys.modules)))"


def best_of(command: list[str], runs: int = 5) -> float:
    """Least wall time of several runs [s]: the machine's noise only ever adds."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - start)
    return min(times)


loaded = subprocess.run(
    [sys.executable, "-c", PROBE], check=True, capture_output=True, text=True
).stdout.strip()
if loaded:
    sys.exit(f"import impactsig also imports {loaded}")
bare = best_of([sys.executable, "-c", "pass"])
for name, command, limit in (
    ("import impactsig", [sys.executable, "-c", "import impactsig"], 0.3),
    ("impactsig --help", [sys.executable, "-m", "impactsig", "--help"], 0.5),
):
    taken = best_of(command) - (bare if name.startswith("import") else 0.0)
    print(f"{name}: {taken:.3f} s (limit {limit} s)")
    if taken > limit:
        sys.exit(f"{name} takes {taken:.3f} s, more than {limit} s")
