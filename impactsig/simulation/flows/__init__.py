"""The engine of flows, their motions, crossings and spikes."""
