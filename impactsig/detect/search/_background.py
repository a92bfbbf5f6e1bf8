"""The background of one second of a force record, and the hum in it.

What stands out of the baseline is cut, mains lines are fitted to the rest and taken off, and the
rest is looked at again, as long as less hum shows more of the background.
"""

from __future__ import annotations

import numpy as np

from ..instrument.dropout_kernels import fill
from ..instrument.mains import find_lines, fit_lines, keeps_pace, pace_of
from ..instrument.mains_kernels import take_off
from ..signal.grid import Grid
from ._background_kernels import chunk_medians, outlying
from .span import Span

WEAK = 0.1
"""Of the noise: hum that is weaker does not change what is background."""
ROUNDS = 6
"""Fits of the hum: each shows the background, and so the hum, more clearly."""
STRONG = 0.1
"""Of the strongest line: weaker ones wait until the background shows without it."""
MOST_GLITCHES = 4096
SQRT12 = float(np.sqrt(12.0))

Lines = tuple[float, ...]
"""Frequencies of mains lines [Hz]."""


class Background:
    """Separates the background of spans, and takes hum off them, with room to work in."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._spikes = np.empty(MOST_GLITCHES, np.int64)

    def separate(self, span: Span, medians: np.ndarray) -> Lines:
        """Mark what is not background; the mains lines found, and those already removed.

        `medians` are those of the span's chunks and of the one to either side.
        """
        grid, blocks = self._grid, len(span.clean) // self._grid.block
        if not len(span.sums):
            span.sums, span.counts = np.empty((2, blocks))
        span.sigma, alone, span.runs = outlying(
            span.clean,
            medians,
            grid.chunk,
            int(grid.longest),
            span.step / SQRT12,
            span.filled,
            span.mask,
            grid.block,
            span.sums,
            span.counts,
            self._spikes,
        )
        span.spikes = self._spikes[: min(alone, MOST_GLITCHES)].copy()
        return self.lines_of(span)

    def lines_of(self, span: Span, base: float | None = None) -> Lines:
        """The mains lines that the background shows; those of `base` where others show it."""
        grid = self._grid
        fitted = tuple(span.hum)
        return find_lines(span.sums, span.counts, grid.pace, grid.rate, span.sigma, fitted, base)

    def take_hum_off(self, span: Span, medians: np.ndarray, lines: Lines) -> None:
        """Remove mains lines, and what of the background shows only then."""
        grid, first = self._grid, (lines, np.empty((0, 2)))
        ratio = 1.0  # of the frequencies to those of the mains
        for turn in range(ROUNDS):
            if turn:
                lines = self.separate(span, medians)
            if turn == 1 and not keeps_pace(span.sums, span.counts, grid.pace, *first):
                self._put_back(span, medians, *first)
                break
            found = (span.sums, span.counts, grid.block, grid.rate)
            fit = fit_lines(*found, tuple(ratio * f for f in lines))
            if not turn:
                strongest = lines[int(np.argmax(np.abs(fit[:, 0])))]
                strong = _strong(lines, fit)
                ratio = pace_of(span.sums, span.counts, grid.pace, strongest)
                if strong != lines or ratio != 1.0:
                    lines = strong
                    fit = fit_lines(*found, tuple(ratio * f for f in lines))
            take_off(
                span.clean, grid.block, len(span.sums), ratio * np.array(lines) / grid.rate, fit
            )
            if not turn:
                first = tuple(ratio * f for f in lines), fit
            strength = np.abs(fit).sum(axis=1)
            for frequency, amplitude in zip(lines, strength, strict=True):
                span.hum[frequency] = max(span.hum.get(frequency, 0.0), float(amplitude))
            if strength.sum() < WEAK * span.sigma:
                break  # the background is as it was
            self._fill_again(span, medians)

    def _put_back(self, span: Span, medians: np.ndarray, lines: Lines, fit: np.ndarray) -> None:
        """Undo that lines were taken off: a tone beside the mains is none of theirs."""
        grid = self._grid
        take_off(span.clean, grid.block, len(span.sums), np.array(lines) / grid.rate, -fit)
        self._fill_again(span, medians)
        self.separate(span, medians)
        span.hum.clear()
        span.lines = ()

    def _fill_again(self, span: Span, medians: np.ndarray) -> None:
        """Draw what is filled in through samples that have changed; compute medians."""
        fill(span.clean, span.filled, np.nan)
        chunk_medians(span.clean, self._grid.chunk, medians[1:-1])


def _strong(lines: Lines, fit: np.ndarray) -> Lines:
    """Lines that are too strong to be made by regular impacts hidden in the hum."""
    strength = np.abs(fit[:, 0])
    least = STRONG * strength.max()
    return tuple(f for f, s in zip(lines, strength, strict=True) if s >= least)
