"""What is simulated, as data: an oscillator, its forcing, its stops; flows; a preset per paper."""

from . import flows, scenes
from .cantilever import Cantilever
from .equivalents import stop_damping, stop_restitution, stop_stiffness
from .oscillator import Oscillator
from .parts import BaseMotion, Force, Friction, Noise
from .stops import Hertz, KelvinVoigt, Rigid, Stop

__all__ = [
    "BaseMotion",
    "Cantilever",
    "Force",
    "Friction",
    "Hertz",
    "KelvinVoigt",
    "Noise",
    "Oscillator",
    "Rigid",
    "Stop",
    "flows",
    "scenes",
    "stop_damping",
    "stop_restitution",
    "stop_stiffness",
]
