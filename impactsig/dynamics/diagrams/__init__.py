"""Diagrams, charts, responses and basins: what motions settle to."""
