"""Functions that users give, compiled so that compiled kernels can call them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ..errors import InvalidInput


@lru_cache(maxsize=256)
def compiled(argument: str, function: Callable[..., float], arguments: int) -> Any:
    """`function` of so many floats as a C function; it returns NaN where it raises.

    Given as a C function, and not as a compiled function of its own type, it leaves the kernel's
    type as it is, so that the kernel is found in numba's cache.

    Raises
    ------
    InvalidInput
        If numba cannot compile it.
    """
    from numba import cfunc, njit

    inner = getattr(function, "py_func", function)
    try:
        inner = njit(inner)
        signature = f"float64({', '.join(['float64'] * arguments)})"
        if arguments == 1:

            @cfunc(signature)
            def guarded(v: float) -> float:
                try:
                    return inner(v)
                except Exception:
                    return float("nan")

            return guarded

        @cfunc(signature)
        def guarded_law(t: float, x: float, v: float) -> float:
            try:
                return inner(t, x, v)
            except Exception:
                return float("nan")

        return guarded_law
    except Exception as error:  # numba raises its own and others, as what it is given has it
        lines = [line for line in str(error).splitlines() if line.strip()]
        reason = next((line for line in lines if not line.startswith("Failed in")), str(error))
        raise InvalidInput(
            argument,
            getattr(function, "__name__", function),
            f"a function of {arguments} number{'s' * (arguments > 1)} that numba can compile",
            f"numba says: {reason}",
        ) from error
