"""Files in `benchmarks/results`, in which benchmarks leave what they measure."""

from __future__ import annotations

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any


def result_file(name: str) -> Path:
    """A path in the folder of results, which is made if it is not there."""
    folder = Path(__file__).parent / "results"
    folder.mkdir(exist_ok=True)
    return folder / name


def save(name: str, data: Any, page: str = "") -> None:
    """Write data as NAME.json and a page, if there is one, as NAME.md."""
    result_file(f"{name}.json").write_text(json.dumps(data, indent=1) + "\n")
    if page:
        result_file(f"{name}.md").write_text(page.rstrip("\n") + "\n")


def versions(*packages: str) -> dict[str, str]:
    """Versions of Python, impactsig and other packages, of which some may be absent."""
    found = {"python": platform.python_version()}
    for name in ("impactsig", *packages):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "absent"
    return found
