"""Every public function has an example that runs, and says what it returns and what is related."""

from __future__ import annotations

import doctest
import inspect
import re
import warnings
from pathlib import Path
from types import ModuleType

import pytest

import impactsig

ROOT = Path(__file__).resolve().parents[2]


def public() -> dict[str, object]:
    """Everything callable in `impactsig` and in its public modules, by its name there."""
    found: dict[str, object] = {}
    for name in impactsig.__all__:
        value = getattr(impactsig, name)
        if isinstance(value, ModuleType):
            found |= {f"{name}.{inner}": getattr(value, inner) for inner in value.__all__}
        elif callable(value):
            found[name] = value
    return found


def section(name: str, title: str) -> str:
    """The text of one section of a docstring; empty where there is none."""
    doc = inspect.cleandoc(public()[name].__doc__ or "")
    match = re.search(rf"^{title}\n-+\n(.*?)(?=\n\n[A-Z][\w ]*\n---|\Z)", doc, re.S | re.M)
    return match[1] if match else ""


def example(name: str) -> doctest.DocTest:
    parser = doctest.DocTestParser()
    return parser.get_doctest(section(name, "Examples"), {}, name, None, 0)


def test_every_public_function_has_an_example_and_what_to_see_also():
    names = public()
    assert len(names) > 200
    assert [name for name in names if not example(name).examples] == []
    assert [name for name in names if not section(name, "See Also")] == []


def test_every_public_function_says_what_it_returns():
    """Figures return the Axes, as their module says; a class returns itself."""
    without = [
        name
        for name, value in public().items()
        if not inspect.isclass(value) and not name.startswith("plot.")
        if not section(name, "(?:Returns|Yields)")
    ]
    assert without == []


def members() -> dict[str, object]:
    """Public methods and properties of what is public and of results, by their names there."""
    classes = public()
    classes |= {name: getattr(impactsig.results, name) for name in impactsig.results.__all__}
    found: dict[str, object] = {}
    for name, value in classes.items():
        for inner, member in vars(value).items() if inspect.isclass(value) else ():
            kind = getattr(member, "fget", None) or getattr(member, "func", None)
            function = kind or getattr(member, "__func__", member)
            if inspect.isfunction(function) and not inner.startswith("_"):
                found[f"{name}.{inner}"] = function
    return found


def test_every_array_has_its_shape_said():
    arrays = {
        name: value
        for name, value in (public() | members()).items()
        if inspect.isfunction(value) and "ndarray" in str(value.__annotations__.get("return"))
    }
    assert len(arrays) > 80
    without = [name for name, value in arrays.items() if "shape" not in (value.__doc__ or "")]
    assert without == []


def test_no_example_is_skipped():
    skipped = [
        name
        for name in public()
        if any(one.options.get(doctest.SKIP) for one in example(name).examples)
    ]
    assert skipped == []


def test_what_to_see_also_is_there_and_is_something_else():
    for name in public():
        for line in section(name, "See Also").splitlines():
            for related in line.split(":")[0].replace(",", " ").split():
                value = impactsig
                for part in related.removeprefix("impactsig.").split("."):
                    value = getattr(value, part)
                assert value is not public()[name], (name, related)


@pytest.mark.slow
@pytest.mark.parametrize("name", public())
def test_the_example_runs_as_printed(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    with warnings.catch_warnings():
        failed, tried = runner.run(example(name), out=said.append)
    assert tried > 0
    assert not failed, "".join(said)
