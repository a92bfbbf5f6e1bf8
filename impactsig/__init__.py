"""Impact signals: load recordings, find and measure impacts, read the dynamics.

The public names are loaded when first used, so that ``import impactsig`` costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from . import plot
    from .alignment import Alignment, align_impacts
    from .calibration import Calibration, fit_calibration
    from .combining import Combination, combine_impacts
    from .comparison import Comparison, compare
    from .control import (
        OGY,
        Controlled,
        ControlledFlowMotion,
        ControlledMotion,
        ControlledStability,
        DelayedFeedback,
        IntervalFeedback,
        orbit_stability,
        stability_chart,
    )
    from .detect import detect_impacts
    from .detect.stops import StopSeparation, separate_stops
    from .dynamics.basins import Attractor, Basins, basins_of_attraction
    from .dynamics.branches import Branch
    from .dynamics.charts import PeriodicityChart, periodicity_chart
    from .dynamics.continuation import continue_orbit
    from .dynamics.diagrams import BifurcationDiagram, bifurcation_diagram
    from .dynamics.equivalence import (
        ContactSamples,
        EquivalenceError,
        SoftStopFit,
        equivalence_error,
        fit_soft_stop,
    )
    from .dynamics.flow_orbits import FlowOrbit
    from .dynamics.lyapunov import LyapunovSpectrum, lyapunov_spectrum
    from .dynamics.matching import MatchRate, match_rate, strobe_distance
    from .dynamics.orbits import PeriodicOrbit, find_periodic_orbit, find_periodic_orbits
    from .dynamics.periodicity import OrbitPeriod, orbit_period
    from .dynamics.response import ResponseSpectrum, response_spectrum
    from .dynamics.sections import Section, displacement_section, impact_map
    from .dynamics.spectra import LyapunovSpectra
    from .dynamics.tangent import TangentMap, tangent_map
    from .errors import (
        ImpactsigError,
        ImpactsigWarning,
        InvalidInput,
        MissingExtra,
        UnreadableFile,
        UnwritableFile,
    )
    from .experiment.experiment import Experiment
    from .experiment.rig import Rig
    from .fitting import OscillatorFit, fit_oscillator
    from .identify import FrictionDecay, Resonance, identify_friction, identify_resonance
    from .impacts import Impacts
    from .intervals import (
        IntervalHistogram,
        Join,
        Periodicity,
        PeriodTrack,
        Repair,
        SpeedDrift,
        Split,
        coefficient_of_variation,
        cv2,
        identify_period,
        interval_histogram,
        local_variation,
        repair_intervals,
        return_map,
        track_period,
    )
    from .intervals.bounces import restitution_from_bounces
    from .io import Limits, RawLayout, info, read, read_blocks, read_many
    from .matching import Matching, match_impacts
    from .oscillators import (
        BaseMotion,
        Cantilever,
        Force,
        Friction,
        Hertz,
        KelvinVoigt,
        Noise,
        Oscillator,
        Rigid,
        Stop,
        flows,
        scenes,
        stop_damping,
        stop_restitution,
        stop_stiffness,
    )
    from .oscillators.batch import OscillatorBatch
    from .oscillators.flows import Flow
    from .reading_motion import recorded_motion
    from .reconstruct import (
        AveragedFalseNeighbors,
        CorrelationSum,
        DelayChoice,
        FalseNeighbors,
        LyapunovExponent,
        autocorrelation_delay,
        averaged_false_neighbors,
        correlation_sum,
        delay_embed,
        false_nearest_neighbors,
        lyapunov_exponent,
        mutual_information_delay,
    )
    from .reconstruct.determinism import ReturnMapDeterminism, return_map_determinism
    from .reconstruct.dimension import CorrelationDimension, correlation_dimension
    from .reconstruct.information import mutual_information
    from .reconstruct.ordinal import OrdinalPatterns, ordinal_patterns
    from .reconstruct.prediction import (
        PredictionError,
        prediction_error,
        time_reversal_asymmetry,
    )
    from .reconstruct.recurrence import (
        RecurrencePlot,
        RecurrenceQuantification,
        recurrence_plot,
        recurrence_quantification,
    )
    from .reconstruct.surrogate_testing import SurrogateTest, surrogate_test
    from .reconstruct.surrogates import Surrogates, surrogates
    from .recorded import RecordedMotion
    from .recording import Recording
    from .report import Detected, detect_many, write_report, write_reports
    from .simulate import (
        FixedStep,
        Motion,
        RungeKutta,
        simulate,
        simulate_blocks,
        simulate_many,
    )
    from .simulate.beam_motion import BeamMotion
    from .simulate.firing import integrate_and_fire, threshold_crossings
    from .simulate.flow_motion import FlowMotion
    from .simulate.measuring import Measured, measure
    from .simulate.motions import Motions
    from .simulate.restitution import ApparentRestitution, apparent_restitution
    from .simulate.sensors import LoadCell, Microphone
    from .simulate.synthesis import synthesize
    from .simulate.train_series import fired_trains, noisy_trains
    from .stochastic.averaging import AveragedDensity, averaged_density
    from .stochastic.bifurcation import PBifurcation, p_bifurcation
    from .stochastic.density import Density, JointDensity
    from .stochastic.ensembles import Ensemble, simulate_ensemble
    from .stochastic.noisy_motion import NoisyMotion
    from .stochastic.shapes import DensityShape
    from .studies.study import Study, open_study
    from .studies.sweeping import sweep

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
    "control": (
        "OGY",
        "Controlled",
        "ControlledFlowMotion",
        "ControlledMotion",
        "ControlledStability",
        "DelayedFeedback",
        "IntervalFeedback",
        "orbit_stability",
        "stability_chart",
    ),
    "io": ("Limits", "RawLayout", "info", "read", "read_blocks", "read_many"),
    "detect": ("detect_impacts",),
    "identify": ("FrictionDecay", "Resonance", "identify_friction", "identify_resonance"),
    "dynamics": (),
    "dynamics.branches": ("Branch",),
    "dynamics.continuation": ("continue_orbit",),
    "dynamics.flow_orbits": ("FlowOrbit",),
    "dynamics.lyapunov": ("LyapunovSpectrum", "lyapunov_spectrum"),
    "dynamics.orbits": ("PeriodicOrbit", "find_periodic_orbit", "find_periodic_orbits"),
    "dynamics.periodicity": ("OrbitPeriod", "orbit_period"),
    "dynamics.sections": ("Section", "displacement_section", "impact_map"),
    "dynamics.spectra": ("LyapunovSpectra",),
    "dynamics.tangent": ("TangentMap", "tangent_map"),
    "intervals": (
        "IntervalHistogram",
        "Join",
        "PeriodTrack",
        "Periodicity",
        "Repair",
        "SpeedDrift",
        "Split",
        "coefficient_of_variation",
        "cv2",
        "identify_period",
        "interval_histogram",
        "local_variation",
        "repair_intervals",
        "return_map",
        "track_period",
    ),
    "oscillators": (
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
    ),
    "intervals.bounces": ("restitution_from_bounces",),
    "reconstruct": (),
    "reconstruct.correlation": ("CorrelationSum", "correlation_sum"),
    "reconstruct.delays": ("DelayChoice", "autocorrelation_delay", "mutual_information_delay"),
    "reconstruct.dimension": ("CorrelationDimension", "correlation_dimension"),
    "reconstruct.embedding": ("delay_embed",),
    "reconstruct.exponents": ("LyapunovExponent", "lyapunov_exponent"),
    "reconstruct.neighbors": (
        "AveragedFalseNeighbors",
        "FalseNeighbors",
        "averaged_false_neighbors",
        "false_nearest_neighbors",
    ),
    "oscillators.batch": ("OscillatorBatch",),
    "oscillators.flows": ("Flow",),
    "reconstruct.determinism": ("ReturnMapDeterminism", "return_map_determinism"),
    "reconstruct.information": ("mutual_information",),
    "reconstruct.ordinal": ("OrdinalPatterns", "ordinal_patterns"),
    "reconstruct.prediction": (
        "PredictionError",
        "prediction_error",
        "time_reversal_asymmetry",
    ),
    "reconstruct.recurrence": (
        "RecurrencePlot",
        "RecurrenceQuantification",
        "recurrence_plot",
        "recurrence_quantification",
    ),
    "reconstruct.surrogate_testing": ("SurrogateTest", "surrogate_test"),
    "reconstruct.surrogates": ("Surrogates", "surrogates"),
    "report": ("Detected", "detect_many", "write_report", "write_reports"),
    "simulate.beam_motion": ("BeamMotion",),
    "simulate.flow_motion": ("FlowMotion",),
    "simulate.restitution": ("ApparentRestitution", "apparent_restitution"),
    "simulate.firing": ("integrate_and_fire", "threshold_crossings"),
    "simulate": (
        "FixedStep",
        "Motion",
        "RungeKutta",
        "simulate",
        "simulate_blocks",
        "simulate_many",
    ),
    "simulate.measuring": ("Measured", "measure"),
    "simulate.motions": ("Motions",),
    "simulate.sensors": ("LoadCell", "Microphone"),
    "simulate.synthesis": ("synthesize",),
    "simulate.train_series": ("fired_trains", "noisy_trains"),
    "dynamics.basins": ("Attractor", "Basins", "basins_of_attraction"),
    "dynamics.charts": ("PeriodicityChart", "periodicity_chart"),
    "dynamics.diagrams": ("BifurcationDiagram", "bifurcation_diagram"),
    "dynamics.equivalence": (
        "ContactSamples",
        "EquivalenceError",
        "SoftStopFit",
        "equivalence_error",
        "fit_soft_stop",
    ),
    "dynamics.response": ("ResponseSpectrum", "response_spectrum"),
    "dynamics.matching": ("MatchRate", "match_rate", "strobe_distance"),
    "stochastic.density": ("Density", "JointDensity"),
    "stochastic.ensembles": ("Ensemble", "simulate_ensemble"),
    "stochastic.noisy_motion": ("NoisyMotion",),
    "stochastic.averaging": ("AveragedDensity", "averaged_density"),
    "stochastic.bifurcation": ("PBifurcation", "p_bifurcation"),
    "stochastic.shapes": ("DensityShape",),
    "studies.study": ("Study", "open_study"),
    "studies.sweeping": ("sweep",),
    "comparison": ("Comparison", "compare"),
    "matching": ("Matching", "match_impacts"),
    "alignment": ("Alignment", "align_impacts"),
    "detect.stops": ("StopSeparation", "separate_stops"),
    "reading_motion": ("recorded_motion",),
    "recorded": ("RecordedMotion",),
    "calibration": ("Calibration", "fit_calibration"),
    "combining": ("Combination", "combine_impacts"),
    "experiment.experiment": ("Experiment",),
    "experiment.rig": ("Rig",),
    "fitting": ("OscillatorFit", "fit_oscillator"),
    "plot": (),
}
_WHERE = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "OGY",
    "Alignment",
    "ApparentRestitution",
    "Attractor",
    "AveragedDensity",
    "AveragedFalseNeighbors",
    "BaseMotion",
    "Basins",
    "BeamMotion",
    "BifurcationDiagram",
    "Branch",
    "Calibration",
    "Cantilever",
    "Combination",
    "Comparison",
    "ContactSamples",
    "Controlled",
    "ControlledFlowMotion",
    "ControlledMotion",
    "ControlledStability",
    "CorrelationDimension",
    "CorrelationSum",
    "DelayChoice",
    "DelayedFeedback",
    "Density",
    "DensityShape",
    "Detected",
    "Ensemble",
    "EquivalenceError",
    "Experiment",
    "FalseNeighbors",
    "FixedStep",
    "Flow",
    "FlowMotion",
    "FlowOrbit",
    "Force",
    "Friction",
    "FrictionDecay",
    "Hertz",
    "Impacts",
    "ImpactsigError",
    "ImpactsigWarning",
    "IntervalFeedback",
    "IntervalHistogram",
    "InvalidInput",
    "Join",
    "JointDensity",
    "KelvinVoigt",
    "Limits",
    "LoadCell",
    "LyapunovExponent",
    "LyapunovSpectra",
    "LyapunovSpectrum",
    "MatchRate",
    "Matching",
    "Measured",
    "Microphone",
    "MissingExtra",
    "Motion",
    "Motions",
    "Noise",
    "NoisyMotion",
    "OrbitPeriod",
    "OrdinalPatterns",
    "Oscillator",
    "OscillatorBatch",
    "OscillatorFit",
    "PBifurcation",
    "PeriodTrack",
    "PeriodicOrbit",
    "Periodicity",
    "PeriodicityChart",
    "PredictionError",
    "RawLayout",
    "RecordedMotion",
    "Recording",
    "RecurrencePlot",
    "RecurrenceQuantification",
    "Repair",
    "Resonance",
    "ResponseSpectrum",
    "ReturnMapDeterminism",
    "Rig",
    "Rigid",
    "RungeKutta",
    "Section",
    "SoftStopFit",
    "SpeedDrift",
    "Split",
    "Stop",
    "StopSeparation",
    "Study",
    "SurrogateTest",
    "Surrogates",
    "TangentMap",
    "UnreadableFile",
    "UnwritableFile",
    "align_impacts",
    "apparent_restitution",
    "autocorrelation_delay",
    "averaged_density",
    "averaged_false_neighbors",
    "basins_of_attraction",
    "bifurcation_diagram",
    "coefficient_of_variation",
    "combine_impacts",
    "compare",
    "continue_orbit",
    "correlation_dimension",
    "correlation_sum",
    "cv2",
    "delay_embed",
    "detect_impacts",
    "detect_many",
    "displacement_section",
    "equivalence_error",
    "false_nearest_neighbors",
    "find_periodic_orbit",
    "find_periodic_orbits",
    "fired_trains",
    "fit_calibration",
    "fit_oscillator",
    "fit_soft_stop",
    "flows",
    "identify_friction",
    "identify_period",
    "identify_resonance",
    "impact_map",
    "info",
    "integrate_and_fire",
    "interval_histogram",
    "local_variation",
    "lyapunov_exponent",
    "lyapunov_spectrum",
    "match_impacts",
    "match_rate",
    "measure",
    "mutual_information",
    "mutual_information_delay",
    "noisy_trains",
    "open_study",
    "orbit_period",
    "orbit_stability",
    "ordinal_patterns",
    "p_bifurcation",
    "periodicity_chart",
    "plot",
    "prediction_error",
    "read",
    "read_blocks",
    "read_many",
    "recorded_motion",
    "recurrence_plot",
    "recurrence_quantification",
    "repair_intervals",
    "response_spectrum",
    "restitution_from_bounces",
    "return_map",
    "return_map_determinism",
    "scenes",
    "separate_stops",
    "simulate",
    "simulate_blocks",
    "simulate_ensemble",
    "simulate_many",
    "stability_chart",
    "stop_damping",
    "stop_restitution",
    "stop_stiffness",
    "strobe_distance",
    "surrogate_test",
    "surrogates",
    "sweep",
    "synthesize",
    "tangent_map",
    "threshold_crossings",
    "time_reversal_asymmetry",
    "track_period",
    "write_report",
    "write_reports",
]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        if name in _HOME:
            return import_module(f"{__name__}.{name}")
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_WHERE[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


class _Package(ModuleType):
    """A package in which `simulate` is the function, and never the package of that name."""

    def __setattr__(self, name: str, value: Any) -> None:
        # The import of a package binds it to its name here, whenever that happens.
        if isinstance(value, ModuleType) and _WHERE.get(name) == name:
            value = getattr(value, name)
        super().__setattr__(name, value)

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        # cloudpickle knows modules by their exact type; a function of the user's that names this
        # one takes it along to other processes.
        return import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Package
