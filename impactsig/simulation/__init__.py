"""Simulation of impacting systems, and of the instruments that record them."""

from .batches.many import simulate_blocks, simulate_many
from .motion import Motion
from .simulation import simulate
from .stepping.runge_kutta import FixedStep, RungeKutta

__all__ = ["FixedStep", "Motion", "RungeKutta", "simulate", "simulate_blocks", "simulate_many"]
