"""A terminal is told what takes long; nobody else is told anything."""

from __future__ import annotations

import importlib
import io
import sys

import numpy as np

import impactsig
from impactsig import _compiled
from impactsig._watched import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


KERNELS = """
from impactsig._compiled import njit

@njit()
def first(x):
    return x + 1

@njit()
def second(x):
    return x + 2
"""


def compile_two(folder, monkeypatch):
    (folder / "two_kernels.py").write_text(KERNELS)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr(_compiled, "_said", [])
    kernels = importlib.import_module("two_kernels")
    monkeypatch.delitem(sys.modules, "two_kernels")
    assert (kernels.first(1), kernels.second(1)) == (2, 3)


def test_a_terminal_sees_progress_and_compilation(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress(1000, "S", leave=False) as advance:
        advance.__self__.delay = 0
        advance.__self__.mininterval = 0
        advance(500)
        advance.__self__.refresh()
    assert "50%" in sys.stderr.getvalue()
    compile_two(tmp_path, monkeypatch)
    assert sys.stderr.getvalue().count("compiling") == 1


def test_nobody_else_sees_anything(capfd, monkeypatch, tmp_path):
    rec = impactsig.Recording(np.random.default_rng(0).standard_normal(10_000), 1000.0)
    impactsig.detect_impacts(rec)
    compile_two(tmp_path, monkeypatch)
    assert capfd.readouterr() == ("", "")
