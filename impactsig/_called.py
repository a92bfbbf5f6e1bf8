"""A package that is also the function of its name: `impactsig.simulate`, `impactsig.control`."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any


class Called(ModuleType):
    """A package whose function of the same name is called in its place."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return getattr(self, self.__name__.rpartition(".")[2])(*args, **options)

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        # cloudpickle knows modules by their exact type; a user's function that simulates takes
        # this one along to other processes.
        return importlib.import_module, (self.__name__,)
