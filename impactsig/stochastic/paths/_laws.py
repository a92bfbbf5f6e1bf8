"""A user's law for many paths at once, so that calling it costs little and it may be vectorised."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from numba import cfunc, njit

from ... import _compiled
from ...simulate.exact.user import plain

ROW = "float64[::1]"
SIGNATURE = f"void(float64, {ROW}, {ROW}, {ROW})"


@_compiled.cfunc(SIGNATURE)
def no_laws(t, x, v, out):
    """Nothing, where a kernel wants a law."""


@lru_cache(maxsize=256)
def over_paths(law: Callable[[float, float, float], float]) -> Any:
    """The law of a path, one that compiles, as a C function of many; NaN where it raises."""
    inner = njit(plain(law))

    @cfunc(SIGNATURE)
    def guarded(t: float, x: Any, v: Any, out: Any) -> None:
        for lane in range(len(x)):
            try:
                out[lane] = inner(t, x[lane], v[lane])
            except Exception:
                out[lane] = math.nan

    return guarded
