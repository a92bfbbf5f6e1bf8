"""Several sensors of one machine, and several stops, in the command and the report."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace

import numpy as np
import pytest
import soundfile

from impactsig import (
    Impacts,
    InvalidInput,
    LoadCell,
    Microphone,
    Recording,
    detect_impacts,
    detect_many,
    match_impacts,
    plot,
    synthesize,
)
from impactsig.cli._parser import parser
from impactsig.detect import files as _files
from impactsig.plot.axes import BLUE, GREY, ORANGE
from impactsig.report import analyse
from impactsig.report.analysing import channels
from impactsig.report.analysing.samples import seen
from impactsig.report.contents import parameters
from impactsig.report.interactive import numbers
from impactsig.report.reproduction import command, python_lines
from impactsig.report.tables import table
from tests.command import run

RATE = 50_000


def two_stops(count=24, seed=3):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.03, 0.06, count))
    return Impacts(
        time, start=0.0, duration=time[-1] + 0.05, stop_index=rng.integers(0, 2, count),
        peak=np.exp(rng.normal(0, 0.2, count)),
    )  # fmt: skip


def cells(truth):
    """A load cell at each stop, which feels little of the other."""
    felt = [np.where(truth.stop_index == own, 1.0, 0.15) * truth.peak for own in (0, 1)]
    return [
        synthesize(
            replace(truth, stop_index=None, peak=peak), LoadCell(noise=0.004), seed=own
        ).samples
        for own, peak in enumerate(felt)
    ]


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """A file of two load cells."""
    truth = two_stops()
    path = tmp_path_factory.mktemp("rig") / "rig.csv"
    left, right = cells(truth)
    rows = np.column_stack((np.arange(len(left)) / RATE, left, right))
    np.savetxt(
        path, rows, delimiter=",", header="time [s],left [N],right [N]", comments="", fmt="%.7g"
    )
    return path, truth


@pytest.fixture(scope="module")
def found(rig):
    return analyse(rig[0], channel=["left", "right"], stops=[0, 1])


def test_detect_makes_one_train_of_two_channels(rig, tmp_path):
    path, truth = rig
    out = tmp_path / "impacts.csv"
    options = ("--channel", "left", "--channel=right", "--stops", "0,1")
    assert run("detect", path, *options, "-o", out) == 0
    train = Impacts.read_csv(out)
    np.testing.assert_allclose(train.time, truth.time, atol=5e-5)
    np.testing.assert_array_equal(train.stop_index, truth.stop_index)
    direct = detect_impacts(path, channel=["left", "right"], stops=[0, 1])
    np.testing.assert_array_equal(train.time, direct.time)
    many = detect_many([path], channel=["left", "right"], stops=[0, 1], workers=1)
    np.testing.assert_array_equal(many.impacts[path].time, direct.time)


def test_stops_have_the_numbers_given(rig, capsys):
    path, truth = rig
    assert run("detect", path, "--channel=left", "--channel=right", "--stops=1,2") == 0
    lines = capsys.readouterr().out.splitlines()
    place = lines[1].split(",").index("stop_index")
    stops = [int(line.split(",")[place]) for line in lines[2:]]
    assert stops == (truth.stop_index + 1).tolist()


def test_the_report_shows_both_channels_and_colours_by_stop(found):
    assert [one.channels for one in found.overviews] == [("left",), ("right",)]
    held = json.loads(numbers(found, 3_000_000)[0])
    assert [one["name"] for one in held["panels"]] == ["left", "right"]
    assert held["impacts"]["colours"] == [["stop 0", BLUE], ["stop 1", ORANGE]]
    shown = table(found.impacts, 3)
    assert shown.heads[-2:] == ("stop", "flags")
    assert [row[-2] for row in shown.rows] == [str(one) for one in found.impacts.stop_index[:3]]
    rows = dict(parameters(found))["Recording"]
    said = dict(rows)
    assert said["channel 1 of 2"].startswith("left: force, unit N")
    assert "stop 1" in said["channel 2 of 2"]
    assert "µs after the first" in said["channel 2 of 2"]


def test_blocks_give_what_the_whole_gives(found, rig, monkeypatch):
    monkeypatch.setattr(_files, "WHOLE_BELOW", 1000)
    blockwise = analyse(rig[0], channel=["left", "right"], stops=[0, 1])
    np.testing.assert_array_equal(blockwise.impacts.time, found.impacts.time)
    np.testing.assert_array_equal(blockwise.impacts.stop_index, found.impacts.stop_index)
    for (i, a), (j, b) in zip(found.excerpts, blockwise.excerpts, strict=True):
        assert (i, a.channels, a.start) == (j, b.channels, pytest.approx(b.start))
        np.testing.assert_array_equal(a.samples, b.samples)


def test_an_impact_is_shown_by_the_sensor_of_its_stop(found):
    for index, excerpt in found.excerpts:
        stop = found.impacts.stop_index[index]
        assert excerpt.channels == (("left", "right")[stop],)
        assert excerpt.start < found.impacts.time[index] < excerpt.stop


def test_the_report_is_made_again_by_its_command_and_by_python(found):
    words = shlex.split(command(found))
    chosen = parser().parse_args(words[1:])
    assert chosen.channel == ["left", "right"]
    assert chosen.stops == [0, 1]
    scope = {}
    exec(python_lines(found), scope)
    np.testing.assert_array_equal(scope["impacts"].time, found.impacts.time)


def test_load_cell_and_microphone_of_their_own_rates_and_units(tmp_path):
    """Channels of different rates and lengths, as TDMS and HDF5 hold them."""
    h5py = pytest.importorskip("h5py")
    truth = replace(two_stops(30), stop_index=None)
    cell = synthesize(truth, LoadCell(noise=0.004), seed=1)
    sound = synthesize(truth, Microphone(distance=1.0, noise=0.01), rate=44_100, seed=2)
    path = tmp_path / "rig.h5"
    with h5py.File(path, "w") as file:
        for name, record, cut in (("cell", cell, 0), ("mic", sound, 3000)):
            data = file.create_dataset(name, data=record.samples[: len(record) - cut])
            data.attrs["sampling_rate"] = record.rate
    analysis = analyse(path, channel=["cell", "mic"], sensor=["force", "sound"], unit=["N", "Pa"])
    impacts = analysis.impacts
    assert analysis.rates == (50_000, 44_100)
    assert [one.unit for one in analysis.overviews] == ["N", "Pa"]
    np.testing.assert_allclose(impacts.time, truth.time, atol=5e-5)
    assert impacts.settings["delay"]["mic"] == pytest.approx(1 / 343, abs=3e-5)
    shift = analysis.overviews[1].start
    assert shift == pytest.approx(-1 / 343, abs=3e-5)  # drawn in the clock of the load cell
    text = " ".join(word for _, rows in parameters(analysis) for row in rows for word in row)
    assert "mic: sound, unit Pa, rate 44100 Hz" in text


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--channel=left", "--channel=left"], "channel: got left; required: every channel once"),
        (["--channel=left", "--channel=0"], "channel: got left, 0; required: every channel once"),
        (["--channel=left", "--channel=up"], "channel: got up; required: one of 0: 'left'"),
        (["--channel=left", "--stops=0"], "stops: got [0]; required: its default for one channel"),
        (["--channel=left", "--channel=right", "--stops=0"], "None, for each sensor (2)"),
        (["--channel=left", "--channel=right", "--stops=0,x"], "not a list of whole numbers"),
        (["--channel=left", "--unit=N", "--unit=V"], "unit: got ['N', 'V']; required: one, or as"),
        ([], "channel: got None; required: one of"),
    ],
)
def test_refusals(rig, options, told, capsys):
    assert run("detect", rig[0], *options) in (1, 2)
    err = capsys.readouterr().err
    assert told in err
    assert err.count("\n") == 1


def test_channels_of_one_name_are_told_apart_by_their_numbers():
    truth = two_stops()
    record = Recording(np.column_stack(cells(truth)), RATE, channels=("F", "F"), units="N")
    both = detect_impacts(record, channel=np.array([0, 1]), stops=(0, 1))
    assert list(both.settings["delay"]) == ["F 0", "F 1"]
    with pytest.raises(InvalidInput, match="every channel once"):
        detect_impacts(record, channel=[1, 1])


def test_a_channel_without_impacts_is_a_note(tmp_path):
    truth = two_stops()
    left, _ = cells(truth)
    quiet = 0.004 * np.random.default_rng(0).standard_normal(len(left))
    record = Recording(np.column_stack((left, quiet)), RATE, channels=("left", "right"))
    both = detect_impacts(record, channel=["left", "right"], stops=[0, 1])
    assert both.reason == ""
    assert any(note.startswith("right: no impacts: no pulse reaches") for note in both.notes)
    assert set(both.stop_index) == {0}


def test_return_map_and_waveform_by_stop():
    train = two_stops()
    ax = plot.return_map(train)
    between = train.stop_index[1:-1]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["stop 0", "stop 1"]
    for stop, colour in ((0, BLUE), (1, ORANGE)):
        drawn = next(line for line in ax.lines if line.get_label() == f"stop {stop}")
        assert drawn.get_color() == colour
        np.testing.assert_array_equal(drawn.get_xdata(), np.diff(train.time)[:-1][between == stop])
    gap = 0.5 * (train.time[5] + train.time[6])
    ax = plot.return_map(replace(train, gaps=[[gap, gap]]), lag=2)
    assert sum(len(line.get_xdata()) for line in ax.lines[1:]) == len(train) - 3 - 3
    record = Recording(cells(train)[0], RATE)
    ax = plot.waveform(record, train)
    assert ax.lines[0].get_color() == GREY
    count = int((train.stop_index == 1).sum())
    assert f"{count} impacts, stop 1" in [text.get_text() for text in ax.get_legend().get_texts()]
    plain = plot.waveform(record, replace(train, stop_index=None))
    assert plain.lines[0].get_color() == BLUE


def test_two_stops_by_one_microphone(tmp_path, capsys):
    truth = two_stops(60)
    upper = Microphone(noise=0.02)
    lower = Microphone(modes=tuple((1.2 * f, s, a) for f, s, a in upper.modes))
    sound = synthesize(truth, (upper, lower), seed=4)
    path = tmp_path / "mic.wav"
    soundfile.write(path, sound.samples / 8, int(sound.rate), subtype="FLOAT")
    analysis = analyse(path, separate_stops=True)
    matched = match_impacts(analysis.impacts, truth, 2e-3, delay=1 / 343).pairs
    assert len(matched) == len(truth)
    right = analysis.impacts.stop_index[matched[:, 0]] == truth.stop_index[matched[:, 1]]
    assert max(right.mean(), 1 - right.mean()) == 1
    rows = dict(dict(parameters(analysis))["Detection"])
    assert float(rows["distance of the two sounds"].split()[0]) > 5
    words = shlex.split(command(analysis))
    assert parser().parse_args(words[1:]).separate_stops is True
    scope = {}
    exec(python_lines(analysis), scope)
    np.testing.assert_array_equal(scope["impacts"].stop_index, analysis.impacts.stop_index)
    assert run("detect", path, "--separate-stops", "--stop", "0.5") == 0  # ten impacts
    assert "the stops were not told apart: " in capsys.readouterr().err
    assert run("detect", path, "--separate-stops", "--sensor=force") == 1
    assert "separate_stops: got True; required: its default" in capsys.readouterr().err


def test_what_a_late_channel_recorded_is_shown_at_the_instant_of_the_impact():
    near, far = np.zeros(1000), np.zeros(1000)
    near[500], far[530] = 1.0, 2.0  # 30 ms of delay
    sources = [Recording(one, 1000.0) for one in (near, far)]
    train = Impacts(
        [0.5], stop_index=[1], start=0.0, duration=1.0,
        settings={"stops": [0, 1], "delay": {"near": 0.0, "far": 0.03}},
    )  # fmt: skip
    excerpt = channels.around(train, 0, sources, [{}, {}])
    assert excerpt.time[np.argmax(excerpt.samples)] == pytest.approx(0.5)
    for overview in seen(sources, train)[0]:
        assert overview.time[np.argmax(overview.samples)] == pytest.approx(0.5)
