"""Whether a controlled orbit is stable: maps and their derivatives."""
