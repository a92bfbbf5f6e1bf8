"""`impactsig warmup`, after which the first command compiles nothing."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from impactsig.cli import _warmup as warmup
from impactsig.cli import main
from impactsig.errors import InvalidInput

COMMANDS = (
    "simulate karpodinis --periods 10 -o {folder}/a.csv",
    "detect data_samples/loadcell_periodic_22.1Hz.wav --sensor force -o {folder}/b.csv",
    "detect data_samples/sound_periodic_22.1Hz.flac -o {folder}/c.csv",
    "report data_samples/loadcell_chaotic_20.1Hz.wav -o {folder}/d.html",
    "dimension data_samples/loadcell_chaotic_20.1Hz.truth.csv",
)
COMPILED = """
import sys
from numba.core import event

class Names(event.Listener):
    def on_start(self, event):
        function = event.data["dispatcher"].py_func
        if function.__module__.startswith("impactsig"):
            print("compiled", function.__module__, function.__name__, event.data["args"])

    def on_end(self, event):
        pass

event.register("numba:compile", Names())
from impactsig.cli import main
assert main(sys.argv[1:]) == 0
"""


def test_it_does_all_tasks_and_names_those_that_failed(monkeypatch, capsys):
    done = []

    def fail(folder):
        raise InvalidInput("frequency", -1, "a positive number")

    def note(folder):
        print("of no interest")
        done.append(folder.is_dir())

    monkeypatch.setattr(warmup, "TASKS", {"one": note, "other": note})
    assert main(["warmup", "--workers", "1"]) == 0
    out, err = capsys.readouterr()
    assert (done, err) == ([True, True], "")
    assert out.startswith("compiled for this machine in ")
    assert out.count("\n") == 1

    monkeypatch.setattr(warmup, "TASKS", {"failing": fail, "one": note})
    assert main(["warmup", "--workers", "1"]) == 1
    assert "not all kernels could be compiled: failing: frequency" in capsys.readouterr().err
    assert len(done) == 3


@pytest.mark.slow
def test_after_it_the_commands_compile_nothing(tmp_path):
    variables = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    subprocess.run([sys.executable, "-m", "impactsig", "warmup"], check=True, env=variables)
    for command in COMMANDS:
        words = command.format(folder=tmp_path).split()
        found = subprocess.run(
            [sys.executable, "-c", COMPILED, *words],
            check=True, env=variables, capture_output=True, text=True,
        )  # fmt: skip
        assert [line for line in found.stdout.splitlines() if line.startswith("compiled")] == []
