"""`impactsig simulate SCENE`: a scene's parameters are options; a table, words, a figure."""

from __future__ import annotations

import inspect
from typing import Literal

import numpy as np
import pytest

from impactsig import Impacts, Oscillator, scenes, simulate
from impactsig.cli import _simulating as options
from impactsig.cli._options import with_negative_numbers
from tests.command import output_before_error, run

SCENES = [
    "karpodinis",
    "karpodinis_control",
    "okolewski",
    "tian",
    "begley_virgin",
    "van_der_pol_duffing",
    "cantilever",
]


@pytest.mark.parametrize(
    ("words", "scene"),
    [
        (["karpodinis"], scenes.karpodinis()),
        (
            ["karpodinis", "--frequency=20.1", "--damping-ratio", "0.05"],
            scenes.karpodinis(20.1, damping_ratio=0.05),
        ),
        (["okolewski", "--eta=3", "--restitution=0.6"], scenes.okolewski(3, 0.6)),
        (
            ["okolewski", "--eta=3", "--restitution=0.6", "--stop=soft", "--stop-stiffness=2e3"],
            scenes.okolewski(3, 0.6, "soft", stop_stiffness=2e3),
        ),
        (["tian", "--omega=0.8", "--amplitude=0.8"], scenes.tian(0.8, 0.8)),
        (
            [
                "cantilever",
                "--length=0.2",
                "--width=0.025",
                "--thickness=1e-3",
                "--modulus=210e9",
                "--density=7850",
                "--stop=1e-3",
                "--frequency=21",
                "--amplitude=2e-4",
                "--natural-frequency=22.2",
            ],
            scenes.cantilever(
                0.2, 0.025, 1e-3, 210e9, 7850, 1e-3, 21, 2e-4, natural_frequency=22.2
            ),
        ),
        (
            ["begley_virgin", "--gamma=0.88", "--sigma=1.6", "--friction=0.06"],
            scenes.begley_virgin(0.88, 1.6, 0.06),
        ),
        (
            ["begley_virgin", "--gamma", "0.88", "--sigma", "-1.86", "175e-2", "--friction", "0"],
            scenes.begley_virgin(0.88, (-1.86, 1.75), 0),
        ),
    ],
)
def test_the_table_is_that_of_the_function(words, scene, tmp_path, capsys):
    path = tmp_path / "impacts.csv"
    assert run("simulate", *words, "--periods=60", "-o", path) == 0
    captured = capsys.readouterr()
    wanted = simulate(scene, periods=60).impacts
    found = Impacts.read_csv(path)
    np.testing.assert_array_equal(found.time, wanted.time)
    np.testing.assert_array_equal(found.approach_velocity, wanted.approach_velocity)
    assert (found.start, found.duration) == (wanted.start, wanted.duration)
    assert found.source == scene.name
    assert captured.out == ""
    assert captured.err.startswith(f"{scene.name}: {len(wanted)} impacts in 60 forcing periods")
    assert captured.err.count("\n") == 1
    assert captured.err.endswith("status: complete.\n")


def test_without_a_file_the_table_is_the_output(tmp_path, capsys):
    path = tmp_path / "impacts.csv"
    assert run("simulate", "karpodinis", "--periods=20", "-o", path) == 0
    capsys.readouterr()
    assert run("simulate", "karpodinis", "--periods=20") == 0
    assert capsys.readouterr().out == path.read_text()


def test_parquet(tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "impacts.parquet"
    assert run("simulate", "karpodinis", "--periods=20", "-o", path) == 0
    assert len(Impacts.read_parquet(path)) == len(simulate(scenes.karpodinis(), periods=20).impacts)


def test_the_run_is_as_told(tmp_path):
    path = tmp_path / "impacts.csv"
    words = ["--duration=2", "--transient", "0.5", "--initial", "-0.5", "-2e-1", "--phase", "-1"]
    assert run("simulate", "karpodinis", *words, "-o", path) == 0
    wanted = simulate(
        scenes.karpodinis(), duration=2, transient=0.5, initial=(-0.5, -0.2), phase=-1
    ).impacts
    np.testing.assert_array_equal(Impacts.read_csv(path).time, wanted.time)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["karpodinis", "--transient=200"], "1 per period; no sticks; period(1,1): 1 impact per"),
        (["karpodinis", "--frequency=20.1"], "no sticks; no period(m, n) identified; status"),
        (
            ["okolewski", "--eta=3", "--restitution=0.6", "--stop=soft", "--transient=200"],
            "2.25 per period; no sticks; period(9,4): 9 impacts in 4 forcing periods",
        ),
        (
            ["okolewski", "--eta=3", "--restitution=0.6", "--transient=200", "--periods=400"],
            "per period; 100 sticks; no period(m, n) identified",
        ),
        (["karpodinis", "--amplitude=0.001"], "no impacts in 1000 forcing periods"),
        (["karpodinis", "--periods=0.5"], "; period unknown: too few impacts"),
    ],
)
def test_the_words_say_what_moved(words, told, capsys):
    """The rates and periods are the papers'; the hard stop sticks once in four periods."""
    assert run("simulate", *words) == 0
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("ending", "magic"), [(".png", b"\x89PNG"), (".PDF", b"%PDF"), (".svg", b"<?xml")]
)
def test_the_figure_is_written(ending, magic, tmp_path, capsys):
    path = tmp_path / f"phase{ending}"
    assert run("simulate", "karpodinis", "--periods=60", "--figure", path) == 0
    assert path.read_bytes().startswith(magic)
    assert capsys.readouterr().out.startswith("# impactsig ")


def test_under_noise_it_is_one_path(tmp_path, capsys):
    path, figure = tmp_path / "impacts.csv", tmp_path / "path.png"
    words = ["van_der_pol_duffing", "--restitution=0.95", "--duration=60", "--transient=10"]
    words += ["--initial", "0.5", "1"]
    assert run("simulate", *words, "--seed=7", "-o", path, "--figure", figure) == 0
    told = capsys.readouterr().err
    wanted = simulate(
        scenes.van_der_pol_duffing(0.95), duration=60, transient=10, initial=(0.5, 1.0), seed=7
    )
    found = Impacts.read_csv(path)
    assert len(found) > 10
    np.testing.assert_array_equal(found.time, wanted.impacts.time)
    assert told.startswith(f"{wanted.system.name}: {len(found)} impacts in 59.9")  # whole looks
    assert "one path under noise" in told
    assert figure.read_bytes().startswith(b"\x89PNG")
    tables = []
    for more in ([], ["--seed=0"], ["--seed=1"]):
        assert run("simulate", *words, *more) == 0
        tables.append(capsys.readouterr().out)
    assert tables[0] == tables[1] != tables[2]


def test_the_table_can_be_compared_with_another(tmp_path, capsys):
    for name, frequency in (("a", 22.1), ("b", 20.1)):
        words = ["--frequency", frequency, "--transient=200", "-o", tmp_path / f"{name}.csv"]
        assert run("simulate", "karpodinis", *words) == 0
    words = ["--forcing-frequency=22.1"]
    assert run("compare", tmp_path / "a.csv", tmp_path / "b.csv", *words) == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("a.csv: 1000 impacts")
    assert "period(1,1)" in first
    assert second.startswith("b.csv: ")


# -- the scenes and their help ---------------------------------------------------------------


def test_help_lists_the_scenes(capsys):
    assert run("simulate", "--help") == 0
    out = capsys.readouterr().out
    for name in SCENES:
        assert name in out


@pytest.mark.parametrize("name", SCENES)
def test_help_tells_every_parameter_of_a_scene(name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "1000")
    assert run("simulate", name, "--help") == 0
    lines = capsys.readouterr().out.splitlines()
    for parameter in inspect.signature(getattr(scenes, name)).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD:
            continue
        option = f"--{parameter.name.replace('_', '-')} "
        (at,) = (k for k, line in enumerate(lines) if line.strip().startswith(option))
        line = lines[at] if "(" in lines[at] else lines[at] + lines[at + 1]  # long options wrap
        required = parameter.default is parameter.empty
        assert ("(required)" in line) is required
        assert ("(default: " in line) is not required
        assert len(line.split()) > 5  # in words, from the docstring


def test_a_new_scene_is_a_new_choice(monkeypatch, capsys):
    def seesaw(tilt: float, side: Literal["left", "right"] = "left") -> Oscillator:
        """A seesaw.

        Parameters
        ----------
        tilt : float
            How far, 100 % at most.
        side : {"left", "right"}
            Where.
        """
        return scenes.tian(tilt, 1.0 if side == "right" else 2.0)

    seesaw.__module__ = scenes.__name__
    seesaw.__annotations__ = {"tilt": float, "side": Literal["left", "right"]}
    monkeypatch.setattr(scenes, "seesaw", seesaw, raising=False)
    assert run("simulate", "seesaw", "--help") == 0
    assert "How far, 100 % at most. (required)" in capsys.readouterr().out
    assert run("simulate", "seesaw", "--tilt=0.8", "--side=right", "--periods=20") == 0
    assert capsys.readouterr().err.startswith("Tian's soft stop at omega = 0.8, A = 1: ")


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_is_a_choice(name):
    assert options._scenes()[name] is getattr(scenes, name)
    assert set(options._scenes()) == set(SCENES)


# -- errors ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["rig"], 2, ["SCENE", "'rig'", *SCENES]),
        ([], 2, ["SCENE"]),
        (["okolewski", "--eta=3"], 2, ["--restitution"]),
        (["okolewski", "--eta=3", "--restitution=1", "--stop=firm"], 2, ["hard", "soft"]),
        (["karpodinis", "--speed=3"], 2, ["--speed"]),
        (["karpodinis", "--periods=ten"], 2, ["--periods", "finite number"]),
        (["karpodinis", "--initial", "1"], 2, ["--initial", "2"]),
        (["karpodinis", "--periods=0"], 1, ["periods"]),
        (["karpodinis", "--periods=1", "--duration=1"], 1, ["periods, duration"]),
        (["karpodinis", "--initial", "2", "0"], 1, ["initial", "stop"]),
        (["karpodinis", "--restitution=2"], 1, ["restitution", "from 0 to 1"]),
        (["karpodinis", "--damping-ratio=-1"], 1, ["damping_ratio", "0 or greater"]),
        (
            ["begley_virgin", "--gamma=1", "--friction=0", "--sigma", "-1", "0", "1"],
            1,
            ["sigma", "a positive number, or two"],
        ),
        (["karpodinis", "-o", "a.txt"], 1, ["output", ".csv or .parquet"]),
        (["karpodinis", "--figure", "a.gif"], 1, ["figure", ".png or .pdf or .svg"]),
        (["karpodinis", "--periods=5", "-o", "no/such.csv"], 1, ["such.csv"]),
    ],
)
def test_every_failure_is_one_line(words, code, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run("simulate", *words) == code
    assert output_before_error(capsys, *told) == ""
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_ends_early_says_so(monkeypatch, capsys):
    from impactsig.simulation import run as _run

    monkeypatch.setattr(_run, "LEGS_PER_PERIOD", 0)
    monkeypatch.setattr(_run, "LEGS_AT_LEAST", 1000)
    assert run("simulate", "karpodinis", "--periods=3000") == 0
    assert "status: work limit" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "joined"),
    [
        ("--scale -2e3 f", "--scale=-2e3|f"),
        ("--start -.5 7", "--start| -.5|7"),
        ("--initial -1 -2e-3", "--initial| -1| -2e-3"),
        ("--initial 1 -2", "--initial|1| -2"),
        ("-o -1.csv", "-o|-1.csv"),
        ("--output -1.csv", "--output=-1.csv"),
    ],
)
def test_negative_numbers_are_values(words, joined):
    assert "|".join(with_negative_numbers(words.split())) == joined
