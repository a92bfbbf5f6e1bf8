"""Impact signals: load recordings, find and measure impacts, read the dynamics.

The public names are loaded when first used, so that ``import impactsig`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from . import plot
    from .comparison import Comparison, compare
    from .detect import detect_impacts
    from .errors import (
        ImpactsigError,
        ImpactsigWarning,
        InvalidInput,
        MissingExtra,
        UnreadableFile,
        UnwritableFile,
    )
    from .impacts import Impacts
    from .intervals import (
        IntervalHistogram,
        Periodicity,
        coefficient_of_variation,
        cv2,
        identify_period,
        interval_histogram,
        local_variation,
        return_map,
    )
    from .io import info, read, read_blocks
    from .oscillators import (
        BaseMotion,
        Force,
        Friction,
        Hertz,
        KelvinVoigt,
        Oscillator,
        Rigid,
        Stop,
        scenes,
    )
    from .reconstruct import (
        CorrelationDimension,
        CorrelationSum,
        correlation_dimension,
        correlation_sum,
    )
    from .recording import Recording
    from .report import write_report
    from .simulate import Motion, simulate, simulate_blocks, simulate_many
    from .simulate.measuring import Measured, measure
    from .simulate.sensors import LoadCell, Microphone
    from .simulate.synthesis import synthesize

_HOME = {
    "errors": (
        "ImpactsigError",
        "ImpactsigWarning",
        "InvalidInput",
        "MissingExtra",
        "UnreadableFile",
        "UnwritableFile",
    ),
    "recording": ("Recording",),
    "impacts": ("Impacts",),
    "io": ("info", "read", "read_blocks"),
    "detect": ("detect_impacts",),
    "intervals": (
        "IntervalHistogram",
        "Periodicity",
        "coefficient_of_variation",
        "cv2",
        "identify_period",
        "interval_histogram",
        "local_variation",
        "return_map",
    ),
    "oscillators": (
        "BaseMotion",
        "Force",
        "Friction",
        "Hertz",
        "KelvinVoigt",
        "Oscillator",
        "Rigid",
        "Stop",
        "scenes",
    ),
    "reconstruct": (
        "CorrelationDimension",
        "CorrelationSum",
        "correlation_dimension",
        "correlation_sum",
    ),
    "report": ("write_report",),
    "simulate": ("Motion", "simulate_blocks", "simulate_many"),
    "simulate.measuring": ("Measured", "measure"),
    "simulate.sensors": ("LoadCell", "Microphone"),
    "simulate.synthesis": ("synthesize",),
    "comparison": ("Comparison", "compare"),
    "plot": (),
}
_WHERE = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "BaseMotion",
    "Comparison",
    "CorrelationDimension",
    "CorrelationSum",
    "Force",
    "Friction",
    "Hertz",
    "Impacts",
    "ImpactsigError",
    "ImpactsigWarning",
    "IntervalHistogram",
    "InvalidInput",
    "KelvinVoigt",
    "LoadCell",
    "Measured",
    "Microphone",
    "MissingExtra",
    "Motion",
    "Oscillator",
    "Periodicity",
    "Recording",
    "Rigid",
    "Stop",
    "UnreadableFile",
    "UnwritableFile",
    "coefficient_of_variation",
    "compare",
    "correlation_dimension",
    "correlation_sum",
    "cv2",
    "detect_impacts",
    "identify_period",
    "info",
    "interval_histogram",
    "local_variation",
    "measure",
    "plot",
    "read",
    "read_blocks",
    "return_map",
    "scenes",
    "simulate",
    "simulate_blocks",
    "simulate_many",
    "synthesize",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return import_module(f"{__name__}.{name}")
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_WHERE[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
