"""Path to Recording: one file a format family, one table of formats."""
