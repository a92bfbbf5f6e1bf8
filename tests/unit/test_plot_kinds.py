"""Every figure is drawn of the results it is for, and of others it says what it wants."""

from __future__ import annotations

import inspect

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot

import impactsig
from impactsig import Impacts, InvalidInput, Recording, flows, plot, scenes, simulate

INTERVALS = 0.05 + 0.01 * np.random.default_rng(0).random(300)


def results():
    """A result of each street, and what is none."""
    motion = impactsig.simulate(scenes.karpodinis(22.1), periods=20)
    counted = impactsig.simulate(scenes.karpodinis(22.1), periods=20, keep="counts")
    train = Impacts.from_times(np.cumsum(INTERVALS))
    return {
        "motion": motion,
        "counts": counted,
        "section": impactsig.impact_map(motion),
        "spectrum": motion.power_spectrum(),
        "flow": simulate(flows.rossler(), duration=50.0),
        "path": simulate(scenes.van_der_pol_duffing(), duration=5.0, seed=0),
        "impacts": train,
        "intervals": INTERVALS,
        "histogram": impactsig.interval_histogram(train),
        "comparison": impactsig.compare(train, train),
        "recording": Recording(np.sin(np.arange(2000.0)), 1000.0),
        "study": impactsig.sweep(lambda a: a, {"a": [1.0, 2.0]}),
        "beam": impactsig.Cantilever(0.2, 0.025, 1e-3, 210e9, 7850),
        "oscillator": scenes.karpodinis(22.1),
        "none": None,
        "number": 3.0,
        "text": "a result",
        "list": [1, "two", None],
        "mapping": {"a": None},
    }


@pytest.fixture(scope="module")
def given():
    return results()


@pytest.mark.parametrize("name", plot.__all__)
def test_other_results_are_refused_by_name(name, given):
    paint = getattr(plot, name)
    argument = next(iter(inspect.signature(paint).parameters))
    more = {
        "pulse": (given["impacts"], 0),
        "interval_densities": ([1.0, 2.0],),
        "calibration_curve": ([True],),
    }.get(name, ())
    refused, named = 0, {argument, "intervals", "outcome"}
    for kind, result in given.items():
        try:
            paint(result, *more)
        except InvalidInput as error:
            refused += error.argument in named
        except Exception as error:
            raise AssertionError(f"{name} of {kind}") from error
        finally:
            pyplot.close("all")
    assert refused >= 10


@pytest.mark.parametrize("make", [impactsig.displacement_section, impactsig.impact_map])
def test_a_section_is_of_a_motion(make, given):
    for kind, result in given.items():
        if kind not in ("motion", "counts"):
            with pytest.raises(InvalidInput, match=r"a (Motion|forced motion)"):
                make(result)
    with pytest.raises(InvalidInput, match="threshold_crossings"):
        impactsig.impact_map(given["flow"], stop=0)


def test_it_is_said_what_draws_a_result_instead(given):
    with pytest.raises(InvalidInput, match=r"required: a Motion or .*plot\(\) draws a Section"):
        plot.phase_portrait(given["section"])


def test_a_study_that_is_no_chart_of_stability_is_drawn_by_another(given):
    with pytest.raises(InvalidInput, match="parameter_study"):
        plot.stability_chart(given["study"])


# -- flows -------------------------------------------------------------------------------------


def test_a_phase_portrait_of_a_flow_is_of_two_coordinates(given):
    course = given["flow"]
    for chosen, (across, up) in {None: "xy", ("z", "x"): "zx", (1, 2): "yz"}.items():
        ax = plot.phase_portrait(course, coordinates=chosen, start=10.0, stop=20.0)
        x, y = ax.lines[0].get_data()
        states = course.sample(np.linspace(10.0, 20.0, len(x)))
        np.testing.assert_array_equal(x, states[:, "xyz".index(across)])
        np.testing.assert_array_equal(y, states[:, "xyz".index(up)])
        assert (ax.get_xlabel(), ax.get_ylabel()) == (across, up)
    assert len(plot.phase_portrait(course).lines[0].get_xdata()) > 1000
    pyplot.close("all")


@pytest.mark.parametrize(
    ("kind", "options", "argument"),
    [
        ("flow", {"coordinates": ("x", "w")}, "coordinates"),
        ("flow", {"coordinates": ("x",)}, "coordinates"),
        ("flow", {"coordinates": 2}, "coordinates"),
        ("flow", {"start": 1e6}, "start, stop"),
        ("flow", {"stop": float("nan")}, "stop"),
        ("motion", {"coordinates": ("x", "y")}, "coordinates"),
    ],
)
def test_bad_options_of_a_portrait_are_named(given, kind, options, argument):
    with pytest.raises(InvalidInput) as caught:
        plot.phase_portrait(given[kind], **options)
    assert caught.value.argument == argument
