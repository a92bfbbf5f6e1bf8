"""What makes the impacts of a sound record doubtful, in words."""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP
from .._survey import Survey

GATED = 0.05  # fraction of digital silence from which on there is a note
STRETCHES = 3  # of it
PULSES = 10  # of a voice that a note is worth
MAINS = 50.0, 60.0, 100.0, 120.0  # [Hz], of buzzing mains
EXACT, MOST, TRAIN = 0.3e-3, 0.5, 50  # [s], share of the intervals, and impacts, of a buzz


def converter_notes(survey: Survey) -> tuple[str, ...]:
    """A note if the converter does not resolve the noise."""
    if not survey.backgrounds.unresolved:
        return ()
    return (
        "The noise is weaker than a step of the converter, so sounds of less than a step are "
        "lost, and fade-outs click: record with a higher gain or more bits.",
    )


def click_notes(count: int) -> tuple[str, ...]:
    """A note if clicks were left out."""
    return (
        f"{count} single samples stand out, as a loose cable or a lost word leaves them, and are "
        "not counted as impacts.",
    )


def voice_notes(pulses: int) -> tuple[str, ...]:
    """A sentence where rises were left out because they come as the pulses of a voice do."""
    if pulses < PULSES:
        return ()
    return (
        f"{pulses} sudden rises crowd within some tenths of a second, as the pulses of a voice do, "
        "and are not counted as impacts.",
    )


def mains_notes(time: np.ndarray) -> tuple[str, ...]:
    """A sentence where most impacts follow each other as the pulses of buzzing mains do."""
    if len(time) < TRAIN:
        return ()
    interval = np.diff(time)
    equal = [np.count_nonzero(np.abs(interval - 1.0 / mains) < EXACT) for mains in MAINS]
    share = [int(count) / len(interval) for count in equal]
    most = int(np.argmax(share))
    if share[most] < MOST:
        return ()
    return (
        f"{share[most]:.0%} of the intervals are 1/{MAINS[most]:.0f} s: unless the mains drive the "
        "machine, these are pulses of a buzz that cables or a lamp brought in.",
    )


def swell_notes(swells: int) -> tuple[str, ...]:
    """A sentence where rises were left out because noise swells again and again."""
    if swells < PULSES:
        return ()
    return (
        f"{swells} rises are gradual and come one after the other, as noise that swells makes them "
        "(a fan, a compressor, wind), and are not counted as impacts.",
    )


def crowd_notes(crowded: int, found: int) -> tuple[str, ...]:
    """A sentence where more rises are left out than found because they come too densely."""
    if crowded <= max(PULSES, found):
        return ()
    return (
        f"{crowded} sudden rises, 30 a second and more, are left out, since rattling may make as "
        "many: if they are impacts, a lower least_probability finds them.",
    )


def codec_notes(survey: Survey) -> tuple[str, ...]:
    """A note if a codec left holes in most of the record."""
    if not survey.backgrounds.coded:
        return ()
    return (
        "Bands of the sound fall silent and return one by one, as a codec of a low bit rate leaves "
        "them: soft impacts are lost, and some that are found may be bands that return.",
    )


def closing_notes(survey: Survey, samples: int) -> tuple[str, ...]:
    """A note if a gate attenuates much of the record, but not to zero."""
    closed = sum(
        int(np.count_nonzero(passage.silent & ~passage.digital)) for passage in survey.passages
    )
    share = closed * GROUP * survey.scale.hop / samples
    if share < GATED:
        return ()
    return (
        f"In {share:.0%} of the record the noise is lowered, and returns at once, as a noise gate "
        "or noise suppression lowers it: impacts softer than its threshold are lost, and some that "
        "are found may be sounds in whose midst it opens. Record without it.",
    )


def gate_notes(survey: Survey, samples: int) -> tuple[str, ...]:
    """A note if much of the record is repeated digital silence."""
    if survey.backgrounds.unresolved:
        return ()
    silent = [passage.digital for passage in survey.passages]
    count = sum(int(np.count_nonzero(part)) for part in silent)
    share = count * GROUP * survey.scale.hop / samples
    if share < GATED:
        return ()
    stretches = sum(int(np.count_nonzero(part[1:] & ~part[:-1])) for part in silent)
    if stretches < STRETCHES:
        return ()
    return (
        f"{share:.0%} of the record is digital silence, in {stretches} stretches, as a noise gate "
        "or a codec leaves it: impacts softer than its threshold are lost, and the noise is read "
        "from what it let through.",
    )
