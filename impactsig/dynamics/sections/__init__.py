"""Sections of a motion, by displacement and from impact to impact."""
