"""Detection of impacts in recordings of force or sound."""

from .detect import detect_impacts

__all__ = ["detect_impacts"]
