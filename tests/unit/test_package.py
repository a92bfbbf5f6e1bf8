"""The package itself: what importing it costs, what it offers, how its errors behave."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import impactsig
from impactsig import InvalidInput, MissingExtra, UnreadableFile, UnwritableFile


def test_import_brings_in_nothing_heavy():
    probe = (
        "import sys, impactsig; "
        "print(*[m for m in ('numba', 'matplotlib', 'pandas', 'scipy') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == ""


def test_every_public_name_is_there():
    assert len(impactsig.__all__) == len(set(impactsig.__all__))
    for name in impactsig.__all__:
        assert getattr(impactsig, name) is not None
        assert name in dir(impactsig)
    with pytest.raises(AttributeError, match="no attribute 'detekt'"):
        _ = impactsig.detekt


@pytest.mark.parametrize(
    "error",
    [
        InvalidInput("rate", -1, "a positive number [Hz]", "Give rate="),
        UnreadableFile("a.wav", "is empty"),
        UnwritableFile("b.html", "is a folder", "Rename it"),
        MissingExtra("npTDMS", "daq", "Reading TDMS"),
    ],
)
def test_errors_survive_a_process_boundary(error):
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert again.__dict__ == error.__dict__


def test_messages_name_value_and_remedy():
    error = InvalidInput("rate", "x" * 500, "a positive number [Hz]", "Give rate=")
    assert str(error).startswith("rate: got x")
    assert len(str(error)) < 160
    assert str(error).endswith("Give rate=")
    assert isinstance(error, ValueError)
    assert isinstance(UnreadableFile("a", "b"), OSError)
    assert 'impactsig[daq]"' in str(MissingExtra("npTDMS", "daq", "Reading TDMS"))


def test_the_version_is_the_same_wherever_it_stands():
    root = Path(__file__).resolve().parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    cited = re.search(r"^version: (.*)$", (root / "CITATION.cff").read_text(), re.M)
    assert cited is not None
    assert impactsig.__version__ == project["version"] == cited[1]
    assert f"## {impactsig.__version__} " in (root / "CHANGELOG.md").read_text()
