"""Control of chaos: feedback that makes a chaotic motion follow one of its unstable orbits.

``impactsig.control`` is the function `control`, whichever way this package was imported first.
"""

from .controlled import ControlledMotion
from .controlling import control
from .feedback import DelayedFeedback
from .flow import ControlledTrajectory
from .ogy import OGY
from .stability import ControlledStability, orbit_stability, stability_chart

__all__ = [
    "OGY",
    "ControlledMotion",
    "ControlledStability",
    "ControlledTrajectory",
    "DelayedFeedback",
    "control",
    "orbit_stability",
    "stability_chart",
]
