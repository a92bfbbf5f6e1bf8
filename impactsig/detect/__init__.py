"""Recording to Impacts: noise floor, threshold with hysteresis, contact time, sound onsets."""

from .detect import detect_impacts

__all__ = ["detect_impacts"]
