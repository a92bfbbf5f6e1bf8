"""Motions of machines that hit a stop, and what instruments would have seen of them.

The package can itself be called: ``impactsig.simulate(...)`` is `simulate`, whichever way this
package was imported first.
"""

import sys
from types import ModuleType
from typing import Any

from .many import simulate_blocks, simulate_many
from .motion import Motion
from .runge_kutta import FixedStep, RungeKutta
from .simulation import simulate

__all__ = ["FixedStep", "Motion", "RungeKutta", "simulate", "simulate_blocks", "simulate_many"]


class _Callable(ModuleType):
    def __call__(self, *args: Any, **options: Any) -> Motion:
        return simulate(*args, **options)


sys.modules[__name__].__class__ = _Callable
