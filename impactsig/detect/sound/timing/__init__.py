"""Timing of impacts in sound: edges, similar waveforms, shared modes."""
