"""Results to matplotlib Axes."""
