"""The functions of flows as C functions, which leave the kernels' types as they are.

A kernel that took compiled functions of a type of their own would be compiled anew for each, in
every process. Lorenz' and Rössler's are kept in numba's cache; a user's are compiled in half a
second.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from numba import carray, cfunc, literal_unroll, njit, types
from numba.extending import overload
from numba.np.unsafe.ndarray import to_fixed_tuple

from ..._compiling import compiled
from ...oscillators import flows
from ..exact.user import plain, refused

POINTER = types.CPointer(types.float64)
RATES = types.void(types.float64, POINTER, POINTER, POINTER)  # t, y, parameters, rates
SIGNAL = types.float64(POINTER, types.int64)  # y, number of the coordinate

_lorenz_rates = njit(flows.lorenz_rates)
_rossler_rates = njit(flows.rossler_rates)
_lorenz_signal = njit(flows.lorenz_signal)
_rossler_signal = njit(flows.rossler_signal)


@compiled.cfunc(RATES)
def _lorenz(t, y, p, out):
    out[0], out[1], out[2] = _lorenz_rates(t, y, p[0], p[1], p[2])


@compiled.cfunc(RATES)
def _rossler(t, y, p, out):
    out[0], out[1], out[2] = _rossler_rates(t, y, p[0], p[1], p[2])


@compiled.cfunc(SIGNAL)
def _of_lorenz(y, k):
    return _lorenz_signal(y)


@compiled.cfunc(SIGNAL)
def _of_rossler(y, k):
    return _rossler_signal(y)


@compiled.cfunc(SIGNAL)
def coordinate(y, k):
    """The signal that is a coordinate itself."""
    return y[k]


_KEPT: dict[Callable[..., Any], Any] = {
    flows.lorenz_rates: _lorenz,
    flows.rossler_rates: _rossler,
    flows.lorenz_signal: _of_lorenz,
    flows.rossler_signal: _of_rossler,
}


def copy(rates, out):
    """Put rates of any kind into an array."""


@overload(copy)
def _copy(rates, out):
    if isinstance(rates, types.BaseTuple):

        def fill(rates, out):  # a whole number among them is no hindrance
            k = 0
            for rate in literal_unroll(rates):
                out[k] = rate
                k += 1  # noqa: SIM113 (numba unrolls no enumerate)

    else:

        def fill(rates, out):
            for k in range(len(rates)):
                out[k] = rates[k]

    return fill


@lru_cache(maxsize=256)
def rates_of(function: Callable[..., Any], dimension: int, parameters: int) -> Any:
    """The rates of a flow as a C function; they are NaN where the user's function raises.

    Raises
    ------
    InvalidInput
        If numba cannot compile it, or it does not give a number for every coordinate.
    """
    if function in _KEPT:
        return _KEPT[function]
    required = f"a function of t, y and {parameters} parameters that numba can compile"
    with refused("function", function, required):
        inner = njit(error_model="numpy")(plain(function))

        @njit(error_model="numpy")
        def fill(t, y, p, out):
            rates = inner(t, y, *to_fixed_tuple(p, parameters))
            if len(rates) != dimension:
                raise ValueError
            copy(rates, out)

        @cfunc(RATES)
        def native(t, y, p, out):
            state, rates = carray(y, (dimension,)), carray(out, (dimension,))
            try:
                fill(t, state, carray(p, (parameters,)), rates)
            except Exception:
                for k in range(dimension):
                    rates[k] = math.nan

        return native


@lru_cache(maxsize=256)
def signal_of(function: Callable[..., Any], dimension: int) -> Any:
    """A signal as a C function; it is NaN where the user's function raises.

    Raises
    ------
    InvalidInput
        If numba cannot compile it, or it gives no number.
    """
    if function in _KEPT:
        return _KEPT[function]
    required = "a function of the state y, giving a number, that numba can compile"
    with refused("signal", function, required):
        inner = njit(error_model="numpy")(plain(function))

        @cfunc(SIGNAL)
        def native(y, k):
            value = math.nan
            try:
                value = float(inner(carray(y, (dimension,))))
            except Exception:
                value = math.nan
            return value

        return native
