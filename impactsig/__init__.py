"""Impact signals: load recordings, find and measure impacts, read the dynamics.

The public names, listed in ``__init__.pyi``, are loaded when first used, so that
``import impactsig`` costs nothing. The classes of what functions return are in `results`.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from . import _public

__version__ = "0.1.0"

__all__ = sorted(_public.FUNCTIONS)
_PACKAGES = {module.partition(".")[0] for module in _public.FUNCTIONS.values()}


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return import_module(f"{__name__}.{name}")
    return _public.load(__name__, _public.FUNCTIONS, name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
