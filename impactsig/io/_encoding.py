"""Character encoding of text files."""

from __future__ import annotations

import codecs
import re

_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f]")
"""Characters that no text has."""


def is_plain(head: bytes) -> bool:
    """Whether bytes may be text in an ASCII-compatible encoding."""
    return _CONTROL.search(head) is None


def encoding_of(head: bytes) -> str:
    """UTF-16 or UTF-8 by byte-order mark, else UTF-8 if it decodes, else Latin-1.

    UTF-16 without a mark has zeros for every other byte of what is written in Latin letters.
    """
    if head[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return "utf-16"
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        zeros, letters = head[first::2], head[1 - first :: 2]
        if len(head) > 3 and zeros.count(0) > 0.9 * len(zeros) and not _CONTROL.search(letters):
            return encoding
    try:
        # The last character may be cut in two.
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"
