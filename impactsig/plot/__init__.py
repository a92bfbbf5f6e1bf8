"""Results to matplotlib Axes: every function takes a result and optional Axes, returns Axes.

Without `ax`, or `figure` where a result takes several axes, it draws on a new figure. The limits of
what was drawn can be changed and more be drawn: time is in seconds and all else in the unit of the
data, whatever prefix the ticks are written with. Results have a method `plot` that calls the
function for them.
"""

from .averaging import averaged_density, p_bifurcation
from .beams import apparent_restitution, mode_shapes, restitution_over_modes, tip_history
from .branches import branch
from .calibration import calibration_curve
from .comparison import comparison
from .control import (
    control_effort,
    control_force,
    control_intervals,
    control_strobe,
    controlled_flow,
    flow_orbit,
    stability_chart,
)
from .correlation import correlation_sum
from .diagrams import basins, bifurcation_diagram, periodicity_chart, response_spectrum
from .dimension import dimension
from .embedding import averaged_false_neighbors, delay_choice, false_neighbors
from .ensembles import density, joint_density, noisy_motion
from .equivalence import match_rate
from .experiments import experiment
from .exponents import stretch_curve
from .fitting import oscillator_fit
from .lyapunov import lyapunov_convergence
from .motions import phase_portrait, power_spectrum, time_history
from .periods import period_track
from .recurrence import recurrence_plot
from .resonances import decay, resonance
from .sections import section
from .sequences import histogram, return_map
from .spikes import contact_against_interval, interval_sequence, peak_against_time, spike_train
from .studies import parameter_study
from .surrogates import prediction_error, surrogate_test
from .trains import interval_densities, return_maps
from .waveforms import pulse, waveform

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
