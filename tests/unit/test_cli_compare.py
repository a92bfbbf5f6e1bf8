"""`impactsig compare`: recordings and tables in any pairing; words, and a figure if asked for."""

import re

import numpy as np
import pytest
import soundfile

from impactsig import Impacts
from impactsig.simulation.instruments.sensors import LoadCell
from impactsig.simulation.instruments.synthesis import synthesize
from tests.command import output_before_error, run

RATE = 50_000
TOUCH = 0.02 + 0.05 * np.arange(19)


@pytest.fixture
def truth():
    return Impacts.from_times(
        TOUCH, start=0.0, duration=1.0, peak=np.full(19, 0.5), contact_time=np.full(19, 4e-4)
    )


@pytest.fixture
def recording(truth, tmp_path):
    path = tmp_path / "rig.wav"
    soundfile.write(path, synthesize(truth, LoadCell(noise=1e-3), seed=0).samples, RATE)
    return path


@pytest.fixture
def table(truth, tmp_path):
    path = tmp_path / "model.csv"
    truth.to_csv(path)
    return path


def test_a_recording_against_a_table(recording, table, capsys):
    words = ("--sensor=force", "--forcing-frequency=20")
    assert run("compare", recording, table, *words) == 0
    rig, model, intervals, contact, *_ = capsys.readouterr().out.splitlines()
    assert rig.startswith("rig.wav: 19 impacts in 1 s, 19 per second")
    assert model.startswith("model.csv: 19 impacts in 1 s, 19 per second")
    for line in (rig, model):
        assert line.endswith("period(1,1): 1 impact per forcing period")
    assert intervals.startswith("intervals: mean 50 ms and 50 ms")
    measured, simulated = re.match(r"contact time: mean (\S+) ms and (\S+) ms", contact).groups()
    assert float(measured) == pytest.approx(0.4, rel=1e-3)
    assert simulated == "0.4"


def test_the_order_of_the_files_is_the_order_of_the_words(recording, table, capsys):
    assert run("compare", table, recording, "--sensor=force") == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("model.csv: ")
    assert second.startswith("rig.wav: ")
    assert "period" not in first


def test_options_reach_the_recordings(recording, table, capsys):
    assert run("compare", recording, table, "--sensor=force", "--start=0.5") == 0
    rig, model, *_ = capsys.readouterr().out.splitlines()
    assert rig.startswith("rig.wav: 9 impacts in 0.5 s")
    assert model.startswith("model.csv: 19 impacts in 1 s")


def test_parquet_and_tables_from_elsewhere(truth, tmp_path, capsys):
    pytest.importorskip("pyarrow")
    truth.to_parquet(tmp_path / "a.parquet")
    (tmp_path / "b.csv").write_text("time\n" + "\n".join(map(str, TOUCH)))
    assert run("compare", tmp_path / "a.parquet", tmp_path / "b.csv") == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("a.parquet: 19 impacts in 1 s")
    assert second.startswith("b.csv: 19 impacts in 0.9 s")


def test_a_csv_of_samples_is_a_recording(truth, table, tmp_path, capsys):
    made = synthesize(truth, LoadCell(noise=1e-3), seed=0)
    rows = (f"{t:.5f},{x:.6f}" for t, x in zip(made.time, made.samples, strict=True))
    (tmp_path / "rig.csv").write_text("time,force [N]\n" + "\n".join(rows))
    assert run("compare", tmp_path / "rig.csv", table) == 0
    assert capsys.readouterr().out.startswith("rig.csv: 19 impacts in 1 s")


def test_files_of_one_name_are_told_apart_by_their_folders(table, tmp_path, capsys):
    (tmp_path / "b").mkdir()
    other = tmp_path / "b" / table.name
    other.write_text(table.read_text())
    assert run("compare", table, other) == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith(f"{table}: ")
    assert second.startswith(f"{other}: ")


@pytest.mark.parametrize(
    ("ending", "magic"),
    [
        (".pdf", b"%PDF"),
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in ((".png", b"\x89PNG"), (".svg", b"<?xml"))
        ),
    ],
)
def test_the_figure_is_written(ending, magic, recording, table, tmp_path, capsys):
    path = tmp_path / f"both{ending}"
    assert run("compare", recording, table, "--sensor=force", "-o", path) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"figure: {path}"
    assert path.read_bytes().startswith(magic)


def test_empty_tables_are_told(tmp_path, capsys):
    for name in "ab":
        Impacts([]).to_csv(tmp_path / f"{name}.csv")
    assert run("compare", tmp_path / "a.csv", tmp_path / "b.csv", "--forcing-frequency=20") == 0
    out = capsys.readouterr().out
    assert out.count("0 impacts in 0 s; too few intervals") == 2


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("none.wav", "model.csv"), "none.wav"),
        (("none.csv", "model.csv"), "none.csv"),
        (("none.parquet", "model.csv"), "none.parquet"),
        (("broken.csv", "model.csv"), "broken.csv"),
        (("model.csv", "model.csv", "-o", "figure.xlsx"), ".png or .pdf or .svg"),
        (("model.csv", "model.csv", "-o", "no/such.png"), "such.png"),
    ],
)
def test_every_failure_is_one_line(words, told, table, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.csv").write_text("time\n0.1\nsoon\n")
    before = sorted(tmp_path.iterdir())
    assert run("compare", *words) == 1
    output_before_error(capsys, told)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("words", [["compare"], ["compare", "a.csv"], ["compare", *"abc"]])
def test_two_files_it_must_be(words, capsys):
    assert run(*words) == 2
    assert "see: impactsig" in capsys.readouterr().err
