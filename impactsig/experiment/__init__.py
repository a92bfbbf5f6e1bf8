"""Experiments: a rig as data, its recordings as runs, and what they show over the parameter."""
