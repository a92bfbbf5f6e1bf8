"""Control of chaos: feedback that makes a chaotic motion follow one of its unstable orbits.

The package can itself be called: ``impactsig.control(...)`` is `control`, whichever way this
package was imported first.
"""

import sys
from types import ModuleType
from typing import Any

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


class _Callable(ModuleType):
    def __call__(self, *args: Any, **options: Any) -> Any:
        return control(*args, **options)


sys.modules[__name__].__class__ = _Callable
