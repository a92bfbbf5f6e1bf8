"""A terminal is told what takes long; nobody else is told anything."""

from __future__ import annotations

import importlib
import io
import sys

import numpy as np
import pytest

import impactsig
from impactsig import _compiled, _watched
from impactsig._watched import progress
from impactsig.cli import _warmup as _warmup_command
from impactsig.reconstruct import _threads


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


@pytest.fixture
def told(monkeypatch):
    """Unit, what was done of how much, and delay of every bar that a terminal would be shown."""
    bars = []

    class Bar:
        def __init__(self, total, initial, unit, delay, **_):
            self.entry = [unit.strip(), initial, total, delay]
            bars.append(self.entry)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def update(self, count):
            self.entry[1] += count

    monkeypatch.setattr("tqdm.tqdm", Bar)
    monkeypatch.setattr(_watched, "watched", lambda: True)
    return bars


def test_surrogates_are_counted(told):
    x = np.random.default_rng(0).standard_normal(200)
    impactsig.surrogate_test(x, "time_reversal_asymmetry", count=19, seed=1)
    assert ["surrogates", 19, 19, 1.0] in told


@pytest.mark.parametrize("workers", [1, 2])
def test_parts_of_a_sum_are_counted(told, workers):
    assert _threads.in_threads(lambda k: k * k, 7, workers) == [k * k for k in range(7)]
    assert told == [["parts", 7, 7, 1.0]]


def test_warming_up_is_shown_from_its_beginning(told, monkeypatch):
    monkeypatch.setattr(_warmup_command, "watched", lambda: True)
    monkeypatch.setattr(_warmup_command, "TASKS", {"nothing": lambda folder: None})
    list(_warmup_command.warmed_up(1))
    # A bar with a delay is drawn when the first task ends, which takes most of a minute.
    assert told == [["cells", 1, 1, 0.0]]


def test_nobody_else_sees_anything(capfd, monkeypatch, tmp_path):
    rec = impactsig.Recording(np.random.default_rng(0).standard_normal(10_000), 1000.0)
    impactsig.detect_impacts(rec)
    compile_two(tmp_path, monkeypatch)
    assert capfd.readouterr() == ("", "")
