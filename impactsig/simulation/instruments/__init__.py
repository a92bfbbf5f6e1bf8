"""Instruments: threshold detectors, and synthetic recordings."""
