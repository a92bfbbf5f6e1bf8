"""Simulation of impacting systems, and of the instruments that record them.

``impactsig.simulate`` is the function `simulate`, whichever way this package was imported first.
"""

from .batches.many import simulate_blocks, simulate_many
from .motion import Motion
from .simulation import simulate
from .stepping.runge_kutta import FixedStep, RungeKutta

__all__ = ["FixedStep", "Motion", "RungeKutta", "simulate", "simulate_blocks", "simulate_many"]
