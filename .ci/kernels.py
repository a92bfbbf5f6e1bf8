"""From the wheel in dist/, make one for Linux on x86-64 that carries compiled kernels.

    python .ci/kernels.py

The kernels are those of `impactsig warmup`, compiled for `compiled.shipped_target()` by the
versions of Python, numba, llvmlite and numpy that run this script, and used by these alone: with
others the wheel compiles as the plain one does. Needs `python -m pip install wheel`, and minutes.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

root = Path(__file__).resolve().parents[1]
dist = root / "dist"
PYTHON = f"cp{sys.version_info[0]}{sys.version_info[1]}"
# numba's own wheels, without which these kernels are of no use, need a newer system.
TAG = f"{PYTHON}-{PYTHON}-manylinux_2_17_x86_64"
LARGEST = 40e6  # bytes
COMMANDS = (  # README's
    "info {data}/loadcell_periodic_22.1Hz.wav",
    "detect {data}/loadcell_chaotic_20.1Hz.wav --sensor force --unit V -o impacts.csv",
    "simulate karpodinis --frequency 20.1 --transient 200 --periods 2000 -o model.csv",
    "dimension model.csv --surrogates -o dimension.pdf",
    "compare impacts.csv model.csv --forcing-frequency 20.1",
    "report {data}/loadcell_periodic_22.1Hz.wav --unit V --forcing-frequency 22.1",
)


def run(*command: str | Path, where: Path, **variables: str) -> float:
    """Run with the package in a folder; the seconds of processor time that it took."""
    hidden = ("NUMBA_", "PYTHONPATH")
    plain = {name: value for name, value in os.environ.items() if not name.startswith(hidden)}
    before = os.times()
    subprocess.run(
        command, check=True, cwd=where.parent, stdout=subprocess.DEVNULL,
        env=plain | {"PYTHONPATH": str(where), "MPLBACKEND": "Agg"} | variables,
    )  # fmt: skip
    after = os.times()
    return after[2] + after[3] - before[2] - before[3]


def packing(*words: str | Path) -> None:
    subprocess.run([sys.executable, "-m", "wheel", *words], check=True, stdout=subprocess.DEVNULL)


def unpacked(wheel: Path, folder: Path) -> Path:
    packing("unpack", wheel, "--dest", folder)
    (contents,) = folder.iterdir()
    return contents


def compile_kernels(contents: Path) -> None:
    """Compile beside the sources, as for a user, and put aside what came of it."""
    where = "from impactsig._compiling.compiled import shipped_target; print(*shipped_target()[1:])"
    target = subprocess.run(
        [sys.executable, "-c", where], cwd=contents, check=True, capture_output=True, text=True
    )
    name, features = target.stdout.split()
    warmup = [sys.executable, "-m", "impactsig", "warmup"]
    run(*warmup, where=contents, NUMBA_CPU_NAME=name, NUMBA_CPU_FEATURES=features)
    for cache in list(contents.rglob("__pycache__")):
        kept = [path for path in cache.iterdir() if path.suffix in (".nbi", ".nbc")]
        if kept:
            (folder := cache.with_name("_kernels")).mkdir()
            for path in kept:
                path.rename(folder / path.name)
        shutil.rmtree(cache)


def retag(contents: Path) -> None:
    (about,) = contents.glob("*.dist-info/WHEEL")
    kept = [one for one in about.read_text().splitlines() if not one.startswith(("Root", "Tag"))]
    lines = [*filter(None, kept), "Root-Is-Purelib: false", f"Tag: {TAG}", ""]
    about.write_text("\n".join(lines))


def check(wheel: Path, folder: Path) -> None:
    """README's commands, which must compile nothing."""
    contents = unpacked(wheel, folder / "installed")
    cache = folder / "cache"
    data = contents / "impactsig" / "_samples"
    for command in COMMANDS:
        words = command.format(data=data).split()
        variables = {"NUMBA_CACHE_DIR": str(cache)}
        took = run(sys.executable, "-m", "impactsig", *words, where=contents, **variables)
        print(f"impactsig {words[0]}: {took:.1f} s of processor time", flush=True)
    if compiled := sorted(path.name for path in cache.rglob("*.nbc")):
        sys.exit(f"{wheel.name}: these were compiled again: {compiled}")


if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
    sys.exit("kernels are shipped for Linux on x86-64 alone")
(plain,) = dist.glob("*-none-any.whl")
with tempfile.TemporaryDirectory(prefix="impactsig-") as work:
    contents = unpacked(plain, Path(work) / "contents")
    compile_kernels(contents)
    retag(contents)
    packing("pack", contents, "--dest-dir", dist)
    (wheel,) = dist.glob(f"*-{TAG}.whl")
    check(wheel, Path(work))
size = wheel.stat().st_size
if size > LARGEST:
    sys.exit(f"{wheel.name} has {size / 1e6:.0f} MB")
print(f"{wheel.name}: {size / 1e6:.1f} MB")
