"""Whether somebody is there to be told what takes long."""

from __future__ import annotations

import sys


def watched() -> bool:
    """Whether a terminal or a notebook is watching."""
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())
