"""Variables and elements of arrays, written in fewer instructions than numba writes.

numba keeps an array in memory for each element that is read, takes its shape and strides from there
twice, and looks for references in numbers. LLVM removes all of this again before it optimises
functions together: what a kernel computes is the same.
"""

from __future__ import annotations

import functools
from typing import Any

from numba.core import cgutils, lowering, types
from numba.np import arrayobj

_make_array = arrayobj.make_array


@functools.cache
def _array(kind: Any) -> Any:
    """What reads and writes the parts of an array of this type.

    numba makes a class for each array that is used, and looks each time whether its type is to be
    turned into an array first.
    """
    made: Any = _make_array(kind)
    if type(kind) is not types.Array:
        return made
    del made._make_refs

    class OfValue(made):
        """An array whose parts are read from the value that it was made of."""

        def __init__(self, context: Any, builder: Any, value: Any = None, ref: Any = None) -> None:
            self._given = None
            super().__init__(context, builder, value=value, ref=ref)
            self._given = value

        @property
        def shape(self) -> Any:
            return made.shape.fget(self) if self._given is None else self._part("shape")

        def __getitem__(self, index: int) -> Any:
            if self._given is None:
                return super().__getitem__(index)
            return self._builder.extract_value(self._given, index)

        def _part(self, name: str) -> Any:
            return self[self._datamodel.get_field_position(name)]

        def _get_ptr_by_index(self, index: int) -> Any:  # through which parts may be changed
            self._given = None
            return super()._get_ptr_by_index(index)

        def _getpointer(self) -> Any:
            self._given = None
            return super()._getpointer()

        def _setvalue(self, value: Any) -> None:
            self._given = None
            super()._setvalue(value)

    return OfValue


_index = arrayobj.basic_indexing


def _indexed(
    context: Any,
    builder: Any,
    kind: Any,
    array: Any,
    index_types: Any,
    indices: Any,
    boundscheck: Any = None,
) -> Any:
    """Where an element is, if there is a whole number for each axis."""
    plain = len(indices) == kind.ndim and all(isinstance(one, types.Integer) for one in index_types)
    if boundscheck or not plain:
        return _index(context, builder, kind, array, index_types, indices, boundscheck)
    shape = cgutils.unpack_tuple(builder, array.shape, kind.ndim)
    of_axes = [
        arrayobj.fix_integer_index(context, builder, *one)
        for one in zip(index_types, indices, shape, strict=True)
    ]
    if kind.layout in "CF" and kind.ndim == 1:
        return builder.gep(array.data, of_axes), [], []
    strides = [] if kind.layout in "CF" else cgutils.unpack_tuple(builder, array.strides, kind.ndim)
    place = cgutils.get_item_pointer2(
        context, builder, array.data, shape, strides, kind.layout, of_axes
    )
    return place, [], []


_store, _delete, _reserve = (
    lowering.Lower.storevar,
    lowering.Lower.delvar,
    lowering.Lower.alloca_lltype,
)


def _holds_references(lower: Any, name: str) -> bool:
    """Whether something counts the references in a variable."""
    if not lower.context.enable_nrt:
        return False
    model = lower.context.data_model_manager[lower.typeof(name)]
    return bool(model.contains_nrt_meminfo())


def _is_debugged(lower: Any) -> bool:
    return lower.flags is None or bool(lower.flags.debuginfo)


def _store_variable(lower: Any, value: Any, name: str, argidx: Any = None) -> None:
    """Without a look at the value before, where nothing counts references."""
    if _is_debugged(lower) or name in lower._singly_assigned_vars or _holds_references(lower, name):
        _store(lower, value, name, argidx)
        return
    lower._alloca_var(name, lower.typeof(name))
    place = lower.getvar(name)
    if value.type != place.type.pointee:
        _store(lower, value, name, argidx)  # raises
    lower.builder.store(value, place)


def _delete_variable(lower: Any, name: str) -> None:
    """Only where something counts references, or numba has not met the variable."""
    known = name in lower._blk_local_varmap or name in lower.varmap
    if _is_debugged(lower) or not known or _holds_references(lower, name):
        _delete(lower, name)


def _reserved(lower: Any, name: str, kind: Any, datamodel: Any = None) -> Any:
    """Memory for a variable; its size is asked for only where a debugger wants it."""
    if _is_debugged(lower):
        return _reserve(lower, name, kind, datamodel)
    return cgutils.alloca_once(lower.builder, kind, name=name, zfill=False)


CHANGED: tuple[tuple[Any, str, Any], ...] = (
    (arrayobj, "make_array", _array),
    (arrayobj, "basic_indexing", _indexed),
    (lowering.Lower, "storevar", _store_variable),
    (lowering.Lower, "delvar", _delete_variable),
    (lowering.Lower, "alloca_lltype", _reserved),
)
