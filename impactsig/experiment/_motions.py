"""Names of the motion of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

NO_IMPACTS = "no impacts"
"""The kind of motion of a run without impacts."""
APERIODIC = ("quasi-periodic", "banded", "chaotic", "irregular")


def motion_of(row: Mapping[str, Any]) -> tuple[str, int | None, int | None, float]:
    """Name of the motion, m and n if it is periodic, and its probability."""
    kind, confidence = row["kind"], row["confidence"]
    if kind == NO_IMPACTS:
        return NO_IMPACTS, 0, 1, confidence
    if kind in ("periodic", "drifting") and row["n"]:
        return f"period({row['m']},{row['n']})", row["m"], row["n"], confidence
    if kind in APERIODIC:
        return "aperiodic", None, None, confidence
    return "unknown", None, None, 0.0
