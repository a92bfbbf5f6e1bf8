"""What numba works out again for each call that it compiles, worked out once.

numba asks all templates of an operator for each operation, compiles the text of an error with each
slice that is filled, keeps instructions that were parsed, looks nine times how long a variable is
needed, and takes in what modules declare wherever it finds no function. None of this changes what a
kernel computes.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

from llvmlite.binding import ffi
from numba.core import base, ir, types
from numba.core.codegen import JITCodeLibrary
from numba.core.inline_closurecall import InlineClosureCallPass
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.transforms import canonicalize_cfg
from numba.core.types.functions import BaseFunction
from numba.extending import overload
from numba.np import arrayobj

from ._written_in_place import signature_in_place


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
    in_place = None if named else signature_in_place(function, context, arguments)
    if in_place is not None:
        function._impl_keys[in_place.args] = function.typing_key
        return in_place
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


_refresh_all = base.BaseContext.refresh
_counts: WeakKeyDictionary[Any, int] = WeakKeyDictionary()


def _refresh(context: Any) -> None:
    """Take in what modules declare, if there is more of it than the last time."""
    if _counts.get(context) != _declared(context):
        _refresh_all(context)
        _counts[context] = _declared(context)


def _declared(context: Any) -> int:
    """How many functions and attributes are declared to numba."""
    both = *context._registries, *context.typing_context._registries
    return sum(len(part) for one in both for part in vars(one).values() if isinstance(part, list))


_inline = InlineClosureCallPass.run


def _run_inlining(work: Any) -> None:
    """Write functions into the one that they stand in, if there is any; numba looks long for it."""
    if any(_may_be_inlined(one) for block in work.func_ir.blocks.values() for one in block.body):
        _inline(work)


def _may_be_inlined(statement: Any) -> bool:
    """A function within a function, a list (of an array), `functools.reduce` or a stencil."""
    value = getattr(statement, "value", None)
    if isinstance(value, ir.Expr):
        named = value.op == "getattr" and value.attr in ("reduce", "stencil")
        return named or value.op in ("make_function", "build_list")
    if isinstance(value, ir.Global | ir.FreeVar):
        return getattr(value.value, "__name__", "") in ("reduce", "stencil", "StencilFunc") or (
            type(value.value).__name__ == "StencilFunc"
        )
    return False


_list = ir.Inst._rec_list_vars
_WITHOUT = frozenset((str, int, float, bool, type(None), ir.Loc, ir.Scope))


def _list_variables(instruction: Any, value: Any) -> list[Any]:
    """The variables in parts of an instruction, without a call for each name and number."""
    kind = type(value)
    if kind is ir.Var:
        return [value]
    if kind not in (dict, list, tuple):
        return [] if kind in _WITHOUT else list(_list(instruction, value))
    found: list[Any] = []
    for part in value.values() if kind is dict else value:
        kind = type(part)
        if kind is ir.Var:
            found.append(part)
        elif kind not in _WITHOUT:
            found += _list_variables(instruction, part)
    return found


_takes_place = base._has_loc
_taking: WeakKeyDictionary[Any, bool] = WeakKeyDictionary()


def _has_loc(function: Any) -> bool:
    """Whether what writes an operation takes its place in the source; asked once of each."""
    try:
        if function not in _taking:
            _taking[function] = _takes_place(function)
        return _taking[function]
    except TypeError:  # nothing can refer to it weakly
        return bool(_takes_place(function))


_process = PostProcessor.run


def _run(processor: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Look how long variables are needed only where that is used: in two passes of nine."""
    code = processor.func_ir
    if emit_dels or code.is_generator:
        _process(processor, emit_dels, extend_lifetimes)
        return
    code.blocks = canonicalize_cfg(code.blocks)
    code.variable_lifetime = VariableLifetime(code.blocks)
    code.generator_info = None


def _optimize_functions(library: Any, module: Any) -> None:
    """Functions by themselves, with passes that are set up once for all of a module."""
    module.data_layout = library._codegen._data_layout
    manager, builder = library._codegen._function_pass_manager()
    for function in module.functions:
        if not function.is_declaration:
            manager.run(function, builder)


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
    (JITCodeLibrary, "_optimize_functions", _optimize_functions),
    (ir.Inst, "_rec_list_vars", _list_variables),
    (base, "_has_loc", _has_loc),
    (base.BaseContext, "refresh", _refresh),
    (InlineClosureCallPass, "run", _run_inlining),
    (PostProcessor, "run", _run),
    (ffi.lib._lock, "_cblist", []),  # where numba measures time that nobody reads
)
