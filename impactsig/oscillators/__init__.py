"""What is simulated, as data: an oscillator, its forcing, its stops; and a preset per paper."""

from . import scenes
from .oscillator import BaseMotion, Force, KelvinVoigt, Oscillator, Rigid, Stop

__all__ = ["BaseMotion", "Force", "KelvinVoigt", "Oscillator", "Rigid", "Stop", "scenes"]
