"""Impact signals: load recordings, find and measure impacts, read the dynamics.

The public names, listed in ``__init__.pyi``, are loaded when first used, so that
``import impactsig`` costs nothing. The classes of what functions return are in `results`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

from . import _public

__version__ = "0.1.0"

__all__ = sorted(_public.FUNCTIONS)
_PACKAGES = {module.partition(".")[0] for module in _public.FUNCTIONS.values()}


def __getattr__(name: str) -> Any:
    if name in _PACKAGES and name not in _public.FUNCTIONS:
        return import_module(f"{__name__}.{name}")
    return _public.load(__name__, _public.FUNCTIONS, name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


class _Package(ModuleType):
    """The package, in which the name `simulate` is the function and not the subpackage."""

    def __setattr__(self, name: str, value: Any) -> None:
        # The import of a package binds it to its name here, whenever that happens.
        if isinstance(value, ModuleType) and _public.FUNCTIONS.get(name) == name:
            value = getattr(value, name)
        super().__setattr__(name, value)

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        # cloudpickle knows modules by their exact type; a function of the user's that names this
        # one takes it along to other processes.
        return import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Package
