"""Motions of machines that hit a stop, and what instruments would have seen of them.

The package can itself be called: ``impactsig.simulate(...)`` is `simulate`, whichever way this
package was imported first.
"""

import sys

from .._called import Called
from .many import simulate_blocks, simulate_many
from .motion import Motion
from .runge_kutta import FixedStep, RungeKutta
from .simulation import simulate

__all__ = ["FixedStep", "Motion", "RungeKutta", "simulate", "simulate_blocks", "simulate_many"]

sys.modules[__name__].__class__ = Called
