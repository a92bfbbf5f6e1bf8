"""Kernels for a GPU, made of the functions that CPUs run."""

from __future__ import annotations

import contextlib
import functools
import threading
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numba import cuda

from ..errors import ImpactsigError
from ._cells import brief
from .device import THREADS, blocks, simulated

_fusing = threading.Lock()


@contextlib.contextmanager
def without_fusing() -> Iterator[None]:
    """Disable fused multiply-add, so that results round as on CPUs.

    NVVM makes one operation, rounded once, of a product and a sum, which orbits of a chaotic map
    soon show. NVVM has an option against it, which numba-cuda does not pass on (its issue 118).
    """
    from numba.cuda.cudadrv import nvvm

    with _fusing:
        own = nvvm.compile_ir
        nvvm.compile_ir = functools.partial(own, fma=False)
        try:
            yield
        finally:
            nvvm.compile_ir = own


class Each:
    """A kernel that runs a function once for each of many machines, a thread each.

    Parameters
    ----------
    function : numba dispatcher
        ``function(k, slot, *arguments)`` for machine k, whose work arrays are at `slot`; of this
        package, and compiled for CPUs, from whose source the GPU's code is compiled.
    """

    def __init__(self, function: Any) -> None:
        self.function = function

    @functools.cached_property
    def _kernel(self) -> Any:
        function = python_of(self.function) if simulated() else self.function

        def each(order: Any, arguments: Any) -> None:
            slot = cuda.grid(1)
            if slot < len(order):
                function(order[slot], slot, *arguments)

        # Optimised when linked, products and sums would be fused.
        return cuda.jit(each) if simulated() else cuda.jit(each, lto=False)

    def __call__(self, order: np.ndarray, *arguments: Any) -> None:
        """Run machines in this order, neighbours side by side.

        Arrays among the arguments are changed as the function changes them; those within tuples,
        which are for reading or for work, are not brought back.

        Raises
        ------
        ImpactsigError
            If the GPU fails.
        """
        if not len(order):
            return
        try:
            given = tuple(_sent(one) for one in arguments)
            there = cuda.to_device(order)
            with contextlib.nullcontext() if simulated() else without_fusing():
                self._kernel[blocks(len(order)), THREADS](there, given)
            for own, sent in zip(arguments, given, strict=True):
                if isinstance(own, np.ndarray) and own.size:
                    own[...] = sent.copy_to_host()
        except Exception as error:
            raise ImpactsigError(
                f'the GPU has failed: {brief(error)}. Take fewer at once, or executor="threads"'
            ) from error


def _sent(value: Any) -> Any:
    """An argument on the device."""
    if isinstance(value, tuple):
        parts = [_sent(part) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, np.ndarray):
        return cuda.to_device(np.ascontiguousarray(value))
    return value


@functools.cache
def python_of(function: Any) -> Callable[..., Any]:
    """The Python function behind a kernel, calling those behind the kernels that it calls.

    numba's simulator of a GPU runs Python, whose arrays compiled functions cannot take.
    """
    plain = function.py_func
    names = dict(plain.__globals__)
    for name in plain.__code__.co_names:
        if hasattr(names.get(name), "py_func"):
            names[name] = python_of(names[name])
    return types.FunctionType(
        plain.__code__, names, plain.__name__, plain.__defaults__, plain.__closure__
    )
