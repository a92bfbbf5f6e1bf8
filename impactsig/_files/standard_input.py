"""Name of the temporary file that holds standard input, and how messages refer to it."""

from __future__ import annotations

import re
from pathlib import Path

FOLDER, NAME = "impactsig-stdin-", "standard-input"
"""How its folder begins, and its name."""
WORDS = "standard input"
_WRITTEN = re.compile(rf"[^\s'\"]*{FOLDER}\w+[/\\]+{NAME}(\.csv)?")


def is_standard_input(path: str | Path) -> bool:
    """Whether a path is that of the temporary file."""
    return _WRITTEN.fullmatch(str(path)) is not None


def in_words(text: str) -> str:
    """Replace the path of the temporary file by the words "standard input"."""
    return _WRITTEN.sub(WORDS, text)
