"""`impactsig sweep SCENE` and `impactsig plot DIR`."""

from __future__ import annotations

import argparse
import logging

import numpy as np
import pytest

from impactsig import lyapunov_spectrum, open_study, orbit_period, scenes, simulate
from impactsig.cli import _observables
from impactsig.cli import _sweeping as options
from impactsig.cli._observables import ENDS, OBSERVABLES, Observable, Observing
from impactsig.simulation.basis.events import STATUS
from tests.command import output_before_error, run

pytest.importorskip("zarr")
BRIEF = ["--periods=40", "--transient=20"]


@pytest.fixture(scope="module")
def chart(tmp_path_factory):
    """A study over two parameters."""
    folder = tmp_path_factory.mktemp("sweep") / "chart"
    words = ["--over", "frequency=20:24:0.5", "--over", "amplitude=0.1,0.2,0.4", *BRIEF]
    assert run("sweep", "karpodinis", *words, "--workers=1", "--out", folder) == 0
    return folder


def test_every_cell_is_what_simulate_gives(tmp_path, capsys):
    names = ["impacts_per_period", "mean_approach_velocity", "greatest_approach_velocity"]
    names += ["energy_per_period", "sticking_share", "period_impacts", "period_periods"]
    names += ["exponent", "status"]
    words = ["--over", "frequency=20.1,21,22.1", "--amplitude=0.3", *BRIEF, "--workers=1"]
    folder = tmp_path / "study"
    assert run("sweep", "karpodinis", *words, "--observe", *names, "-o", folder) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("karpodinis: 3 cells (3 frequency); impacts_per_period, mean_")
    assert captured.out.endswith(f"see it by: impactsig plot {folder}\n")
    assert captured.err == ""
    study = open_study(folder)
    for place, frequency in enumerate([20.1, 21.0, 22.1]):
        motion = simulate(scenes.karpodinis(frequency, amplitude=0.3), periods=40, transient=20)
        speed = motion.impacts.approach_velocity
        period = orbit_period(motion, tolerance=1e-6)
        grown = lyapunov_spectrum(
            scenes.karpodinis(frequency, amplitude=0.3), periods=40, initial=motion.final[:2]
        ).exponents
        wanted = {
            "impacts_per_period": len(motion.impacts) / 40,
            "mean_approach_velocity": speed.mean(),
            "greatest_approach_velocity": speed.max(),
            "energy_per_period": motion.energy_lost / 40,
            "sticking_share": 0.0,
            "period_impacts": period.impacts if period else np.nan,
            "period_periods": period.periods if period else np.nan,
            "exponent": grown[0],
            "status": 0.0,
        }
        for name, value in wanted.items():
            np.testing.assert_allclose(study[name][place], value, rtol=1e-12)
    assert (study["period_impacts"][-1], study["period_periods"][-1]) == (1, 1)
    assert study.attributes["frequency"] == {"units": "Hz"}


def test_sticking_and_ends(monkeypatch):
    """The hard stop of Okolewski's sticks once in four periods at eta = 3 [Okolewski2021]."""
    cell = Observing(
        scenes.okolewski, {"restitution": 0.6}, {"periods": 400, "transient": 200},
        ("sticking_share", "status"),
    )  # fmt: skip
    motion = simulate(scenes.okolewski(3, 0.6), periods=400, transient=200)
    held = sum(end - begin for begin, end in motion.sticks)
    assert cell(eta=np.array([3.0])) == {
        "sticking_share": pytest.approx(held / motion.duration), "status": 0,
    }  # fmt: skip
    assert held > 0
    assert set(ENDS) == {end for end in STATUS if end}
    from impactsig.simulation import run as _run

    monkeypatch.setattr(_run, "LEGS_PER_PERIOD", 0)
    cell = Observing(scenes.karpodinis, {}, {"periods": 300_000}, ("status",))
    assert ENDS[int(cell(frequency=np.array([22.1]))["status"][0])] == "work limit"


@pytest.mark.parametrize(
    ("scene", "fixed", "cells"),
    [
        (scenes.karpodinis, {}, {"frequency": [20.1, 22.1, 30.0], "amplitude": [0.3, 0.2, 0.01]}),
        (scenes.okolewski, {"restitution": 0.6}, {"eta": [2.0, 3.0, 3.7]}),
        (
            scenes.begley_virgin,
            {"sigma": 1.5},
            {"gamma": [0.5, 0.9, 1.4], "friction": [0.1, 0.2, 0.8]},
        ),
    ],
)
def test_cells_moved_together_have_the_bits_of_single_ones(scene, fixed, cells, monkeypatch):
    cell = Observing(scene, fixed, {"periods": 12, "transient": 5}, tuple(OBSERVABLES))
    cells = {name: np.array(values) for name, values in cells.items()}
    assert cell._batch(cells) is not None
    together = cell(**cells)
    monkeypatch.setattr(_observables, "KEPT", 24)  # two cells at a time
    parts = cell(**cells)
    monkeypatch.setattr(Observing, "_batch", lambda *given: None)
    for name, alone in cell(**cells).items():
        np.testing.assert_array_equal(together[name], alone)
        np.testing.assert_array_equal(parts[name], alone)
    assert together["impacts_per_period"].any()


def test_nothing_is_kept_that_nobody_asked_for(monkeypatch):
    seen = []
    monkeypatch.setitem(
        OBSERVABLES, "events", Observable("is told", lambda one: seen.append(one.motion) or 0.0)
    )
    Observing(scenes.karpodinis, {}, {"periods": 10}, ("events",))(frequency=np.array([22.1]))
    assert seen[0].impacts is None


def test_the_same_command_goes_on(chart, capsys):
    study = open_study(chart)
    assert study.shape == (9, 3)
    before = study["impacts_per_period"]
    (chart / "done" / "1.json").unlink()
    assert not open_study(chart).complete
    words = ["--over", "frequency=20:24:0.5", "--over", "amplitude=0.1,0.2,0.4", *BRIEF]
    assert run("sweep", "karpodinis", *words, "--workers=2", "--out", chart) == 0
    np.testing.assert_array_equal(open_study(chart)["impacts_per_period"], before)
    assert run("sweep", "karpodinis", *words, "--restitution=0.3", "--out", chart) == 1
    told = capsys.readouterr().err
    assert "this very study; in it differ: restitution (none there, 0.3 here). Give" in told
    assert run("sweep", "karpodinis", *words[:-2], "--periods=41", "--out", chart) == 1
    told = capsys.readouterr().err
    assert "in it differ: periods (40.0 there, 41.0 here); transient (20.0 there, 0.0 here)" in told


def test_a_cluster_that_is_not_there(tmp_path, monkeypatch, capsys):
    pytest.importorskip("distributed")
    from impactsig.studies.executors import cluster as _cluster

    monkeypatch.setattr(_cluster, "PATIENCE", "0.5s")
    words = ["--over", "frequency=20,21", *BRIEF, "--cluster=tcp://127.0.0.1:9", "-o", tmp_path]
    assert run("sweep", "karpodinis", *words) == 1
    told = capsys.readouterr().err
    assert told.startswith("error: client: got tcp://127.0.0.1:9; required: the address of a dask")
    assert told.count("\n") == 1


@pytest.mark.slow
def test_a_cluster_gives_the_same(chart, tmp_path, capsys):
    distributed = pytest.importorskip("distributed")
    words = ["--over", "frequency=20:24:0.5", "--over", "amplitude=0.1,0.2,0.4", *BRIEF]
    with distributed.LocalCluster(
        n_workers=1, processes=False, dashboard_address=None, silence_logs=logging.CRITICAL + 1
    ) as cluster:
        place = ["--cluster", cluster.scheduler_address, "--tile=9", "-o", tmp_path / "study"]
        assert run("sweep", "karpodinis", *words, *place) == 0
    found, wanted = open_study(tmp_path / "study"), open_study(chart)
    for name in wanted.observables:
        assert found[name].tobytes() == wanted[name].tobytes()


def test_ctrl_c_says_that_the_study_is_kept(tmp_path, monkeypatch, capsys):
    from impactsig.studies import sweeping

    def stopped(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(sweeping, "sweep", stopped)
    assert run("sweep", "karpodinis", "--over", "frequency=20,21", *BRIEF, "-o", tmp_path) == 130
    assert "the same command goes on" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "name", "values"),
    [
        ("frequency=20:24:0.01", "frequency", [round(20 + n / 100, 2) for n in range(401)]),
        ("eta=1:0:-0.25", "eta", [1, 0.75, 0.5, 0.25, 0]),
        ("a=0:1:0.3", "a", [0, 0.3, 0.6, 0.9]),
        ("a=-1:1:1", "a", [-1, 0, 1]),
        ("stop-stiffness=1e3,2e5", "stop_stiffness", [1e3, 2e5]),
        ("a=5:5:1", "a", [5]),
        ("a=0.1:0.3:0.1", "a", [0.1, 0.2, 0.3]),
    ],
)
def test_ranges_mean_what_stands_there(text, name, values):
    assert options._range(text) == (name, values)


@pytest.mark.parametrize(
    "text",
    ["", "a", "a=", "=1", "a=1:2", "a=1:2:0", "a=2:1:1", "a=1:2:x", "a=x", "a=1,,2", "a=nan",
     "a=1:inf:1", "a=1e400", "a=0:1:1e-9", "a=1/0", "a=1:2:3:4"],
)  # fmt: skip
def test_ranges_that_are_none(text):
    with pytest.raises(argparse.ArgumentTypeError):
        options._range(text)


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["karpodinis"], 2, ["--over"]),
        (["rig", "--over", "a=1"], 2, ["SCENE"]),
        (["karpodinis", "--over", "frequency=20:24"], 2, ["--over", "NAME=from:to:step"]),
        (["karpodinis", "--over", "frequency=a,b"], 2, ["--over", "of numbers"]),
        (["karpodinis", "--over", "speed=1,2"], 1, ["over", "speed", "frequency, damping_ratio"]),
        (["okolewski", "--over", "stop=1,2"], 1, ["over", "stop", "eta, restitution"]),
        (["karpodinis", "--over", "frequency=1", "--over", "frequency=2"], 1, ["over", "once"]),
        (["karpodinis", "--over", "frequency=20", "--frequency=21"], 1, ["frequency", "--over"]),
        (["okolewski", "--over", "eta=2:4:1"], 1, ["restitution", "--restitution or --over"]),
        (["karpodinis", "--over", "frequency=20", "--restitution=2"], 1, ["restitution"]),
        (["karpodinis", "--over", "restitution=2,3"], 1, ["restitution"]),
        (["karpodinis", "--over", "frequency=20", "--periods=0"], 1, ["periods"]),
        (["karpodinis", "--over", "frequency=20", "--observe", "colour"], 2, ["--observe"]),
        (["karpodinis", "--over", "frequency=20", "--workers=0"], 2, ["--workers"]),
        (
            ["karpodinis", "--over", "frequency=20", "--cluster=tcp://h:1", "--workers=2"],
            1,
            ["workers", "cluster"],
        ),
    ],
)
def test_every_failure_is_one_line(words, code, told, tmp_path, capsys):
    assert run("sweep", *words, "--out", tmp_path / "study") == code
    assert output_before_error(capsys, *told) == ""
    assert list(tmp_path.iterdir()) == []


def test_help_tells_what_can_be_observed(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "3000")
    assert run("sweep", "karpodinis", "--help") == 0
    out = capsys.readouterr().out
    for name, one in OBSERVABLES.items():
        assert f"{name}: {one.description}" in out
    assert "Forcing frequency [Hz]" in out


@pytest.mark.parametrize(
    ("words", "name", "magic"),
    [
        ([], "study.png", b"\x89PNG"),
        (["-o", "a.svg"], "a.svg", b"<?xml"),
        (["--at", "amplitude=0.2", "--observe", "status", "-o", "a.pdf"], "a.pdf", b"%PDF"),
    ],
)
def test_the_figure_is_written(words, name, magic, chart, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run("plot", chart, *words) == 0
    path = (chart if name == "study.png" else tmp_path) / name
    assert path.read_bytes().startswith(magic)
    assert capsys.readouterr().out.startswith("27 cells (9 frequency x 3 amplitude); impacts_per")


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["nowhere"], 1, "holds no study"),
        (["CHART", "--observe", "colour"], 1, "colour"),
        (["CHART", "--at", "speed=1"], 1, "frequency, amplitude"),
        (["CHART", "--at", "speed"], 2, "NAME=RANGE"),
        (["CHART", "-o", "a.gif"], 1, ".png or .pdf or .svg"),
    ],
)
def test_what_cannot_be_drawn(words, code, told, chart, capsys):
    assert run("plot", *(chart if word == "CHART" else word for word in words)) == code
    output_before_error(capsys, told)
