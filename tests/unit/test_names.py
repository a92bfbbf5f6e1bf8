"""What names mean: of functions, of packages, of parameters that several functions have."""

from __future__ import annotations

import inspect
import pickle
import pydoc
import re
from pathlib import Path

import pytest

import impactsig


def test_no_function_shares_its_name_with_a_package_or_module_beside_it():
    beside = {path.stem for path in Path(impactsig.__file__).parent.iterdir()}
    shared = beside.intersection(impactsig.__all__)
    assert {name for name in shared if not inspect.ismodule(getattr(impactsig, name))} == set()


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


def _public():
    """Every public callable: functions, classes and the public methods of these."""
    modules = ("results", "scenes", "flows")
    places = {"": impactsig, **{f"{name}.": getattr(impactsig, name) for name in modules}}
    for prefix, place in places.items():
        for name in getattr(place, "__all__", vars(place)):
            thing = getattr(place, name)
            if inspect.ismodule(thing) or not callable(thing) or name.startswith("_"):
                continue
            yield prefix + name, thing
            if inspect.isclass(thing):
                for method, one in inspect.getmembers(thing, callable):
                    if not method.startswith("_"):
                        yield f"{prefix}{name}.{method}", one


def _parameters():
    for path, thing in _public():
        try:
            signature = inspect.signature(thing)
        except ValueError:  # what is built in
            continue
        for one in signature.parameters.values():
            yield path, one, " ".join(_entry(thing, one.name).split())


def _entry(thing, name):
    """What the docstring says of a parameter, or of several named together."""
    entry = re.search(
        rf"^(?:[\w, ]+, )?{name}(?:, [\w, ]+)? : .*\n(?:    .*\n|\n)+",
        (inspect.getdoc(thing) or "") + "\n",
        re.MULTILINE,
    )
    return entry.group(0) if entry else ""


SAME = {
    "seed": "The same seed gives the same result; a Generator is advanced.",
    "workers": "by default the number of cores. The result does not depend on it.",
    "progress": "Whether to show a progress bar; by default only in a terminal or notebook.",
}


def test_seed_workers_and_progress_mean_and_default_to_the_same_everywhere():
    seen = set()
    for path, one, text in _parameters():
        if one.name not in SAME:
            continue
        seen.add(one.name)
        assert one.default is None, path
        if (path, one.name) != ("sweep", "seed"):  # which makes a seed of every cell
            assert SAME[one.name] in text, (path, one.name, text)
    assert seen == set(SAME)


def test_every_frequency_says_its_unit_and_forcing_is_given_by_its_period():
    seen = set()
    for path, one, text in _parameters():
        assert "forcing_frequency" not in one.name, path
        if "frequency" in one.name:
            seen.add(path)
            assert "angular" in one.name or "[Hz" in text, (path, one.name, text)
    assert {"Force", "BaseMotion", "scenes.karpodinis", "Cantilever.tuned"} <= seen
