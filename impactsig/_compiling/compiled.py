"""Compile decorators, and a cache on disk that is renewed when the code of a kernel changes.

numba's cache looks at the file of a function alone. What it has kept of a kernel that calls one of
another file would go on with the old code after that other file was changed, and say nothing; and
where a type of an argument has moved, reading the cache fails. So the digest under which a kernel
is kept covers all files of this package that its own file imports by relative names, as code:
comments and docstrings cost no compilation. A kernel whose argument is a NamedTuple of another file
must import that too, if only to say so.

A wheel may carry compiled kernels (`.ci/kernels.py`). They are used where this machine runs them
and where the code and the versions are those that they were compiled from.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import linecache
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from llvmlite import binding
from numba.core import config, sigutils
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.ccallback import CFunc
from numba.core.compiler_lock import global_compiler_lock
from numba.core.types import unliteral  # type: ignore[attr-defined]

from .._files.private import private_directory
from .._files.turns import Turn
from .._running.watched import watched
from ..errors import ImpactsigWarning
from . import sources
from ._linking import linked_once
from .garbage import without_collections


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with its cache, for the kernels of this package."""
    compiled = numba.njit(no_cfunc_wrapper=True, **options)

    def keep(function: Callable[..., Any]) -> Any:
        dispatcher = compiled(function)
        if dispatcher is not function:  # as it is with NUMBA_DISABLE_JIT
            _keep(dispatcher, function)
            _without_values(dispatcher)
            _with_entry_where_python_calls(dispatcher)
        return dispatcher

    return keep


# Without reference counts, which cost more than these functions compute: nothing there allocates.
_OPTIONS: Any = {"nogil": True, "error_model": "numpy", "_nrt": False}


def cfunc(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.cfunc` with its cache, for the C functions of this package."""

    def keep(function: Callable[..., Any]) -> Any:
        compiled = CFunc(function, sigutils.normalize_signature(signature), {}, {})
        _keep(compiled, function)
        compiled.compile()
        return compiled

    return keep


@functools.cache
def state(path: Path) -> str:
    """Digest of the code of a source file, of this one, and of all that they import.

    This one says how a kernel is compiled and in what form it is kept.
    """
    return sources.digest(sources.reached([path, Path(__file__)]))


def _keep(compiled: Any, function: Callable[..., Any]) -> None:
    """Give a compiled function its cache; numba has no public way to choose one.

    It gets it at its first call: a command calls few of the functions that it imports.
    """
    compile_now = compiled.compile
    caches: list[_Cache | None] = []

    def compile_in_turn(*arguments: Any) -> Any:
        _read_array_functions()
        with global_compiler_lock, without_collections(), linked_once(), _counted():
            if not caches:
                caches.append(_cache_of(function))
                if caches[0] is not None:
                    compiled._cache = caches[0]
            if caches[0] is None:
                return compile_now(*arguments)
            with caches[0].turn.ended():
                return compile_now(*arguments)

    compiled.compile = compile_in_turn


def _cache_of(function: Callable[..., Any]) -> _Cache | None:
    try:
        return _Cache(function)
    except (OSError, RuntimeError):  # no directory can be written
        _warn("compiles its functions anew in every process")
        return None


@functools.cache
@global_compiler_lock
def _read_array_functions() -> None:
    """Import numba's functions of arrays without scipy.linalg, a fifth of a short command's time.

    They import it only to see whether it is there, as it is, and again where a product of matrices
    is compiled.
    """
    from numba.np import linalg

    if "numba.np.arraymath" in sys.modules or not hasattr(linalg, "ensure_blas"):
        return
    asks = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath

        arraymath.ensure_blas = asks
    finally:
        linalg.ensure_blas = asks


@contextlib.contextmanager
def _counted() -> Iterator[None]:
    """Count the kernels that are being compiled, each for the one before."""
    _compiling[0] += 1
    try:
        yield
    finally:
        _compiling[0] -= 1


_compiling = [0]


def _with_entry_where_python_calls(dispatcher: Any) -> None:
    """Make no entry from Python to what is compiled for another kernel.

    What Python calls later as well is compiled once more, with an entry.
    """
    compile_now, options = dispatcher.compile, dispatcher._compiler.targetoptions

    def compile_as_called(signature: Any) -> Any:
        with global_compiler_lock:
            if _compiling[0]:
                options["no_cpython_wrapper"] = True
            else:
                options.pop("no_cpython_wrapper", None)
                arguments, _ = sigutils.normalize_signature(signature)
                if not _has_entry(dispatcher.overloads.get(arguments)):
                    dispatcher.overloads.pop(arguments, None)
            return compile_now(signature)

    def add_overload(result: Any) -> None:
        if _has_entry(result):
            type(dispatcher).add_overload(dispatcher, result)
        else:  # for kernels to find, and not for Python
            dispatcher.overloads[tuple(result.signature.args)] = result

    dispatcher.compile, dispatcher.add_overload = compile_as_called, add_overload


def _has_entry(result: Any) -> bool:
    """Whether Python can call what was compiled."""
    if result is None:
        return False
    name = result.fndesc.llvm_cpython_wrapper_name
    return bool(result.library.get_pointer_to_function(name))


def _without_values(dispatcher: Any) -> None:
    """Compile for the types of arguments, and not again for each constant that is passed."""
    template = dispatcher.get_call_template

    def of_types(arguments: Any, named: dict[str, Any]) -> Any:
        plain = {name: unliteral(kind) for name, kind in named.items()}
        return template(tuple(map(unliteral, arguments)), plain)

    dispatcher.get_call_template = of_types


def _announce() -> None:
    """Report, once in a process, that kernels are being compiled."""
    if not _announced:
        _announced.append(True)
        if watched():
            print(
                "impactsig: compiling for this machine, once (`impactsig warmup` compiles all)",
                file=sys.stderr,
            )


_announced: list[bool] = []


def _warn(instead: str) -> None:
    """Warn, once in a process, that compiled functions are not kept where they should be."""
    if not _warned:
        _warned.append(instead)
        warnings.warn(
            "neither the folder of impactsig nor the user's cache directory can be written, so "
            f"impactsig {instead}. Set NUMBA_CACHE_DIR to a directory that you can write to, and "
            "nobody else",
            ImpactsigWarning,
            stacklevel=2,
        )


_warned: list[str] = []


class _Temporary:
    """Cache in a private temporary directory, if no other folder can be written.

    What is kept is a pickle, which can run any code when it is read. So the folder must be
    private, and is checked each time: a process may outlive the files in a temporary directory.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _Temporary | None:
        """Where to keep a function of this file; None if there is no private directory."""
        home = private_directory()
        if home is None:
            return None
        _warn(f"keeps its compiled functions in {home}, which the system may empty")
        place = str(Path(file).parent.absolute())
        return cls(home / hashlib.sha256(place.encode()).hexdigest()[:32])

    def ensure_cache_path(self) -> None:
        """Make the folder, if need be; raise OSError if others could write there."""
        if private_directory() != self.folder.parent:
            raise PermissionError(f"others can write to {self.folder.parent}")
        self.folder.mkdir(exist_ok=True)

    def get_cache_path(self) -> str:
        """The folder."""
        return str(self.folder)

    def get_source_stamp(self) -> None:
        """Nothing: `_Cache` has a stamp for all places."""


class _Kept(CompileResultCacheImpl):
    """File name and folder of a cached function."""

    _locator_classes = (*CompileResultCacheImpl._locator_classes, _Temporary)

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        super().__init__(function)

    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        """A name without numba's line of the function, which a comment moves.

        Functions of one name in a file are distinguished by their order.
        """
        code = self.function.__code__
        lines = linecache.getlines(code.co_filename, self.function.__globals__)
        earlier = sum(f"def {code.co_name}(" in one for one in lines[: code.co_firstlineno - 1])
        python = f"py{sys.version_info[0]}{sys.version_info[1]}{abiflags}"
        return f"{fullname.replace('<', '').replace('>', '')}-{earlier}.{python}"

    def reduce(self, cres: Any) -> Any:
        """Without the listing of types, a quarter of the whole, which only people read.

        With the names that the code defines, which numba would read from its LLVM code.
        """
        module = cres.library._final_module
        parts = *module.functions, *module.global_variables
        names = {part.name for part in parts if not part.is_declaration}
        return names, *super().reduce(cres._replace(type_annotation=""))

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Without the LLVM code, which is parsed once another function is compiled with it.

        To parse it took a seventh of a short command's time.
        """
        names, (name, kind, (machine_code, bitcode)), *rest = payload
        target_context.codegen()._engine._defined_symbols |= names
        library = name, kind, (machine_code, _no_code())
        result = super().rebuild(target_context, (library, *rest))
        result.library._shared_module = None
        result.library._get_module_for_linking = functools.partial(_code, result.library, bitcode)
        return result


@functools.cache
def _no_code() -> bytes:
    """LLVM code of a module of nothing."""
    return binding.parse_assembly("").as_bitcode()


def _code(library: Any, bitcode: bytes) -> Any:
    """The LLVM code of a library that was read."""
    if library._shared_module is None:
        library._shared_module = binding.parse_bitcode(bitcode)
    return library._shared_module


_SHIPPED = "_kernels"
"""A folder beside a source file. What is there is run when it is read, as the source file is."""


def shipped_target() -> tuple[str, str, str]:
    """What shipped kernels are compiled for, as numba names it: triple, processor and features.

    x86-64-v3 is any processor with AVX2, which most have had since 2015.
    """
    features = (
        "avx avx2 bmi bmi2 cmov crc32 cx16 cx8 f16c fma fxsr lzcnt mmx movbe popcnt sahf sse sse2 "
        "sse3 sse4.1 sse4.2 ssse3 xsave"
    )
    named = ",".join(f"+{feature}" for feature in features.split())
    return "x86_64-unknown-linux-gnu", "x86-64-v3", named


def _runs_shipped(target: tuple[str, str, str]) -> bool:
    """Whether this processor can run the shipped kernels with the same results."""
    triple, _, features = shipped_target()
    overridden = (
        config.BOUNDSCHECK or config.DEBUGINFO_DEFAULT or config.USING_SVML or config.OPT < 3
    )
    has_all = set(features.split(",")) <= set(target[2].split(","))
    return target[0] == triple and has_all and not overridden


class _Cache(FunctionCache):
    """numba's cache, keyed by a digest of the source code that a function depends on."""

    _impl_class = _Kept

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        code = state(Path(function.__code__.co_filename))
        # The version is compared before anything else is read.
        version = f"{numba.__version__} {llvmlite.__version__} {np.__version__} {code}"
        self._cache_file._version = version
        self._cache_file._source_stamp = code
        folder = Path(function.__code__.co_filename).parent / _SHIPPED
        self._shipped = IndexDataCacheFile(str(folder), self._impl.filename_base, code)
        self._shipped._version = version
        self._with_entry = True
        self.turn = Turn(Path(self._cache_path) / f"{self._impl.filename_base}.lock")

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Without the bytecode, which a docstring changes: the stamp covers the code."""
        signature, target, (_, closure) = super()._index_key(sig, codegen)
        return (signature, self._with_entry), target, closure

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was kept for a signature, perhaps by a process that has just compiled it."""
        kept = self._read(sig, target_context)
        if kept is None:
            with contextlib.suppress(OSError):
                self._impl.locator.ensure_cache_path()  # where the turn is taken
            self.turn.take()
            kept = self._read(sig, target_context)
        if kept is None:
            _announce()
        return kept

    def _read(self, sig: Any, target_context: Any) -> Any:
        """What has an entry from Python serves kernels as well."""
        kept = self._read_one(sig, target_context, with_entry=True)
        if kept is None and _compiling[0] > 1:
            kept = self._read_one(sig, target_context, with_entry=False)
        return kept

    def _read_one(self, sig: Any, target_context: Any, *, with_entry: bool) -> Any:
        self._with_entry = with_entry
        try:
            if isinstance(self._impl.locator, _Temporary):
                self._impl.locator.ensure_cache_path()
            kept = super().load_overload(sig, target_context)
        except OSError:
            kept = None
        return self._read_shipped(sig, target_context) if kept is None else kept

    def _read_shipped(self, sig: Any, target_context: Any) -> Any:
        codegen = target_context.codegen()
        if not _runs_shipped(codegen.magic_tuple()):
            return None
        signature, _, closure = self._index_key(sig, codegen)
        with contextlib.suppress(OSError):  # no folder: an archive, or a file in its place
            data = self._shipped.load((signature, shipped_target(), closure))
            return None if data is None else self._impl.rebuild(target_context, data)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep it, unless the disk is full or no longer writable."""
        self._with_entry = _compiling[0] == 1
        try:
            super().save_overload(sig, data)
        except OSError:
            _warn("compiles its functions anew in every process")


kernel = njit(**_OPTIONS)
"""A kernel, called by Python or by other kernels."""
allocating = njit(nogil=True, error_model="numpy")
"""A kernel that makes arrays, or calls one that does; the counts of references are kept."""
inlined = njit(**_OPTIONS, forceinline=True)
"""The same, written into whatever calls it."""
