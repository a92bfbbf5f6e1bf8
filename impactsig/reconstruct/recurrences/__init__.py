"""Recurrence plots and their quantification."""
