"""Classes of results: what the functions of `impactsig` return.

They are made by the functions, never by hand, and are public for their attributes and methods,
and for `isinstance`. Each is loaded when first used.
"""

from __future__ import annotations

from typing import Any

from . import _public

__all__ = sorted(_public.RESULTS)


def __getattr__(name: str) -> Any:
    return _public.load(__name__, _public.RESULTS, name)


def __dir__() -> list[str]:
    return __all__
