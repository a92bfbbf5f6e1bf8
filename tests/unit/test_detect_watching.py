"""A terminal is told what takes long; nobody else is told anything."""

from __future__ import annotations

import importlib
import io
import sys
import threading
from contextlib import contextmanager

import numpy as np
import pytest

import impactsig
from impactsig._compiling import compiled
from impactsig._running import watched
from impactsig._running.threads import in_threads
from impactsig._running.watched import following, progress
from impactsig._trains import impact_tables
from impactsig.cli import _warmup as _warmup_command


class Terminal(io.StringIO):
    def isatty(self):
        return True


KERNELS = """
from impactsig._compiling.compiled import njit

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
    monkeypatch.setattr(compiled, "_announced", [])
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
    monkeypatch.setattr(watched, "watched", lambda: True)
    return bars


def test_surrogates_are_counted(told):
    x = np.random.default_rng(0).standard_normal(200)
    impactsig.surrogate_test(x, "time_reversal_asymmetry", count=19, seed=1)
    assert ["surrogates", 19, 19, 1.0] in told


@pytest.mark.parametrize("workers", [1, 2])
def test_parts_of_a_sum_are_counted(told, workers):
    assert in_threads(lambda k: k * k, range(7), workers) == [k * k for k in range(7)]
    assert told == [["parts", 7, 7, 1.0]]


def test_starts_of_basins_and_points_of_branches_are_counted(told):
    beam = impactsig.scenes.karpodinis
    impactsig.basins_of_attraction(beam(22.1), [0.0, 0.1], [0.0], workers=1)
    assert ["tiles", 1, 1, 1.0] in told
    impactsig.basins_of_attraction(impactsig.flows.lorenz(rho=10.0), [0.0, 0.1], [0.1],
                                   section=("z", 5.0), workers=1)  # fmt: skip
    assert ["starts", 2, 2, 1.0] in told
    branch = impactsig.continue_orbit(beam, (22.1, 22.2), most=4)
    assert ["points", len(branch) - 1, None, 1.0] in told


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


def test_a_kernel_is_followed_while_it_runs(monkeypatch):
    monkeypatch.setattr(watched, "DELAY", 0.0)
    monkeypatch.setattr(watched, "_LOOK", 0.001)
    looked = threading.Event()

    def done():
        looked.set()
        return 30.0

    for stream, told in ((io.StringIO(), False), (Terminal(), True)):
        monkeypatch.setattr(sys, "stderr", stream)
        with following(100, " periods", done):
            assert looked.wait(5) if told else not looked.wait(0.02)
        assert ("periods" in stream.getvalue()) == told


@pytest.mark.parametrize(
    ("module", "system", "asked", "total", "unit"),
    [
        ("simulation.run", impactsig.scenes.karpodinis(22.1), {"periods": 7}, 7, " periods"),
        ("simulation.run", impactsig.scenes.karpodinis(22.1), {"duration": 0.3}, 0.3, " s"),
        ("simulation.flows.flow_motion", impactsig.flows.rossler(), {"duration": 9.0}, 9.0, " s"),
    ],
)
def test_a_run_tells_how_far_it_is(monkeypatch, module, system, asked, total, unit):
    """At its end it has come to the end, and it begins at the start."""
    seen = []

    @contextmanager
    def follow(*arguments):
        seen.append((*arguments[:2], arguments[2]()))
        yield
        seen.append(arguments[2]())

    monkeypatch.setattr(importlib.import_module(f"impactsig.{module}"), "following", follow)
    impactsig.simulate(system, **asked)
    (length, word, begin), end = seen
    assert (length, word, begin) == (pytest.approx(total, rel=1e-12), unit, 0)
    assert end == pytest.approx(total, rel=1e-12)


def test_nobody_watches_one_of_many_processes(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    assert watched.watched()
    monkeypatch.setattr(watched.multiprocessing, "parent_process", lambda: "the caller")
    assert not watched.watched()


def test_a_long_train_is_written_in_sight(monkeypatch, tmp_path):
    train = impactsig.Impacts.from_times(np.arange(25_000.0))
    told = []

    @contextmanager
    def bar(total, unit, **options):
        told.append((total, unit))
        yield told.append

    monkeypatch.setattr(impact_tables, "progress", bar)
    train.to_csv(tmp_path / "a.csv")
    assert told == [(25_000, " rows"), 10_000, 10_000, 5000]
    back = impactsig.Impacts.read_csv(tmp_path / "a.csv")
    np.testing.assert_array_equal(back.time, train.time)
