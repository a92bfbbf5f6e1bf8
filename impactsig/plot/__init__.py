"""Figures of results on matplotlib Axes: every function returns the Axes it drew on.

Without `ax`, or `figure` where a result takes several axes, it draws on a new figure. The limits of
what was drawn can be changed and more be drawn: time is in seconds and all else in the unit of the
data, whatever prefix the ticks are written with. Results have a method `plot` that calls the
function for them.
"""

from .comparison import comparison
from .experiments import experiment
from .fitting import machine_fit, oscillator_fit, prediction
from .geometry.correlation import correlation_sum
from .geometry.dimension import dimension
from .geometry.embedding import averaged_false_neighbors, delay_choice, false_neighbors
from .geometry.exponents import stretch_curve
from .geometry.periods import period_track
from .geometry.recurrence import recurrence_plot
from .geometry.surrogates import prediction_error, surrogate_test
from .records.calibration import calibration_curve
from .records.resonances import decay, resonance
from .records.sequences import histogram, return_map
from .records.spikes import (
    contact_against_interval,
    interval_sequence,
    peak_against_time,
    spike_train,
)
from .records.trains import interval_densities, return_maps
from .records.waveforms import pulse, waveform
from .studies import parameter_study
from .systems.averaging import averaged_density, p_bifurcation
from .systems.beams import apparent_restitution, mode_shapes, restitution_over_modes, tip_history
from .systems.branches import branch
from .systems.control import (
    control_effort,
    control_force,
    control_intervals,
    control_strobe,
    controlled_flow,
    flow_orbit,
    stability_chart,
)
from .systems.diagrams import basins, bifurcation_diagram, periodicity_chart, response_spectrum
from .systems.ensembles import density, joint_density, noisy_motion
from .systems.equivalence import match_rate
from .systems.lyapunov import lyapunov_convergence
from .systems.motions import phase_portrait, power_spectrum, time_history
from .systems.sections import section

__all__ = [
    "apparent_restitution",
    "averaged_density",
    "averaged_false_neighbors",
    "basins",
    "bifurcation_diagram",
    "branch",
    "calibration_curve",
    "comparison",
    "contact_against_interval",
    "control_effort",
    "control_force",
    "control_intervals",
    "control_strobe",
    "controlled_flow",
    "correlation_sum",
    "decay",
    "delay_choice",
    "density",
    "dimension",
    "experiment",
    "false_neighbors",
    "flow_orbit",
    "histogram",
    "interval_densities",
    "interval_sequence",
    "joint_density",
    "lyapunov_convergence",
    "machine_fit",
    "match_rate",
    "mode_shapes",
    "noisy_motion",
    "oscillator_fit",
    "p_bifurcation",
    "parameter_study",
    "peak_against_time",
    "period_track",
    "periodicity_chart",
    "phase_portrait",
    "power_spectrum",
    "prediction",
    "prediction_error",
    "pulse",
    "recurrence_plot",
    "resonance",
    "response_spectrum",
    "restitution_over_modes",
    "return_map",
    "return_maps",
    "section",
    "spike_train",
    "stability_chart",
    "stretch_curve",
    "surrogate_test",
    "time_history",
    "tip_history",
    "waveform",
]
