"""A function that shares its name with a package: the name is the function's."""

from __future__ import annotations

import inspect
import pickle
import pydoc
import subprocess
import sys

import pytest

import impactsig

FIRST = [
    "import impactsig",
    "import impactsig.{0}",
    "import impactsig.{0}._rest_of_the_package",
    "from impactsig.{0} import {0}",
    "from impactsig import {0}",
    "import impactsig; impactsig.measure, impactsig.OGY",
    "import impactsig.{0} as found; assert inspect.isfunction(found)",
]
INSIDE = {"simulate": "measuring"}


@pytest.mark.parametrize("name", ["simulate"])
def test_a_function_is_found_by_its_name_whatever_was_imported_first(name):
    lines = ["import inspect, sys"]
    for first in FIRST:
        first = first.format(name).replace("_rest_of_the_package", INSIDE[name])
        lines += [
            "[sys.modules.pop(one) for one in list(sys.modules) if one.startswith('impactsig')]",
            first,
            "import impactsig",
            f"assert inspect.isfunction(impactsig.{name}), {first!r}",
            f"assert inspect.ismodule(sys.modules['impactsig.{name}']), {first!r}",
        ]
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True)


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [("simulate", "system", "path")],
)
def test_help_shows_the_function(name, first, last):
    function = getattr(impactsig, name)
    parameters = list(inspect.signature(function).parameters)
    assert (parameters[0], parameters[-1]) == (first, last)
    shown = pydoc.render_doc(function, renderer=pydoc.plaintext)
    assert f"{name}({first}: " in shown
    assert "Parameters\n" in shown
    assert "PACKAGE CONTENTS" not in shown
    assert pickle.loads(pickle.dumps(function)) is function


def test_what_is_assigned_to_a_name_stays(monkeypatch):
    monkeypatch.setattr(impactsig, "simulate", "another")
    assert impactsig.simulate == "another"
