"""Pulses that touch or overlap, measured with the shape of those that stand alone."""
