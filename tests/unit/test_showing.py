"""How results show themselves: one short line, and in a notebook a picture or a table."""

from __future__ import annotations

import base64
import contextlib
import io
import re
from dataclasses import dataclass

import numpy as np
import pytest

import impactsig as im
from impactsig._showing import Shown
from tests.unit.test_examples import ROOT, example

RESULTS = {
    **{f"results.{name}": getattr(im.results, name) for name in im.results.__all__},
    **{name: getattr(im, name) for name in ("Experiment", "Impacts", "Recording")},
}
LONGEST = 420


def look(result) -> tuple[str, str]:
    """The line and the page of a result, whatever is wrong with any of them."""
    line, page = repr(result), result._repr_html_()
    assert line.startswith(type(result).__name__)
    assert len(line) <= LONGEST
    assert "\n" not in line
    assert not re.search(r"\barray\(\[", line)
    if "<img" in page:
        data = re.search(r'src="data:image/png;base64,([^"]+)"', page)
        assert data is not None
        assert base64.b64decode(data[1]).startswith(b"\x89PNG")
    return line, page


def test_every_result_shows_itself():
    assert len(RESULTS) > 60
    assert [name for name, kind in RESULTS.items() if not hasattr(kind, "_repr_html_")] == []


def test_a_period_is_a_line():
    found = im.identify_period(im.Impacts.from_times(0.05 * np.arange(60)), 0.05)
    line, page = look(found)
    assert line == "Periodicity(period(1,1): 1 impact per forcing period)"
    assert "<th>jitter</th>" in page


def test_what_is_printed_is_what_describe_says():
    told = [kind for kind in RESULTS.values() if hasattr(kind, "describe")]
    assert len(told) > 20
    assert {kind.__str__ for kind in told} == {Shown.__str__}
    found = im.ordinal_patterns([4, 7, 9, 10, 6, 11, 3], 2)
    assert str(found) == found.describe()
    assert "\n" not in repr(found)


def test_a_result_that_is_drawn_has_a_picture():
    _, page = look(im.interval_histogram([1.0, 1.1, 1.9], bins=2))
    assert '<img alt="Figure of this IntervalHistogram"' in page


def test_what_is_still_to_be_moved_says_over_what():
    batch = im.scenes.karpodinis(np.array([[20.0], [22.5]]), restitution=np.array([0.2, 0.4, 0.6]))
    _, page = look(batch)
    assert "<tr><th>shape</th><td>2 x 3</td></tr>" in page
    assert "<td>20 to 22.5</td>" in page


def test_several_motions_are_listed():
    motions = im.simulate_many([im.scenes.karpodinis(22.1)] * 2, periods=3, transient=3, workers=1)
    _, page = look(motions)
    assert page.count("<td>Motion(") == 2


def test_a_legend_wider_than_the_axes_is_not_cut():
    """The picture grows with what is drawn beside the axes."""

    class Wide(Shown):
        def __init__(self, words):
            self.words = words

        def plot(self, ax=None):
            ax.plot([0, 1], label=self.words)
            ax.figure.legend(loc="outside upper left")
            ax.set_ylabel(self.words)

    heights = []
    for words in ("short", "long " * 30):
        data = re.search(r'base64,([^"]+)"', look(Wide(words))[1])[1]
        heights.append(int.from_bytes(base64.b64decode(data)[20:24], "big"))
    assert heights[1] > 2 * heights[0]


def test_what_is_still_to_be_read_says_in_how_many_blocks():
    _, page = look(im.read_blocks(ROOT / "data_samples/loadcell_periodic_22.1Hz.wav", seconds=3.0))
    assert "<td>4, read when asked for</td>" in page


def test_impacts_have_a_picture_and_a_table():
    _, page = look(im.Impacts([0.1, 0.2]))
    assert '<img alt="Figure of this Impacts"' in page
    assert "<td>" in page


def test_a_result_that_cannot_be_drawn_has_a_table():
    @dataclass(frozen=True)
    class Undrawn(Shown):
        values: np.ndarray
        share: float

        def plot(self, ax=None):
            raise im.InvalidInput("values", self.values, "values that can be drawn")

    line, page = look(Undrawn(np.zeros((3, 2)), 0.25))
    assert line == "Undrawn(values=array of 3 x 2, share=0.25)"
    assert "<img" not in page
    assert "<td>array of 3 x 2</td>" in page


def test_what_a_file_says_is_no_markup():
    class Named(Shown):
        def describe(self):
            return "<b>" + "x" * 1000

    line, page = look(Named())
    assert line.endswith("...)")
    assert "<b>" not in page


@pytest.mark.slow
@pytest.mark.parametrize("name", RESULTS)
def test_the_result_of_its_example(name, monkeypatch):
    """Each class by the object that the example in its docstring makes."""
    monkeypatch.chdir(ROOT)
    names: dict = {}
    with contextlib.redirect_stdout(io.StringIO()):
        for one in example(name).examples:
            exec(compile(one.source, name, "single"), names)
    made = [value for value in names.values() if isinstance(value, RESULTS[name])]
    inner = [getattr(value, key) for value in names.values() for key in vars_of(value)]
    for value in [*inner, *[one for group in inner if isinstance(group, tuple) for one in group]]:
        if type(value) is RESULTS[name]:
            made.append(value)
    assert made, f"the example of {name} makes none"
    look(made[0])


def vars_of(value) -> list[str]:
    module = type(value).__module__
    return list(vars(value)) if module.startswith("impactsig.") else []
