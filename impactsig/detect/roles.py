"""What a channel records, by unit, name or samples; and the choice of channels to search."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

LOOKED_AT = 1_000_000
"""Samples looked at where neither the unit nor the name of a channel tells what it records."""

FORCE, ACCELERATION, SOUND = "a force", "an acceleration", "a sound"
FORCING, TIMING, MOTION = "the forcing", "a trigger or tacho", "a motion"
OTHER = "another quantity"
PULSES, UNKNOWN = "pulses on a quiet baseline", "not known"
SHOW_IMPACTS = (FORCE, ACCELERATION, SOUND)
"""What a sensor of impacts records, that which shows them best first."""

_P = "[yzafpnuµμmcdhkMG]?"
_UNITS = (
    (FORCE, rf"{_P}N|lbs?|lbf|kgf?|newtons?|Newtons?"),
    (ACCELERATION, rf"{_P}gn?|g_n|{_P}m/s(?:²|\^?2|\*\*2)|{_P}m\s?s(?:\^?[-−]2|⁻²)"),
    (SOUND, "[muµμn]?Pa"),
    (MOTION, rf"{_P}m(?:/s)?|mils?|in(?:/s)?|inch|ips|ft|{_P}rad(?:/s)?|(?:deg|°)(?:/s)?|rpm"),
    (OTHER, rf"°[CF]|deg[CF]|[CFK]|{_P}[AWT]|{_P}Hz|%|k?Ohm|bar|psi|[kMh]Pa|m?s|1/min"),
)  # fmt: skip
# Words of names, the first row that fits; what drives or triggers is that whatever it is made of.
_NAMES = (
    (FORCING, "exc|excit.*|forcing|drive[rn]?|shaker|generator|awg|sine|ref|reference|command"
     "|setpoint|motor|erregung|anregung|base|table"),
    (TIMING, "tacho.*|tach|trig|trigger|sync|clock|clk|ttl|gate|encoder|marker|keyphasor|drehzahl"),
    (MOTION, "disp|displacement.*|pos|position|weg|laser|lvdt|vibrometer|vel|velocity|speed|gap"
     "|auslenkung|angle|winkel|deflection|proximity|gyro.*|rotation|distance|abstand|stroke"),
    (OTHER, "temp|temperatur.*|current|strom|humidity|battery|power"),
    (FORCE, "force|load|loadcell|kraft|impact|hammer|piezo|f[xyz]?|pvdf"),
    (ACCELERATION, "acc|accel.*|beschl.*|acc?[xyz]"),
    (SOUND, "mic|micro?phone|mikro.*on|sound|audio|acoustic"),
)  # fmt: skip


class Role(NamedTuple):
    """What a channel records, and the evidence; `steady` samples hold no pulses."""

    kind: str
    by: str = ""
    steady: bool = False

    def __str__(self) -> str:
        known = f", {self.by}" if self.by else ""
        steady = ", steady rather than pulses" if self.steady and self.kind in SHOW_IMPACTS else ""
        return self.kind + known + steady


def role_by_label(name: str, unit: str) -> Role:
    """What a channel records according to its name and unit.

    A name that says forcing or trigger goes before the unit: a shaker has a force too.
    """
    words = re.sub(r"([a-zà-ÿ])(?=[A-Z])|[\W\d_]+", r"\1 ", name).lower().split()
    words += ["".join(words)]
    named = next((kind for kind, known in _NAMES for word in words
                  if re.fullmatch(known, word)), None)  # fmt: skip
    measured = next((kind for kind, known in _UNITS if re.fullmatch(known, unit.strip())), None)
    if named in (FORCING, TIMING) or (named and measured is None):
        return Role(named, f"by its name {name!r}")
    return Role(measured, f"by its unit {unit}") if measured else Role(UNKNOWN)


def role_by_look(samples: np.ndarray) -> Role:
    """What a channel records according to its samples.

    Contacts push one way and are short: pulses are one-sided, recur, and leave the signal near its
    baseline most of the time. Those of a trigger are alike and flat.
    """
    values = samples[np.isfinite(samples)][:LOOKED_AT].astype(float)
    signed = values - (np.median(values) if len(values) else 0.0)
    size = np.abs(signed)
    top = float(size.max(initial=0.0))
    if not top:
        return Role(UNKNOWN, "its samples are all alike")
    high = size > top / 2
    level = float(np.median(size[high]))
    if high.sum() >= 20 and np.mean(np.abs(size[high] - level) < 0.15 * level) > 0.9:
        return Role(TIMING, "as it switches between two levels", True)
    if np.sqrt(np.mean(size**2)) > 0.4 * top:
        return Role("an oscillation", "as a forcing or a motion is", True)
    one_sided = min(signed.max(), -signed.min()) < 0.6 * top
    recurs = np.count_nonzero(np.diff(high.astype(np.int8)) > 0) >= 5
    if one_sided and recurs and np.median(size) < 0.05 * top:
        return Role(PULSES)
    return Role(UNKNOWN)


class Searched(NamedTuple):
    """Channels that are searched for impacts, with a reservation or the reason for none."""

    channels: list[int]
    doubt: str


def searched(roles: Sequence[Role], units: Sequence[str], sensor: str | None) -> Searched:
    """The channels that show impacts best, all of one kind.

    Parameters
    ----------
    roles : sequence of Role
        What each channel is taken for.
    units : sequence of str
        Their units.
    sensor : {"force", "sound"} or None
        What recorded the impacts, if that was said: then channels that nothing is known of are
        taken for it where none is labelled so.
    """
    wanted = {None: SHOW_IMPACTS, "force": SHOW_IMPACTS[:2], "sound": SHOW_IMPACTS[2:]}[sensor]
    for kind in wanted:
        found = [k for k, role in enumerate(roles) if role.kind == kind]
        pulsed = [k for k in found if not roles[k].steady]
        if pulsed:
            return Searched(pulsed, "")
        if found:
            return Searched(found, "though what it shows is steady rather than pulses")
    likely = (PULSES,) if sensor is None else (PULSES, UNKNOWN)
    found = [k for k, role in enumerate(roles) if role.kind in likely]
    if found and sensor is not None:
        return Searched(found, "")
    if len({units[k] for k in found}) == 1:
        return Searched(found, "by the look alone, as no name and no unit says what is recorded")
    return Searched([], "it is not clear which of them shows impacts")
