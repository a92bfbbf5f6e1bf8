"""`min`, `max`, `int`, `numpy.empty` and `numpy.zeros` written where they are called.

numba compiles them as functions, anew for all types of arguments and all options of kernels:
sixty functions of a line each in a first detection. What they compute is numba's own code.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_new_ref, impl_ret_untracked, lower_builtin
from numba.core.typing.templates import signature
from numba.cpython import builtins
from numba.np import arrayobj

_kinds: Any = types
_NUMBERS = types.Integer, types.Float


def signature_in_place(function: Any, context: Any, arguments: Any) -> Any:
    """The signature of a call that is written in place; None where it is not."""
    typed = _TYPED.get(function.typing_key)
    return typed and typed(context, *map(_kinds.unliteral, arguments))


def _type_extreme(context: Any, *arguments: Any) -> Any:
    if len(arguments) < 2 or not all(isinstance(one, _NUMBERS) for one in arguments):
        return None
    kind = context.unify_types(*arguments)
    return kind and signature(kind, *arguments)


def _type_whole(context: Any, *arguments: Any) -> Any:
    if len(arguments) == 1 and isinstance(arguments[0], types.Float):
        return signature(_kinds.intp, *arguments)
    return None


def _type_empty(context: Any, *arguments: Any) -> Any:
    if not 1 <= len(arguments) <= 2:
        return None
    of, *given = arguments
    if not isinstance(of, types.Integer | _kinds.UniTuple):
        return None
    kind = _kinds.float64
    if given and getattr(given[0], "typing_key", None) is not float:
        if not isinstance(given[0], _kinds.NumberClass):
            return None
        kind = given[0].dtype
    dimensions = arrayobj.ty_parse_shape(of)
    return dimensions and signature(types.Array(kind, dimensions, "C"), *arguments)


_TYPED: dict[Any, Callable[..., Any]] = {
    min: _type_extreme,
    max: _type_extreme,
    int: _type_whole,
    np.empty: _type_empty,
    np.zeros: _type_empty,
}


# numba asks for these only where a signature from here is in force.
@lower_builtin(min, _kinds.VarArg(types.Number))
def _write_least(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    return builtins.do_minmax(context, builder, list(sig.args), values, operator.lt)


@lower_builtin(max, _kinds.VarArg(types.Number))
def _write_greatest(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    return builtins.do_minmax(context, builder, list(sig.args), values, operator.gt)


@lower_builtin(int, types.Float)
def _write_whole(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    whole = context.cast(builder, values[0], sig.args[0], sig.return_type)
    return impl_ret_untracked(context, builder, sig.return_type, whole)


@lower_builtin(np.empty, types.Any)
@lower_builtin(np.empty, types.Any, types.Any)
def _write_empty(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    kind, shape = arrayobj._parse_empty_args(context, builder, sig, values)
    made = arrayobj._empty_nd_impl(context, builder, kind, shape)
    return impl_ret_new_ref(context, builder, kind, made._getvalue())


@lower_builtin(np.zeros, types.Any)
@lower_builtin(np.zeros, types.Any, types.Any)
def _write_zeros(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    kind, shape = arrayobj._parse_empty_args(context, builder, sig, values)
    made = arrayobj._empty_nd_impl(context, builder, kind, shape)
    cgutils.memset(builder, made.data, builder.mul(made.itemsize, made.nitems), 0)
    return impl_ret_new_ref(context, builder, kind, made._getvalue())
