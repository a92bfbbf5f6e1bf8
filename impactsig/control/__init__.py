"""Control of chaos: feedback that makes a chaotic motion follow one of its unstable orbits."""

from .controlled import ControlledMotion
from .controlling import Controlled
from .feedback import DelayedFeedback
from .flow import ControlledFlowMotion
from .ogy import OGY
from .stability import ControlledStability, orbit_stability, stability_chart

__all__ = [
    "OGY",
    "Controlled",
    "ControlledFlowMotion",
    "ControlledMotion",
    "ControlledStability",
    "DelayedFeedback",
    "orbit_stability",
    "stability_chart",
]
