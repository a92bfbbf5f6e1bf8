"""Experiments: a rig as data, its recordings as runs, and diagrams over the parameter."""
