"""Figures of studies: curves, maps, and what they say of what is missing."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import ImpactsigWarning, InvalidInput, plot, sweep

pytest.importorskip("matplotlib").use("Agg")
TOLD = {
    "a": {"units": "Hz"},
    "value": {"long_name": "a product", "units": "m"},
    "flag": {"flag_values": [0, 1], "flag_meanings": "at_rest moving"},
}


@pytest.fixture(autouse=True)
def close_figures():
    yield
    from matplotlib import pyplot

    pyplot.close("all")


def test_one_parameter_is_a_curve():
    ax = sweep(lambda a: a * 2, {"a": [1, 2, 4]}, attributes=TOLD).plot()
    (line,) = ax.lines
    np.testing.assert_array_equal(line.get_xydata(), [[1, 2], [2, 4], [4, 8]])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("a [Hz]", "a product [m]")


def test_two_parameters_are_a_map_the_first_to_the_right():
    axes = {"a": [1, 2, 4], "b_rate": [1.0, 3.0]}
    study = sweep(lambda a, b_rate: a * b_rate, axes, attributes=TOLD)
    ax = plot.parameter_study(study)
    (mesh,) = ax.collections
    np.testing.assert_array_equal(mesh.get_array(), [[1, 2, 4], [3, 6, 12]])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("a [Hz]", "b rate")
    assert mesh.colorbar.ax.get_ylabel() == "a product [m]"


def test_parameters_are_held_at_the_nearest_value():
    axes = {"a": [1, 2, 4], "b": [1.0, 3.0], "c": [0.0, 5.0]}
    study = sweep(lambda a, b, c: a * b + c, axes)
    with pytest.raises(InvalidInput, match=r"^at: got .* all parameters but one or two"):
        study.plot()
    ax = study.plot(at={"c": 4.0})
    assert ax.get_title(loc="left") == "c = 5"
    np.testing.assert_array_equal(ax.collections[0].get_array(), study["value"][:, :, 1].T)
    ax = study.plot(at={"c": -1, "a": 2.9})
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), study["value"][1, :, 0])
    with pytest.raises(InvalidInput, match="at: got d; required: one of a, b, c"):
        study.plot(at={"d": 1})
    with pytest.raises(InvalidInput, match="all parameters but one or two"):
        study.plot(at={"a": 1, "b": 1, "c": 1})


def test_a_parameter_of_one_value_is_no_axis():
    ax = sweep(lambda a, b: a * b, {"a": [1, 2], "b": [3]}).plot()
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), [3, 6])
    assert ax.get_title(loc="left") == "b = 3"
    assert len(sweep(lambda a: a, {"a": [1]}).plot().lines) == 1


@pytest.mark.parametrize("kind", [float, np.int32, np.uint8])
def test_what_is_not_known_is_not_drawn(kind):
    with pytest.warns(ImpactsigWarning):
        study = sweep(lambda a: kind(4 // a), {"a": [0, 1, 2]})
    np.testing.assert_array_equal(study.plot().lines[0].get_ydata(), [np.nan, 4, 2])
    with pytest.warns(ImpactsigWarning):
        study = sweep(lambda a: 1 / 0, {"a": [0, 1]})
    assert "nothing has been computed" in study.plot().texts[0].get_text().replace("\n", " ")


def test_several_values_a_cell_are_points():
    study = sweep(lambda a: np.array([a, -a]), {"a": [1, 2, 3]})
    points = study.plot().lines[0].get_xydata()
    np.testing.assert_array_equal(points, [[1, 1], [1, -1], [2, 2], [2, -2], [3, 3], [3, -3]])
    study = sweep(lambda a, b: np.array([a, b]), {"a": [1, 2], "b": [1, 2]})
    with pytest.raises(InvalidInput, match="one number a cell"):
        study.plot()


def test_flags_are_written_in_words():
    study = sweep(lambda a, b: {"flag": a > b}, {"a": [1, 2], "b": [1, 2]}, attributes=TOLD)
    bar = study.plot().collections[0].colorbar
    assert [text.get_text() for text in bar.ax.get_yticklabels()] == ["at\nrest", "moving"]
    assert bar.mappable.get_clim() == (-0.5, 1.5)
    ax = study.plot("flag", at={"b": 1})
    assert [text.get_text() for text in ax.get_yticklabels()] == ["at\nrest", "moving"]


def test_one_of_several_has_to_be_named():
    study = sweep(lambda a: {"one": a, "two": a}, {"a": [1, 2]})
    with pytest.raises(InvalidInput, match="observable: got None; required: one of one, two"):
        study.plot()
    assert study.plot("two").get_ylabel() == "two"


def test_complex_observables_are_refused():
    study = sweep(lambda a: a * 1j, {"a": [1, 2]})
    with pytest.raises(InvalidInput, match="real"):
        study.plot()


def test_cells_of_an_axis_of_one_value_are_seen():
    from impactsig.plot.axes import cell_edges

    np.testing.assert_allclose(cell_edges(np.array([1.0, 2.0, 4.0])), [0.5, 1.5, 3.0, 5.0])
    np.testing.assert_allclose(cell_edges(np.array([0.2])), [0.19, 0.21])
    np.testing.assert_allclose(cell_edges(np.array([0.0])), [-0.5, 0.5])
