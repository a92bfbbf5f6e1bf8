"""The package itself: what importing it costs, what it offers, how its errors behave."""

from __future__ import annotations

import ast
import pickle
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import impactsig
from impactsig import InvalidInput, MissingExtra, UnreadableFile, UnwritableFile, _public


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


def test_the_public_names_are_verbs_and_what_one_makes():
    """Classes that only functions make are in `results`, and nowhere else."""
    assert len(impactsig.__all__) < 120
    made = {name for name in impactsig.__all__ if _is_result(getattr(impactsig, name))}
    assert made == {"Experiment"}  # made by its own method, `read`
    assert all(_is_result(getattr(impactsig.results, name)) for name in impactsig.results.__all__)
    assert not set(impactsig.results.__all__) & set(impactsig.__all__)
    assert dir(impactsig.results) == impactsig.results.__all__
    with pytest.raises(AttributeError, match="no attribute 'Motoin'"):
        _ = impactsig.results.Motoin


def _is_result(value):
    """Whether it is a class that checks nothing of what it is made of."""
    return (
        isinstance(value, type)
        and not issubclass(value, BaseException)
        and "__post_init__" not in vars(value)
    )


@pytest.mark.parametrize("stub", ["__init__.pyi", "results.pyi"])
def test_a_stub_is_read_as_a_type_checker_reads_it(stub):
    text = (Path(impactsig.__file__).parent / stub).read_text(encoding="utf-8")
    names = [
        alias.asname
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    ]
    assert sorted(names) == sorted(_public.listed(stub))


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


def test_private_modules_are_not_imported_from_other_packages():
    """A name that begins with an underscore is for the package that it stands in, and below."""
    foreign = re.compile(r"^\s*from \.+\w[\w.]*(\._\w|\.? import .*\b_[a-z])")
    root = Path(impactsig.__file__).parent
    beside = re.compile(r"^\s*from \.\w+ import")  # a name of a module of the same package
    wrong = [
        f"{path.relative_to(root)}: {line.strip()}"
        for path in sorted(root.rglob("*.py"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if foreign.match(line) and not beside.match(line)
    ]
    assert wrong == []
    assert foreign.match("    from ..detect._files import opened")  # as some did
    assert foreign.match("from ..simulation.run import CHUNK, _engine")
