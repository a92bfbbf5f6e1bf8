"""Link kernels so that each is optimised once, with all that it calls.

numba optimises a kernel with what it calls and makes machine code of all that, and does so again
for each kernel that calls this one. Here a function that only kernels call is kept as numba wrote
it, and a kernel that Python calls is optimised once, together with its own copies of all functions
that it reaches. These do not depend on what the process compiled or called before, and neither do
the last digits of results. numba leaves copies weak: of those with one name, the first that is
loaded would serve all callers.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import numba
from llvmlite import binding
from numba.core.codegen import JITCodeLibrary
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]
from numba.core.targetconfig import TargetConfig

KNOWN = numba.__version__.startswith("0.68.")
"""What is replaced here is numba's own, and may be something else in other versions: there kernels
are linked as numba links them, which takes half as long again."""


@contextlib.contextmanager
def linked_once() -> Iterator[None]:
    """Compile kernels so; within itself, and under numba's lock."""
    if not KNOWN or JITCodeLibrary.finalize is _finalize:
        yield
        return
    from ._typed_once import CHANGED as TYPED
    from ._worked_out_once import CHANGED as WORKED_OUT  # these import numba's functions of arrays
    from ._written_briefly import CHANGED as WRITTEN

    changed = (
        (JITCodeLibrary, "finalize", _finalize),
        (_FunctionCompiler, "_customize_flags", _without_c_wrapper),
        (TargetConfig, "__eq__", _are_alike),
        (TargetConfig, "__hash__", _hash),
        *TYPED,
        *WORKED_OUT,
        *WRITTEN,
    )
    before = [getattr(owner, name) for owner, name, _ in changed]
    for owner, name, function in changed:
        setattr(owner, name, function)
    try:
        yield
    finally:
        for (owner, name, _), function in zip(changed, before, strict=True):
            setattr(owner, name, function)


def _without_c_wrapper(compiler: Any, flags: Any) -> Any:
    """Of numba's own functions, which only compiled code calls."""
    if compiler.py_func.__module__.startswith("numba."):
        flags.no_cfunc_wrapper = True
    return flags


def _are_alike(options: Any, others: Any) -> bool:
    """Whether numba's own functions are the same when kernels with these options call them.

    numba compiles them for each set of options, also of those that they do not inherit.
    """
    return all(getattr(options, name) == getattr(others, name) for name in _INHERITED)


def _hash(options: Any) -> int:
    return hash((options.nrt, options.forceinline))


_INHERITED = "nrt", "forceinline", "error_model", "fastmath"  # see CPUTargetOptions.finalize


def _finalize(library: JITCodeLibrary) -> None:
    """As `CodeLibrary.finalize`, but what others link is not optimised."""
    library._raise_if_finalized()
    from_outside = _is_called_from_outside(library._final_module)
    for one in dict.fromkeys(library._linking_libraries):
        library._reload_init.update(one._reload_init)
        library._final_module.link_in(one._get_module_for_linking(), preserve=True)
    library._shared_module = library._final_module
    if from_outside:
        library._shared_module = library._final_module.clone()
        library._optimize_final_module()
        for function in library._final_module.functions:
            if function.linkage.name.startswith("linkonce"):
                function.linkage = "internal"
    else:
        library._finalize_dynamic_globals()
        library._final_module = _environments(library._final_module)
    _leave_to_callers(library._shared_module)
    library._final_module.verify()
    library._finalize_final_module()


def _is_called_from_outside(module: Any) -> bool:
    """Whether there is anything else than functions of Python without wrappers."""
    names = [one.name for one in module.functions if not one.is_declaration]
    return not all(name.startswith("_Z") and not name.startswith(_WRAPPER) for name in names)


_WRAPPER, _ENVIRONMENT = "_ZN7cpython", "_ZN08NumbaEnv"


def _leave_to_callers(module: Any) -> None:
    """Let whatever links these functions drop those that it does not call."""
    for one in module.functions:
        if not one.is_declaration and one.linkage.name == "external":
            one.linkage = "linkonce_odr"


def _environments(module: Any) -> Any:
    """Module of nothing but what numba fills in after loading: where constants of Python are."""
    names = [one.name for one in module.global_variables if one.name.startswith(_ENVIRONMENT)]
    made = binding.parse_assembly("\n".join(f'@"{one}" = common global ptr null' for one in names))
    made.name, made.triple, made.data_layout = module.name, module.triple, module.data_layout
    return made
