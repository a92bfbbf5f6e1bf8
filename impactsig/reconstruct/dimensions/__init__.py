"""Correlation dimension under timing errors: kernel sums, slopes, their errors."""
