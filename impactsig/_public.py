"""Public names, loaded when they are first used.

The stubs ``__init__.pyi`` and ``results.pyi`` list them, and nothing else does: type checkers and
editors read the stubs, and so does this module.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

PACKAGE = __name__.rpartition(".")[0]

_LISTED = re.compile(r"^from \.([\w.]*) import (?:\(\s+)?(\w+) as \2(?:,\s+\))?$", re.MULTILINE)


def listed(stub: str) -> dict[str, str]:
    """Read the public names, and the module of each, from a stub beside this file."""
    path = Path(__file__).with_name(stub)
    text: bytes = globals()["__loader__"].get_data(str(path))  # which may be in a zip archive
    return {name: module for module, name in _LISTED.findall(text.decode())}


FUNCTIONS = listed("__init__.pyi")
"""What `impactsig` offers: functions, and what their user makes to hand to them."""
RESULTS = listed("results.pyi")
"""What `impactsig.results` offers: the classes of what the functions return."""


def load(module: str, names: dict[str, str], name: str) -> Any:
    """Import the object behind a public name, and keep it in the module."""
    if name not in names:
        raise AttributeError(f"module {module!r} has no attribute {name!r}")
    home = import_module(".".join(filter(None, [PACKAGE, names[name]])))
    value = getattr(home, name) if names[name] else import_module(f"{PACKAGE}.{name}")
    setattr(sys.modules[module], name, value)
    return value
