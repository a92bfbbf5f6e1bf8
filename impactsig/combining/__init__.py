"""Trains of several sensors of one machine, combined into one."""
