"""Compiled functions, kept on disk for as long as no source that they are made of has changed.

numba's cache looks at the file of a function alone. What it has kept of a kernel that calls one of
another file would go on with the old code after that other file was changed, and say nothing; and
where a type of an argument has moved, reading the cache fails. So the version under which a kernel
is kept tells, besides numba's, all files of this package that its own draws on by relative imports.
A kernel whose argument is a NamedTuple of another file must import that too, if only to say so.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import sigutils
from numba.core.ccallback import CFunc

_IMPORT = re.compile(r"^from (\.+)([\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with its cache, for the kernels of this package."""
    compiled = numba.njit(cache=True, **options)

    def keep(function: Callable[..., Any]) -> Any:
        dispatcher = compiled(function)
        if dispatcher is not function:  # as it is with NUMBA_DISABLE_JIT
            _depend(dispatcher, function)
        return dispatcher

    return keep


def cfunc(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.cfunc` with its cache, for the C functions of this package."""

    def keep(function: Callable[..., Any]) -> Any:
        compiled = CFunc(function, sigutils.normalize_signature(signature), {}, {})
        compiled.enable_caching()
        _depend(compiled, function)
        compiled.compile()
        return compiled

    return keep


def _depend(compiled: Any, function: Callable[..., Any]) -> None:
    """Let what is kept of a function depend on all that it is made of; numba has no public way."""
    path = Path(function.__code__.co_filename)
    compiled._cache._cache_file._version += f" {state(path)}"


@functools.cache
def state(path: Path) -> str:
    """Digest of a source file and of all that it imports by relative names, at any depth."""
    digest = hashlib.sha256()
    for each in sorted(_drawn_on(path)):
        digest.update(_source(each))
    return digest.hexdigest()


def _drawn_on(path: Path) -> set[Path]:
    found, left = set(), [path]
    while left:
        here = left.pop()
        if here not in found:
            found.add(here)
            left += _imported(here)
    return found


@functools.cache
def _source(path: Path) -> bytes:
    return path.read_bytes()


@functools.cache
def _imported(path: Path) -> list[Path]:
    found = []
    for dots, module, names in _IMPORT.findall(_source(path).decode()):
        place = path.parents[len(dots) - 1].joinpath(*filter(None, module.split(".")))
        # Of a package the modules may be what is imported.
        inside = [place / f"{name}.py" for name in re.findall(r"\w+", names)]
        candidates = [place.with_suffix(".py"), place / "__init__.py", *inside]
        found += [file for file in candidates if file.is_file()]
    return found
