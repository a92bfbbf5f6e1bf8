"""User's functions, compiled to C functions that kernels can call."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, lru_cache
from typing import Any

from ...errors import InvalidInput
from ...oscillators import Oscillator
from ..basis.columns import Form, form_of


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

    required = f"a function of {arguments} number{'s' * (arguments > 1)} that numba can compile"
    with refused(argument, function, required):
        inner = njit(plain(function))
        signature = f"float64({', '.join(['float64'] * arguments)})"
        if arguments == 1:

            @cfunc(signature)
            def guarded(v: float) -> float:
                try:
                    return inner(v)
                except Exception:
                    return float("nan")

            return typed(guarded)

        @cfunc(signature)
        def guarded_law(t: float, x: float, v: float) -> float:
            try:
                return inner(t, x, v)
            except Exception:
                return float("nan")

        return typed(guarded_law)


def typed(function: Any) -> Any:
    """A C function that knows its numba type, which every call would make anew."""
    from numba import typeof

    function._numba_type_ = typeof(function)
    return function


@cache
def _stand_in() -> Any:
    from .passing import constant_law

    return typed(constant_law)


def restitution_laws(oscillator: Oscillator) -> tuple[Any, Any]:
    """Restitution of the upper and of the lower stop as C functions; stand-ins for numbers."""
    return laws_of(form_of(oscillator))


def laws_of(form: Form) -> tuple[Any, Any]:
    """Restitution functions of all oscillators of a form."""
    found = {1: _stand_in(), -1: _stand_in()}
    for (side, _), function in zip(form.stops, form.functions, strict=True):
        if function is not None:
            found[side] = compiled("restitution", function, 1)
    return found[1], found[-1]


def plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """The Python function behind a numba dispatcher."""
    return getattr(function, "py_func", function)


@contextmanager
def refused(argument: str, function: Callable[..., Any], required: str) -> Iterator[None]:
    """Turn numba's errors into `InvalidInput` with the first reason.

    Raises
    ------
    InvalidInput
        If anything is raised within.
    """
    try:
        yield
    except Exception as error:  # numba raises its own and others, as what it is given has it
        lines = [line.strip() for line in str(error).splitlines()]
        messages = [line for line in lines if line and not line.startswith("Failed in")]
        reason = messages[0] if messages else type(error).__name__
        name = getattr(function, "__name__", repr(function))
        raise InvalidInput(argument, name, required, f"numba says: {reason}") from error
