"""Standard input, kept in a file while a command reads it: how that file is called in words."""

from __future__ import annotations

import re
from pathlib import Path

FOLDER, NAME = "impactsig-stdin-", "standard-input"
"""How its folder begins, and its name."""
WORDS = "standard input"
_WRITTEN = re.compile(rf"[^\s'\"]*{FOLDER}\w+[/\\]+{NAME}(\.csv)?")


def is_standard_input(path: str | Path) -> bool:
    """Whether a path is that of the file."""
    return _WRITTEN.fullmatch(str(path)) is not None


def in_words(text: str) -> str:
    """The text with standard input in place of a path that is gone when the command ends."""
    return _WRITTEN.sub(WORDS, text)
