"""Results to matplotlib Axes: every function takes a result and optional Axes, returns Axes."""

from .comparison import comparison
from .correlation import correlation_sum
from .dimension import dimension
from .motions import phase_portrait, power_spectrum, time_history
from .sequences import histogram, return_map
from .spikes import contact_against_interval, interval_sequence, peak_against_time, spike_train
from .trains import interval_densities, return_maps
from .waveforms import pulse, waveform

__all__ = [
    "comparison",
    "contact_against_interval",
    "correlation_sum",
    "dimension",
    "histogram",
    "interval_densities",
    "interval_sequence",
    "peak_against_time",
    "phase_portrait",
    "power_spectrum",
    "pulse",
    "return_map",
    "return_maps",
    "spike_train",
    "time_history",
    "waveform",
]
