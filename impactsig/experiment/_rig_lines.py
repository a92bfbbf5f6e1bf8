"""Line numbers of keys in a TOML text, which `tomllib` does not keep."""

from __future__ import annotations

import re

_HEAD = re.compile(r"\s*(\[\[?)\s*([^\]]+?)\s*\]")
_KEY = re.compile(r"\s*([\w\"'-]+(?:\s*\.\s*[\w\"'-]+)*)\s*=")


def line_of(written: str, argument: str) -> int:
    """Line, counted from 1, of a key such as "channel[1].unit", or of its parent."""
    lines = _lines(written)
    while argument:
        if argument in lines:
            return lines[argument]
        cut = max(argument.rfind("."), argument.rfind("["))
        argument = argument[:cut] if cut > 0 else ""
    return 1


def _lines(written: str) -> dict[str, int]:
    places: dict[str, int] = {}
    table = ""
    count: dict[str, int] = {}
    for number, line in enumerate(written.splitlines(), 1):
        if head := _HEAD.match(line):
            table = head[2].strip("\"'")
            if head[1] == "[[":
                count[table] = count.get(table, -1) + 1
                places.setdefault(table, number)
                table = f"{table}[{count[table]}]"
            places.setdefault(table, number)
        elif key := _KEY.match(line):
            name = re.sub(r"[\s\"']", "", key[1])
            places.setdefault(f"{table}.{name}" if table else name, number)
    return places
