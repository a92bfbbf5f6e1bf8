"""Names and units from column headings such as "Force [N]", "force (N)" or "Force / N"."""

from __future__ import annotations

import re

_PREFIX = r"(?:da|[yzafpnuµμmcdhkMGTPEZY])?"
_BASE = (
    r"(?:s|sec|secs|second|seconds|Second|Seconds|Sequence|Volt|min|h|hr|Hz|hz|m|meter|meters|g|gn|g_n|kg|kg_n|N|newton|newtons"
    r"|lb|lbs|lbf|kgf|V|v|volt|volts|Volts|Newtons|A|amp|Pa|bar|psi|K|C|°C|degC|°F|deg|°|rad|%|W|J"
    r"|Ohm|ohm|Ω|F|T|strain|eps|ε|mil|in|inch|ft|dB|rpm|cnt|counts|a\.u\.|1|-)"
)
_FACTOR = rf"{_PREFIX}{_BASE}(?:\^?[-−]?[0-9²³⁻¹]+)?"
_UNIT = re.compile(
    rf"{_FACTOR}(?:\s?[/*·⋅. ]\s?{_FACTOR})*|m?sec|msec|usec|milliseconds|microseconds"
)


_CHANNEL = re.compile(r"(ch\s?\d+)\s?(\D.*)?", re.I)


def is_unit(text: str) -> bool:
    """Whether a text is a physical unit; ch1 is a channel, not an inverse centihour."""
    plain = text.strip()
    return _UNIT.fullmatch(plain) is not None and _CHANNEL.match(plain) is None


def split_heading(heading: str) -> tuple[str, str]:
    """Name and unit of a column heading; the unit is "" if there is none.

    What stands in square brackets is a unit; in round ones or after a slash only if it reads as
    one, because a channel may be called "Excitation (Trigger)" or "in/out".
    """
    text = heading.strip().removesuffix(":")
    if match := re.fullmatch(r"(.*?)\s*\[\s*([^\[\]]*?)\s*\]", text):
        return match[1], match[2]
    if (match := re.fullmatch(r"(.*?)\s*\(\s*([^()]+?)\s*\)", text)) and is_unit(match[2]):
        return match[1], match[2]
    if (match := re.fullmatch(r"(.+?)\s+/\s+(\S+)", text)) and is_unit(match[2]):
        return match[1], match[2]
    # "Kraft/N" as in DIN 1313, but not "m/s"; "CH1V", "ch1 V"
    if (match := re.fullmatch(r"(\S{2,})/(\S+)", text)) and not is_unit(text) and is_unit(match[2]):
        return match[1], match[2]
    if (match := _CHANNEL.fullmatch(text)) and match[2] and is_unit(match[2]):
        return match[1], match[2]
    # "C1 in V", "Force (N) Run 1"
    if (match := re.fullmatch(r"(?:(.+?)\s+)?in\s+(\S+)", text)) and is_unit(match[2]):
        return match[1] or "", match[2]
    if (match := re.fullmatch(r"(.+?)\s*\(([^()]+)\)\s+(.+)", text)) and is_unit(match[2]):
        return f"{match[1]} {match[3]}", match[2]
    return text, ""


def unit_cell(text: str) -> str | None:
    """The unit in a cell of a line of units, such as "[N]", "N" or "force - N"; None if none."""
    plain = re.sub(r"\s*\(.*\)$", "", text.strip()) if not text.strip().startswith("(") else text
    plain = plain.rpartition(" - ")[2].strip()
    bracketed = re.fullmatch(r"[\[(]\s*([^\[\]()]*?)\s*[\])]", plain)
    if bracketed:
        return bracketed[1]
    return plain if is_unit(plain) else None
