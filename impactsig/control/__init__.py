"""Control of chaos: feedback that makes a chaotic motion follow one of its unstable orbits.

The package can itself be called: ``impactsig.control(...)`` is `control`, whichever way this
package was imported first.
"""

import sys

from .._called import Called
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

sys.modules[__name__].__class__ = Called
