"""Build the sdist, and the wheel from the sdist; then work with nothing but their contents.

What is built stays in dist/. Needs `python -m pip install build` and the extra `test`.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

root = Path(__file__).resolve().parents[1]
dist = root / "dist"
TESTS = [f"tests/unit/test_{name}.py" for name in ("package", "names")]


def run(*command: str | Path, **options: object) -> None:
    subprocess.run(command, check=True, **options)


shutil.rmtree(dist, ignore_errors=True)
run(sys.executable, "-m", "build", "--outdir", dist, root, stdout=subprocess.DEVNULL)
(sdist,), (wheel,) = dist.glob("*.tar.gz"), dist.glob("*.whl")

tracked = subprocess.run(
    ["git", "ls-files"], cwd=root, check=True, capture_output=True, text=True
).stdout.split("\n")
with tarfile.open(sdist) as packed:
    held = {name.split("/", 1)[1] for name in packed.getnames() if "/" in name}
if missing := {name for name in tracked if name} - held:
    sys.exit(f"{sdist.name} lacks {sorted(missing)}")
with zipfile.ZipFile(wheel) as packed:
    places = {name.split("/")[0] for name in packed.namelist()}
if {name for name in places if not name.endswith(".dist-info")} != {"impactsig"}:
    sys.exit(f"{wheel.name} would install {sorted(places)}")

with tempfile.TemporaryDirectory() as work:
    with tarfile.open(sdist) as packed:
        packed.extractall(work)  # our own; `filter` came with Python 3.11.4
    (sources,) = Path(work).iterdir()
    shutil.rmtree(sources / "impactsig")  # the tests of the sdist, the code of the wheel
    installed = Path(work) / "installed"
    run(sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", installed, wheel)
    alone = os.environ | {"PYTHONPATH": str(installed), "MPLBACKEND": "Agg"}
    where = "import impactsig; print(impactsig.__file__)"
    found = subprocess.run(
        [sys.executable, "-c", where], cwd=sources, env=alone, check=True, capture_output=True
    )
    if str(installed) not in found.stdout.decode():
        sys.exit(f"the code of {found.stdout.decode().strip()} was found, not that of the wheel")
    # README's first command runs the demo, from a wheel too; here its samples must be in it.
    samples = sorted((installed / "impactsig" / "_samples").glob("*.wav"))
    run(sys.executable, "-m", "impactsig", "info", *samples, cwd=work, env=alone)
    run(sys.executable, "-m", "pytest", "-q", "-n", "0", *TESTS, cwd=sources, env=alone)
print(f"{sdist.name} and {wheel.name} work by themselves")
