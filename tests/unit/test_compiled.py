"""Kernels are compiled anew when a source that they are made of has changed."""

from __future__ import annotations

import os
import subprocess
import sys

from impactsig import _compiled

INNER = """
from impactsig._compiled import njit

@njit()
def inner(x):
    return {factor} * x
"""
OUTER = """
from impactsig._compiled import njit
from .{folder}inner import inner

@njit()
def outer(x):
    return inner(x) + 1
"""


def test_a_kernel_does_what_another_file_says_now(tmp_path):
    package = tmp_path / "kernels"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "outer.py").write_text(OUTER.format(folder=""))
    told = []
    for factor in (2, 3):
        (package / "inner.py").write_text(INNER.format(factor=factor))
        done = subprocess.run(
            [sys.executable, "-c", "from kernels.outer import outer; print(outer(5))"],
            env=os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{os.pathsep.join(sys.path)}"},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        told.append(int(done.stdout))
    assert told == [11, 16]


def test_state_is_of_what_is_imported_and_of_nothing_else(tmp_path):
    folder = tmp_path / "deep"
    folder.mkdir()
    (tmp_path / "outer.py").write_text(OUTER.format(folder="deep."))
    (folder / "inner.py").write_text("from .. import (\n    a,\n    names,\n)\n")
    (tmp_path / "names.py").write_text("A = 1\n")
    (tmp_path / "other.py").write_text("B = 1\n")

    def now():
        for known in (_compiled.state, _compiled._source, _compiled._imported):
            known.cache_clear()
        return _compiled.state(tmp_path / "outer.py")

    first = now()
    (tmp_path / "other.py").write_text("B = 2\n")
    assert now() == first
    (tmp_path / "names.py").write_text("A = 2\n")
    assert now() != first
