"""Shared by force and sound: sample streams, widths, order statistics, probabilities."""
