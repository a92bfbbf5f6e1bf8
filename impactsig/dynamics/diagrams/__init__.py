"""Diagrams, charts, responses and basins: the long-term behaviour over parameters and starts."""
