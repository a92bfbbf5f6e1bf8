"""A user's law evaluated for many paths in one call."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from numba import cfunc, njit

from ..._compiling import compiled
from ...simulation.exact.user import plain

ROW = "float64[::1]"
SIGNATURE = f"void(float64, {ROW}, {ROW}, {ROW})"


@compiled.cfunc(SIGNATURE)
def no_laws(t, x, v, out):
    """Zero: placeholder for a law that the oscillator does not have."""


@lru_cache(maxsize=256)
def over_paths(law: Callable[[float, float, float], float]) -> Any:
    """A compiled law as a C function of many paths; NaN where it raises."""
    inner = njit(plain(law))

    @cfunc(SIGNATURE)
    def guarded(t: float, x: Any, v: Any, out: Any) -> None:
        for lane in range(len(x)):
            try:
                out[lane] = inner(t, x[lane], v[lane])
            except Exception:
                out[lane] = math.nan

    return guarded
