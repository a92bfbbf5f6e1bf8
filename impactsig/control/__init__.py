"""Control of chaos: feedback that makes a chaotic motion follow one of its unstable orbits."""

from .controlled import ControlledMotion
from .controlling import Controlled
from .feedback import DelayedFeedback
from .intervals import IntervalFeedback
from .ogy import OGY
from .running.flow import ControlledFlowMotion
from .stability.stability import ControlledStability, orbit_stability, stability_chart

__all__ = [
    "OGY",
    "Controlled",
    "ControlledFlowMotion",
    "ControlledMotion",
    "ControlledStability",
    "DelayedFeedback",
    "IntervalFeedback",
    "orbit_stability",
    "stability_chart",
]
