"""Mean powers of a window, of octaves and narrow bands, with what lies in digital silence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._kernels import BLOCK, GROUP
from ._level_kernels import PART, PER, put_levels
from .powers.fades import edge_steps
from .powers.holes import falls_of


class Levels(NamedTuple):
    """Mean powers of a window that the background is read from."""

    parts: np.ndarray  # (octaves, PARTs in whole BLOCKs)
    parts_sound: np.ndarray  # those that digital silence does not touch
    means: np.ndarray  # (octaves, low octaves and bands; BLOCKs)
    sound: np.ndarray  # BLOCKs that are not all digital silence
    silent: np.ndarray  # PARTs that are digital silence
    long_parts: np.ndarray  # (octaves and low octaves, LONG_PARTs)
    steps: tuple[np.ndarray, np.ndarray]  # where it ends and begins (`edge_steps`)
    falls: tuple[int, int, int]  # of bands (`falls_of`)
    cores: np.ndarray  # (cores, columns), as by `cores_of`

    @property
    def blocks(self) -> int:
        return len(self.sound)


def together(windows: list[Levels]) -> Levels:
    """Levels of windows one after the other."""
    if len(windows) == 1:
        return windows[0]
    *arrays, steps, falls, cores = zip(*windows, strict=True)
    parts, counted, means, sound, silent, long_parts = (
        np.concatenate(each, axis=-1) for each in arrays
    )
    opening, closing = (np.concatenate(side) for side in zip(*steps, strict=True))
    pairs, deep, crossing = map(sum, zip(*falls, strict=True))
    return Levels(
        parts, counted, means, sound, silent, long_parts,
        (opening, closing), (pairs, deep, crossing), np.concatenate(cores),
    )  # fmt: skip


class Powers(NamedTuple):
    """Powers of the frames of a window; those of octaves also before and after it."""

    octaves: np.ndarray
    left: int  # frames of these before the window
    real: tuple[int, int]  # the first of these in the segment, and that at which it ends
    low: np.ndarray  # means of the low octaves in LONG_PARTs
    bands: np.ndarray  # of narrow bands in GROUPs
    known: np.ndarray  # GROUPs whose bands lie in the segment


def levels_of(power: Powers, cores: np.ndarray, part: float) -> tuple[Levels, np.ndarray]:
    """Levels of a window, and which of its GROUPs are silent.

    `part` is the duration of a PART [s].
    """
    groups = len(power.known)
    blocks = -(-groups // PER)
    parts = np.zeros((len(power.octaves), blocks * (BLOCK // PART)))
    counted, silent = np.zeros(parts.shape[1], np.bool_), np.empty(groups + 4, np.bool_)
    narrow = len(parts) + len(power.low)  # the first of the bands
    long_parts = np.empty((narrow, power.low.shape[1]))
    means, sounding = np.empty((narrow + len(power.bands), blocks)), np.empty(blocks, np.bool_)
    any_silent = put_levels(power, parts, counted, silent, long_parts, means, sounding)
    silent = silent[2 : groups + 2]
    silent_parts = np.zeros(len(counted), np.bool_)
    steps = np.empty(0), np.empty(0)
    if any_silent:
        silent_parts[: GROUP // PART * groups] = np.repeat(silent, GROUP // PART)
        steps = edge_steps(parts, counted, part)
    falls = falls_of(means[narrow:], sounding)
    levels = Levels(parts, counted, means, sounding, silent_parts, long_parts, steps, falls, cores)
    return levels, silent
