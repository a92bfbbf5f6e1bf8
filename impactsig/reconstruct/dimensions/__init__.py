"""Correlation dimension under timing errors: kernel sums, slopes and their errors."""
