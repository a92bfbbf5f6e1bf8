"""A terminal is told what takes long; nobody else is told anything."""

from __future__ import annotations

import io
import sys

import numpy as np
from numba import njit

import impactsig
from impactsig._watched import progress
from impactsig.detect._watching import compiling


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_sees_progress_and_compilation(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress(1000, "S", leave=False) as advance:
        advance.__self__.delay = 0
        advance.__self__.mininterval = 0
        advance(500)
        advance.__self__.refresh()
    assert "50%" in sys.stderr.getvalue()
    with compiling():
        njit(lambda x: x + 1)(1)
        njit(lambda x: x + 2)(1)
    assert sys.stderr.getvalue().count("compiling") == 1


def test_nobody_else_sees_anything(capfd):
    rec = impactsig.Recording(np.random.default_rng(0).standard_normal(10_000), 1000.0)
    impactsig.detect_impacts(rec)
    with compiling():
        njit(lambda x: x + 1)(1)
    assert capfd.readouterr() == ("", "")
