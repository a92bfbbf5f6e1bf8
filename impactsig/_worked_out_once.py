"""What numba works out again for each call that it compiles, worked out once.

numba asks all templates of an operator for each operation, compiles the text of an error with each
slice that is filled, and keeps instructions that were parsed. None of this changes what a kernel
computes.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.types.functions import BaseFunction
from numba.extending import overload
from numba.np import arrayobj


def _refuse(source: Any, place: Any) -> None:
    """Raise that a slice is filled with an array of another shape.

    To write the shapes into the message numba compiles sixty functions of text.
    """
    raise NotImplementedError


@overload(_refuse)
def _compiled_refuse(source: Any, place: Any) -> Any:
    def refuse(source: Any, place: Any) -> None:
        raise ValueError("cannot assign slice from input of different size")

    return refuse


_kinds: Any = types
_PLAIN = (
    types.Number, types.Boolean, types.Array,
    _kinds.BaseTuple, _kinds.SliceType, _kinds.NoneType,
)  # fmt: skip
_ask = BaseFunction.get_call_type
_known: WeakKeyDictionary[Any, dict[Any, Any]] = WeakKeyDictionary()


def _call_type(function: Any, context: Any, arguments: Any, named: Any) -> Any:
    """The signature of a call; for what is built in, as it was found for these types before."""
    if named or not all(isinstance(one, _PLAIN) for one in arguments):
        return _ask(function, context, arguments, named)
    known = _known.setdefault(function, {})
    key = (context, *arguments)
    if key not in known:
        found: Any = _ask(function, context, arguments, named)
        if function._impl_keys[found.args] is not function.typing_key:  # it was compiled
            return found
        known[key] = found
    function._impl_keys[known[key].args] = function.typing_key
    return known[key]


_add_module = JITCodeLibrary.add_ir_module


def _add_ir_module(library: Any, module: Any) -> None:
    """Take in a module, and let go of its instructions, which the collector would look through.

    They refer to their blocks, and these to them.
    """
    _add_module(library, module)
    for function in module.functions:
        for block in function.blocks:
            block.instructions.clear()
            block.terminator = None
        function.blocks.clear()


CHANGED: tuple[tuple[Any, str, Any], ...] = (
    (arrayobj, "raise_with_shape_context", _refuse),
    (BaseFunction, "get_call_type", _call_type),
    (JITCodeLibrary, "add_ir_module", _add_ir_module),
)
