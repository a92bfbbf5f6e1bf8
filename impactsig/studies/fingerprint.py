"""Digest of the code that a function depends on, by name.

Of a user's functions it is the bytecode and the constants, followed through the globals and
closures they use, so that comments and line numbers do not count and a helper's change does. Of an
installed package it is the version. Of this one it is the code, without comments and docstrings, of
the modules that the functions refer to and of all that these import.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import importlib.util
import sys
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .. import _public
from .._compiling import sources

HOME, MAIN = __name__.partition(".")[0], "__main__"
DIGITS = 32
"""Of a digest."""
DOCUMENTED = 0x4000000
"""The flag of code that has a docstring, from Python 3.13 on."""


def code_of(function: Callable[..., Any]) -> dict[str, str]:
    """Digests and versions of the code that a function refers to, by name."""
    reader = _Reader()
    python = sys.version_info
    reader.parts |= {"python": f"{python.major}.{python.minor}", "numpy": np.__version__}
    reader.parts["function"] = digest(reader.text(function))
    return reader.all_parts()


def digest_of(value: Any) -> str:
    """Digest of a value and the code in it, the same in every process."""
    reader = _Reader()
    text = reader.text(value)
    return digest(f"{text} {list(reader.all_parts().items())}")


def digest(text: str | bytes) -> str:
    """A short digest of text."""
    return hashlib.blake2b(text.encode() if isinstance(text, str) else text).hexdigest()[:DIGITS]


def stamp(path: Path) -> list[int]:
    """Size and time of a file, which tell whether it may have changed."""
    state = path.stat()
    return [state.st_size, state.st_mtime_ns]


class _Reader:
    """Serialise values as text that is the same in every process, and collect their code."""

    def __init__(self) -> None:
        self.parts: dict[str, str] = {}
        self.within: list[int] = []  # what is being written
        self.known: dict[int, tuple[Any, str]] = {}
        self.modules: set[str] = set()  # of this package
        self.names: set[str] = set()  # that the code uses

    def all_parts(self) -> dict[str, str]:
        """What has been collected, and this package if it is among that."""
        parts = dict(self.parts)
        if self.modules:
            parts[HOME] = own_code(frozenset(self.modules), frozenset(self.names))
        return dict(sorted(parts.items()))

    def text(self, value: Any) -> str:
        if value is None or isinstance(
            value, (bool, int, float, complex, str, bytes, range, type(...))
        ):
            return f"{type(value).__name__} {value!r}"
        if isinstance(value, (frozenset, set)):
            return f"set {sorted(map(self.text, value))}"
        if id(value) in self.within:  # it refers to itself
            return f"again {self.within.index(id(value))}"
        if id(value) not in self.known:
            self.within.append(id(value))
            self.known[id(value)] = value, self._compound(value)
            self.within.pop()
        return self.known[id(value)][1]

    def _compound(self, value: Any) -> str:
        if isinstance(value, (tuple, list)):
            return f"{type(value).__name__} {[self.text(one) for one in value]}"
        if isinstance(value, dict):
            return f"dict {sorted((self.text(k), self.text(v)) for k, v in value.items())}"
        if isinstance(value, np.ndarray) and value.dtype.kind != "O":
            return f"array {value.dtype.str} {value.shape} {digest(value.tobytes())}"
        if isinstance(value, types.ModuleType):
            return f"module {self.module(value.__name__)}"
        if isinstance(value, types.CodeType):
            return self._code(value)
        if isinstance(value, functools.partial):
            return f"partial {self.text((value.func, value.args, value.keywords))}"
        if isinstance(value, types.MethodType):
            return f"method {self.text((value.__func__, value.__self__))}"
        if isinstance(value, (classmethod, staticmethod)):
            return f"{type(value).__name__} {self.text(value.__func__)}"
        if isinstance(value, property):
            return f"property {self.text((value.fget, value.fset))}"
        value = getattr(value, "py_func", value)  # compiled by numba
        if isinstance(value, (types.FunctionType, type)):
            return self._definition(value)
        module = getattr(value, "__module__", None)
        if isinstance(getattr(value, "__name__", None), str) and isinstance(module, str):
            return f"{self.module(module)} {value.__name__}"  # built in, or a ufunc
        return self._object(value)

    def _object(self, value: Any) -> str:
        kind = self.text(type(value))
        try:
            reduced = value.__reduce_ex__(4)
        except Exception:  # it cannot be taken apart; its class must do
            return f"object {kind}"
        if isinstance(reduced, str):
            return f"object {kind} {reduced}"
        # Items of lists and dicts come as iterators; the state comes third.
        parts = [list(part) if isinstance(part, Iterator) else part for part in reduced[:5]]
        return f"object {kind} {self.text(parts)}"

    def _definition(self, value: Any) -> str:
        """A function or class: this package's and installed ones by version, others by content."""
        where = f"{value.__module__}.{value.__qualname__}"
        owner = self.module(value.__module__ or MAIN, follow=False)
        if owner is not None:
            return f"{owner} {value.__qualname__}"
        if isinstance(value, type):
            own = {n: one for n, one in vars(value).items() if not n.startswith("__") or _runs(one)}
            content = self.text([*value.__bases__, own])
        else:
            cells = [_contents(cell) for cell in value.__closure__ or ()]
            code = self._code(value.__code__)
            content = code + self.text([value.__defaults__, value.__kwdefaults__, cells])
            self._globals(value)
        name, count = where, 1
        while self.parts.setdefault(name, digest(content)) != digest(content):
            count += 1
            name = f"{where} ({count})"  # two lambdas, say
        return f"defined {name}"

    def _globals(self, function: types.FunctionType) -> None:
        for name in sorted(_names(function.__code__, "LOAD_GLOBAL")):
            if name not in function.__globals__:
                continue  # built in
            value = function.__globals__[name]
            text = self.text(value)
            if not text.startswith(("defined ", "module ", "package ", "again ")):
                self.parts[f"{function.__module__}.{name}"] = digest(text)
        for name in sorted(_names(function.__code__, "IMPORT_NAME")):
            if name:
                self.module(name)

    def _code(self, code: types.CodeType) -> str:
        """The instructions with their names and constants; no instruction loads a docstring."""
        self.names.update(code.co_names)
        self.names.update(one for one in code.co_consts if isinstance(one, str))
        steps = [one for one in dis.get_instructions(code) if one.opname != "EXTENDED_ARG"]
        written = [
            f"{one.opname} {self._operand(one)}"
            for one, following in zip(steps, [*steps[1:], None], strict=True)
            if not _describes_class(one) and not (following and _describes_class(following))
        ]
        flags = code.co_flags & ~DOCUMENTED
        shape = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, flags)
        names = (code.co_varnames, code.co_freevars, code.co_cellvars)
        return f"code {written} {code.co_exceptiontable.hex()} {shape} {names}"

    def _operand(self, step: dis.Instruction) -> Any:
        if step.opcode in dis.hasconst:
            return self.text(step.argval)
        return step.argval if step.opcode in dis.hasname else step.arg

    def module(self, name: str, follow: bool = True) -> str | None:
        """A module by what it belongs to; None for a user's own, unless that is to be followed."""
        top = name.partition(".")[0]
        if name == MAIN:
            return None
        if top == HOME:
            self.modules.add(name)
        elif top in sys.stdlib_module_names:
            pass  # the version of Python says it
        else:
            path = _file_of(name)
            if path is not None and {"site-packages", "dist-packages"} & set(path.parts):
                self.parts[top] = _version(top)
            elif not follow:
                return None
            elif path is not None and name not in self.parts:
                self.parts[name] = digest(path.read_bytes())
        return f"package {name}"


def _describes_class(step: dis.Instruction) -> bool:
    """Whether this sets, in the body of a class, what the step before loads: docstring or line."""
    return step.opname == "STORE_NAME" and step.argval in ("__doc__", "__firstlineno__")


def _runs(value: Any) -> bool:
    return isinstance(value, (types.FunctionType, classmethod, staticmethod, property))


def _contents(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not assigned yet
        return None


def _names(code: types.CodeType, operation: str) -> set[str]:
    """Global and attribute names that the code, and functions nested in it, look up."""
    found = {one.argval for one in dis.get_instructions(code) if one.opname == operation}
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            found |= _names(constant, operation)
    return found


def _file_of(name: str) -> Path | None:
    module = sys.modules.get(name)
    path = getattr(module, "__file__", None)
    if module is None:
        try:
            spec = importlib.util.find_spec(name)
        except (ImportError, ValueError):
            return None
        path = spec.origin if spec else None
    return Path(path) if path and Path(path).is_file() else None


def _version(package: str) -> str:
    version = getattr(sys.modules.get(package), "__version__", None)
    if isinstance(version, str):
        return version
    from importlib import metadata  # costly, and seldom needed

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "unknown"


@functools.cache
def own_code(modules: frozenset[str], names: frozenset[str]) -> str:
    """Digest of the code that these modules of this package reach.

    Of a package only those modules count that the functions name, since a package may be referred
    to as ``impactsig`` is in ``impactsig.simulate(...)``.
    """
    listed = _public.FUNCTIONS | _public.RESULTS
    where = {name: module or name for name, module in listed.items()}
    files: set[Path] = set()
    left = [sources.ROOT.parent.joinpath(*name.split(".")) for name in modules]
    while left:
        place = left.pop()
        file = sources.module(place)
        if file is None or file in files:
            continue
        public = {where.get(name, name) for name in names} if place == sources.ROOT else names
        inside = [place.joinpath(*name.split(".")) for name in public if _is_path(name)]
        if file.name == "__init__.py":
            left += [one for one in inside if sources.module(one) is not None]
        if place != sources.ROOT:
            files.add(file)
    if not files:  # the functions name nothing of the package: they may use all of it
        places = [sources.ROOT.joinpath(*name.split(".")) for name in where.values()]
        files = {file for file in map(sources.module, places) if file is not None}
    return digest(sources.digest(sources.reached(files)))


def _is_path(name: str) -> bool:
    return all(part.isidentifier() for part in name.split("."))
