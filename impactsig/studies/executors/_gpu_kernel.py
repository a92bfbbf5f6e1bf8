"""The GPU kernel that evaluates one cell in every thread."""

from __future__ import annotations

import functools
import inspect
import types
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import cuda

from ...errors import InvalidInput
from .._cells import brief, is_compiled, name_of
from ..device_kernels import without_fusing

REQUIRED = (
    "for a GPU, a function of one cell, of numbers, that numba can compile and that returns a "
    "number, or a tuple or NamedTuple of numbers"
)


class Field(NamedTuple):
    """An observable: type, shape, and its position in the returned value."""

    name: str
    dtype: np.dtype
    shape: tuple[int, ...]
    places: list[str]


class _Call(NamedTuple):
    """Source of the function's arguments, and the values of those that are fixed."""

    function: Any
    arguments: str
    fixed: dict[str, Any]


def compiled(
    function: Callable[..., Any], kinds: Mapping[str, np.dtype]
) -> tuple[Any, list[Field]]:
    """The kernel for the current GPU, and its observables.

    Parameters
    ----------
    function : callable
        A function of one cell, plain or compiled by numba, or a partial of one.
    kinds : mapping of str to dtype
        The parameters, as numbers of which type the function receives them.

    Returns
    -------
    kernel
        To be launched with an int8 array of zeros, which become ones where a cell comes to an end;
        with a column of each parameter; and with an array for each observable.
    fields : list of Field

    Raises
    ------
    InvalidInput
        If it cannot be compiled, or returns something else than numbers.
    """
    call = _call(function, list(kinds))
    numbers = [numba.from_dtype(kind) for kind in kinds.values()]
    fields = _fields(call.function, _returned(call, numbers))
    names = [f"column_{n}" for n in range(len(kinds))] + [f"result_{n}" for n in range(len(fields))]
    source = [
        f"def cells({', '.join(['ended', *names])}):",
        "    cell = cuda.grid(1)",
        "    if cell < ended.size:",
        f"        found = function({call.arguments.format('[cell]')})",
    ]
    for n, one in enumerate(fields):
        for index, place in enumerate(one.places):
            at = f"cell, {index}" if one.shape else "cell"
            source.append(f"        result_{n}[{at}] = found{place}")
    # After all else: where the function raises, the thread ends before.
    source.append("        ended[cell] = 1")
    arrays = [numba.types.Array(kind, 1, "C") for kind in numbers]
    arrays += [
        numba.types.Array(numba.from_dtype(one.dtype), 1 + len(one.shape), "C") for one in fields
    ]
    signature = numba.types.void(numba.types.int8[::1], *arrays)
    python = getattr(call.function, "py_func", call.function)
    try:
        return _for_device("\n".join(source), python, call.fixed, signature), fields
    except Exception as error:
        raise _refused(call.function, error) from None


def _call(function: Any, columns: list[str]) -> _Call:
    """The function, with the arguments that a partial or its defaults give it."""
    args: tuple[Any, ...] = ()
    keywords: dict[str, Any] = {}
    if isinstance(function, functools.partial):
        function, args, keywords = function.func, function.args, function.keywords
    if not isinstance(getattr(function, "py_func", function), types.FunctionType):
        raise _refused(function, f"it is of type {type(function).__name__}")
    sources = {name: f"column_{n}{{0}}" for n, name in enumerate(columns)}
    try:
        bound = inspect.signature(function).bind(*args, **(keywords | sources))
    except TypeError as error:
        raise _refused(function, error) from None
    bound.apply_defaults()
    if bound.kwargs:
        raise _refused(function, f"{', '.join(bound.kwargs)} can be given by name only")
    fixed: dict[str, Any] = {}
    arguments = []
    for value in bound.args:
        if any(value is one for one in sources.values()):
            arguments.append(value)
        else:
            arguments.append(f"fixed_{len(fixed)}")
            fixed[arguments[-1]] = value
    return _Call(function, ", ".join(arguments), fixed)


def _returned(call: _Call, numbers: list[Any]) -> Any:
    """Type that the function returns when compiled for CPUs."""
    function = call.function if is_compiled(call.function) else numba.njit(call.function)
    names = ", ".join(f"column_{n}" for n in range(len(numbers)))
    source = f"def one({names}):\n    return function({call.arguments.format('')})"
    try:
        one = numba.njit(_defined(source, "one", {"function": function, **call.fixed}))
        one.compile(tuple(numbers))
    except Exception as error:
        raise _refused(call.function, error) from None
    return one.overloads[tuple(numbers)].signature.return_type


def _fields(function: Any, returned: Any) -> list[Field]:
    """Observables in the type of a returned value, named as a sweep on CPUs names them."""
    named = isinstance(returned, numba.types.BaseNamedTuple)
    values = zip(returned.fields, returned.types, strict=True) if named else [("value", returned)]
    fields = []
    for n, (name, kind) in enumerate(values):
        place = f"[{n}]" if named else ""
        shape: tuple[int, ...] = ()
        places, kinds = [place], [kind]
        if isinstance(kind, numba.types.BaseTuple):
            kinds = list(kind.types)
            shape, places = (len(kinds),), [f"{place}[{m}]" for m in range(len(kinds))]
        numbers = all(isinstance(one, numba.types.Number | numba.types.Boolean) for one in kinds)
        if not kinds or not numbers:
            raise _refused(function, f"{name if named else 'what it returns'} is {kind}")
        # As Python's numbers: one cell's 0 is another's 0.5.
        real = not any(isinstance(one, numba.types.Complex) for one in kinds)
        fields.append(Field(name, np.dtype(np.float64 if real else np.complex128), shape, places))
    return fields


def _for_device(source: str, function: Any, fixed: dict[str, Any], signature: Any) -> Any:
    """The compiled kernel, or the Python function in the simulator."""
    simulated = numba.config.ENABLE_CUDASIM
    inner = cuda.jit(_ending_alone(function) if simulated else function, device=True)
    kernel = _defined(source, "cells", {"cuda": cuda, "function": inner, **fixed})
    if simulated:
        return cuda.jit(kernel)
    with without_fusing():
        return cuda.jit(signature, lto=False)(kernel)  # optimised when linked, it would be fused


def _ending_alone(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let an error end only its own thread in the simulator, as on a device."""

    def cell(*values: Any) -> Any:
        try:
            return function(*values)
        except Exception:
            raise SystemExit from None

    return cell


def _defined(source: str, name: str, names: dict[str, Any]) -> Any:
    exec(source, names)
    return names[name]


def _refused(function: Any, why: Any) -> InvalidInput:
    text = brief(why) if isinstance(why, Exception) else why
    return InvalidInput(
        "function", name_of(function), REQUIRED,
        f'Here, {text}. Others run with executor="processes"',
    )  # fmt: skip
