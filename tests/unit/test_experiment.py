"""An experiment: every recording a run, worked out once, and what the runs show together."""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import soundfile

from impactsig import Experiment, InvalidInput, Rig, UnreadableFile, detect_impacts, read
from impactsig.experiment import _reading
from impactsig.experiment._kept import Kept
from impactsig.experiment.parameter import Place, _named, places

RATE = 10_000
RIG = Rig(
    channel=[{"number": 0, "sensor": "force", "unit": "N", "scale": 2.0}],
    parameter={
        "name": "frequency",
        "unit": "Hz",
        "from": "file name",
        "pattern": "(?P<branch>up|down)/(?P<value>[0-9.]+)Hz",
    },
    forcing={"frequency": "parameter"},
)

RIG_WORDS = "(?P<branch>[a-zA-Z]+)_(?P<value>[0-9.]+)Hz"


def record(path, frequency, impacts=1, seed=0, drive=False):
    """Two seconds of pulses, `impacts` of them in every forcing period."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rng, t = np.random.default_rng(seed), np.arange(2 * RATE) / RATE
    samples = 5e-3 * rng.standard_normal(len(t))
    for k in range(int(2 * frequency)):
        for one in range(impacts):
            u = (t - (k + 0.3 + 0.37 * one) / frequency) / 2e-3
            samples += (0.4 + 0.1 * one) * np.where((u > 0) & (u < 1), np.sin(np.pi * u), 0)
    channels = [samples, 0.8 * np.sin(2 * np.pi * frequency * t)] if drive else [samples]
    soundfile.write(path, np.column_stack(channels), RATE, subtype="PCM_24")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three values upwards and three downwards, between which one impact becomes two."""
    place = tmp_path_factory.mktemp("experiment")
    for branch, several in (("up", (20.0, 21.0)), ("down", (20.0,))):
        for value in (20.0, 21.0, 22.0):
            record(place / branch / f"{value:.1f}Hz.wav", value, 1 + (value in several))
    (place / "up" / "23.0Hz.wav").write_bytes(b"RIFF and no more")
    (place / "up" / "unnamed.wav").write_bytes((place / "up" / "20.0Hz.wav").read_bytes())
    return place


@pytest.fixture(scope="module")
def experiment(folder):
    return Experiment.read(folder, RIG, workers=1)


def test_each_recording_is_a_run_and_failures_are_named(experiment, folder):
    assert len(experiment) == 6
    assert experiment.branches == ("up",) * 3 + ("down",) * 3
    np.testing.assert_array_equal(experiment.values, [20, 21, 22] * 2)
    errors = {path.name: error for path, error in experiment.errors.items()}
    assert set(errors) == {"23.0Hz.wav", "unnamed.wav"}
    assert isinstance(errors["23.0Hz.wav"], UnreadableFile)
    assert "unnamed" in str(errors["unnamed.wav"])


def test_a_run_has_the_impacts_that_detection_finds(experiment, folder):
    alone = detect_impacts(read(folder / "up" / "21.0Hz.wav", scale=2.0, unit="N"), sensor="force")
    kept = experiment.impacts(1)
    np.testing.assert_array_equal(kept.time, alone.time)
    np.testing.assert_array_equal(kept.contact_time, alone.contact_time)
    with pytest.raises(InvalidInput, match="run"):
        experiment.impacts(6)


def test_the_table_has_periods_and_contact_times(experiment):
    frame = experiment.to_frame()
    assert list(frame["m"]) == [2, 2, 1, 2, 1, 1]
    assert list(frame["period"]) == [f"period({m},1)" for m in (2, 2, 1, 2, 1, 1)]
    np.testing.assert_allclose(frame["contact_time"], 2e-3, rtol=0.02)
    np.testing.assert_allclose(frame["locked_frequency"], frame["frequency"], rtol=1e-4)
    np.testing.assert_allclose(frame["impacts_per_period"], [2, 2, 1, 2, 1, 1], rtol=0.05)


def test_results_as_labelled_arrays(experiment):
    pytest.importorskip("xarray")
    found = experiment.to_xarray("interval", "peak")
    assert found.sizes["run"] == 6
    assert found["frequency"].attrs["units"] == "Hz"
    of_last = found["interval_of_impacts"][found["interval_run"] == 5]
    np.testing.assert_allclose(of_last, 1 / 22, rtol=1e-3)
    assert found.sizes["peak_index"] == sum(len(experiment.impacts(k)) for k in range(6))


def test_jumps_and_hysteresis(experiment):
    jumps = experiment.jumps()
    assert [(one.branch, one.value) for one in jumps] == [("up", 21.5), ("down", 20.5)]
    assert (jumps[1].before, jumps[1].after) == ("period(1,1)", "period(2,1)")
    for one in jumps:  # somewhere within a step of 1 Hz, uniformly
        assert one.error == pytest.approx(1 / np.sqrt(12), rel=0.05)
        assert one.low == one.value + (0.5 if one.branch == "down" else -0.5)
    (loop,) = experiment.hysteresis()
    assert (loop.width, loop.below, loop.above) == (1.0, "period(2,1)", "period(1,1)")
    assert loop.error == pytest.approx(np.hypot(jumps[0].error, jumps[1].error))


def test_clouds_hold_every_impact(experiment):
    clouds = list(experiment.clouds("phase"))
    assert [point.value for point, _ in clouds] == [20, 21, 22] * 2
    for point, phases in clouds:
        spread = np.sort(phases)
        if point.m == 1:
            assert np.ptp(spread) < 1e-3
        else:
            assert spread[-1] - spread[0] == pytest.approx(0.37, abs=2e-3)
    with pytest.raises(InvalidInput, match="quantity"):
        next(experiment.clouds("colour"))


@pytest.fixture
def counted(monkeypatch):
    """The recordings that are worked out."""
    done = []
    original = _reading.worked_out

    def worked_out(path, *more):
        done.append(path.name)
        return original(path, *more)

    monkeypatch.setattr(_reading, "worked_out", worked_out)
    return done


def test_what_is_kept_is_not_done_again_and_what_changed_is(tmp_path, counted):
    for k in range(3):
        record(tmp_path / "up" / f"{20 + k}Hz.wav", 20.0 + k)
    (tmp_path / "up" / "29Hz.wav").write_bytes(b"RIFF and no more")
    first = Experiment.read(tmp_path, RIG, workers=1)
    assert len(counted) == 4  # a file that fails by its content fails once
    counted.clear()
    again = Experiment.read(tmp_path, RIG, workers=1)
    assert counted == []
    assert again.to_frame().equals(first.to_frame())
    assert list(again.errors) == list(first.errors)
    record(tmp_path / "up" / "21Hz.wav", 21.0, seed=1)
    Experiment.read(tmp_path, RIG, workers=1)
    assert counted == ["21Hz.wav"]
    counted.clear()
    other = Rig(RIG.channel, RIG.parameter, {"frequency": "parameter"}, {"stop": 1.0})
    assert (Experiment.read(tmp_path, other, workers=1).to_frame()["duration"] == 1.0).all()
    assert len(counted) == 4
    counted.clear()
    # Another name of the parameter is no other run, nor is a file that moves.
    (tmp_path / "up" / "20Hz.wav").rename(tmp_path / "up" / "0020Hz.wav")
    named = Rig(RIG.channel, {**RIG.parameter, "name": "f"}, RIG.forcing)
    Experiment.read(tmp_path, named, workers=1)
    assert counted == []


def test_a_changed_recording_is_noticed_by_its_time(tmp_path, counted):
    path = record(tmp_path / "up" / "20Hz.wav", 20.0)
    long_ago = time.time() - 100
    os.utime(path, (long_ago, long_ago))
    Experiment.read(tmp_path, RIG, workers=1)
    assert (tmp_path / ".impactsig" / "contents.jsonl").read_text().count("\n") == 1
    counted.clear()
    record(path, 20.0, impacts=2)  # of the same size
    frame = Experiment.read(tmp_path, RIG, workers=1).to_frame()
    assert counted == ["20Hz.wav"]
    assert list(frame["period"]) == ["period(2,1)"]


def test_corrections_beside_a_recording_are_part_of_it(tmp_path, counted):
    path = record(tmp_path / "up" / "20Hz.wav", 20.0)
    found = Experiment.read(tmp_path, RIG, workers=1).impacts(0)
    found.edit(reject=[float(found.time[3])], by="a test").write_corrections(path)
    assert len(Experiment.read(tmp_path, RIG, workers=1).impacts(0)) == len(found) - 1
    assert len(counted) == 2


def test_the_settings_beside_a_recording_are_part_of_it(tmp_path, counted):
    """Samples and settings in two files are one run, and either is looked at for changes."""
    whole, _ = soundfile.read(record(tmp_path / "20Hz.wav", 20.0))
    (tmp_path / "20Hz.wav").unlink()
    samples, settings = tmp_path / "20Hz.Wfm.csv", tmp_path / "20Hz.csv"
    samples.write_text("".join(f"{one:.6e}\n" for one in whole))
    words = "SignalResolution:{}:\nXStart:0:\nVerticalUnit:V:\nSignalHardwareRecordLength:{}:\n"
    rig = Rig(
        parameter={"name": "frequency", "from": "file name", "pattern": "(?P<value>[0-9]+)Hz"}
    )
    for resolution in (1e-4, 2e-4):
        settings.write_text(words.format(resolution, len(whole)))
        found = Experiment.read(tmp_path, rig, workers=1)
        assert not found.errors
        assert list(found.to_frame()["duration"]) == [pytest.approx(len(whole) * resolution)]
        Experiment.read(tmp_path, rig, workers=1)
    assert counted == ["20Hz.Wfm.csv"] * 2


def test_the_forcing_channel_tells_frequency_and_phase(tmp_path):
    record(tmp_path / "a.wav", 20.5, drive=True)
    rig = Rig(
        channel=[
            {"name": "channel 0", "sensor": "force", "unit": "N"},
            {"name": "channel 1", "use": "forcing"},
        ],
        parameter={"name": "frequency", "unit": "Hz", "from": "channel", "channel": "channel 1"},
    )
    found = Experiment.read(tmp_path, rig, workers=1)
    assert found.values == pytest.approx([20.5], rel=1e-6)
    ((_, phases),) = found.clouds("phase")
    np.testing.assert_allclose(phases, 0.3, atol=2e-3)  # of the rise of the sine, at 0
    assert list(found.to_frame()["period"]) == ["period(1,1)"]


def test_the_parameter_comes_from_a_table_or_from_metadata(tmp_path):
    record(tmp_path / "a.wav", 20.0)
    record(tmp_path / "b.wav", 20.0)
    with soundfile.SoundFile(tmp_path / "a.wav", "r+") as file:
        file.title = "12.5"
    (tmp_path / "runs.csv").write_text("file,value,branch\na.wav,1.5,up\n", encoding="utf-8")
    by_table = {"name": "gap", "unit": "mm", "from": "table", "table": "runs.csv"}
    found = Experiment.read(tmp_path, Rig(RIG.channel, by_table), workers=1)
    assert (found.values.tolist(), found.branches) == ([1.5], ("up",))
    assert [path.name for path in found.errors] == ["b.wav"]
    by_title = {"name": "gap", "from": "metadata", "key": "title", "branch": "down"}
    found = Experiment.read(tmp_path, Rig(RIG.channel, by_title), workers=1)
    assert (found.values.tolist(), found.branches) == ([12.5], ("down",))
    assert "a number among the metadata" in str(next(iter(found.errors.values())))


def test_a_run_that_its_frequency_did_not_force_is_noted(tmp_path):
    """A sweep, or a wrong name, among steady runs was read as one of them without a word."""
    t, rng = np.arange(12 * RATE) / RATE, np.random.default_rng(1)
    for name, phase in (("20.0Hz", 20 * t), ("21.0Hz", 20 * t), ("22.0Hz", 22 * t + 0.3 * t**2)):
        samples = 5e-3 * rng.standard_normal(len(t))
        since = (phase % 1) / 0.04  # of a period
        samples += np.where(since < 1, np.sin(np.pi * since), 0)
        (tmp_path / "up").mkdir(exist_ok=True)
        soundfile.write(tmp_path / "up" / f"{name}.wav", samples / 2, RATE, subtype="PCM_24")
    runs = Experiment.read(tmp_path, RIG, workers=1)
    noted = ["keep no phase" in note for note in runs.to_frame()["notes"]]
    assert noted == [False, True, True]
    page = runs.write_report(tmp_path / "page", reports=False).read_text(encoding="utf-8")
    assert "21.0Hz.wav, 22.0Hz.wav" in page


@pytest.mark.parametrize(
    ("said", "branch"),
    [("rising", "up"), ("Falling", "down"), ("UP", "up"), ("Decreasing", "down"), ("dry", "dry")],
)
def test_a_branch_is_known_by_its_direction(tmp_path, said, branch):
    """A way down of another name once was read upwards, and had no hysteresis."""
    named = _named(tmp_path / f"{said}_20.0Hz.wav", tmp_path, re.compile(RIG_WORDS), "")
    assert named == Place(20.0, branch)
    (tmp_path / "runs.csv").write_text(f"file,value,branch\na.wav,20,{said}\n", encoding="utf-8")
    rig = Rig(channel=RIG.channel, parameter={"from": "table", "table": "runs.csv"})
    assert places(rig, tmp_path)(tmp_path / "a.wav") == Place(20.0, branch)


def test_a_folder_needs_a_rig_and_recordings(tmp_path):
    with pytest.raises(InvalidInput, match=r"rig\.toml"):
        Experiment.read(tmp_path)
    (tmp_path / "rig.toml").write_text('files = "*.wav"\n', encoding="utf-8")
    with pytest.raises(InvalidInput, match="recordings"):
        Experiment.read(tmp_path)
    with pytest.raises(InvalidInput, match="folder"):
        Experiment.read(tmp_path / "nowhere", RIG)


def test_a_damaged_run_is_named_with_its_remedy(tmp_path):
    record(tmp_path / "up" / "20.0Hz.wav", 20.0)
    runs = Experiment.read(tmp_path, RIG, workers=1)
    (path,) = runs.directory.glob("*/*.run")
    whole = path.read_bytes()
    for cut, asked in ((0, runs.to_frame), (10, runs.to_frame), (-3, lambda: runs.impacts(0))):
        path.write_bytes(whole[:cut])
        with pytest.raises(UnreadableFile, match=path.name) as caught:
            asked()
        assert "Remove it" in str(caught.value)


@pytest.mark.skipif(sys.platform != "linux", reason="names of any bytes")
def test_a_name_of_any_bytes_is_a_row(tmp_path):
    record(tmp_path / "20.0Hz.wav", 20.0)
    (tmp_path / "20.0Hz.wav").rename(tmp_path / os.fsdecode(b"\xff_up_20.0Hz.wav"))
    runs = Experiment.read(tmp_path, Rig(channel=[{"number": 0, "sensor": "force"}]), workers=1)
    assert runs.to_frame()["file"].tolist() == ["\\udcff_up_20.0Hz.wav"]


@pytest.mark.slow
def test_killed_at_any_instant_nothing_is_lost_or_done_twice(tmp_path):
    """Twenty kills amid the work: every run is written once, as a single reading has it."""
    count = 100  # more than are done before the last kill, on a machine under load too
    for k in range(count):
        record(tmp_path / "up" / f"{20 + k / 10:.1f}Hz.wav", 20 + k / 10, seed=k)
    program = (
        "import sys; from tests.unit.test_experiment import RIG; from impactsig import Experiment;"
        "Experiment.read(sys.argv[1], RIG, workers=2, directory=sys.argv[2])"
    )
    kept = tmp_path / "kept"
    root = Path(__file__).parents[2]
    seen: dict[Path, int] = {}
    rng = np.random.default_rng(0)
    amid = 0
    for k in range(20):
        command = [sys.executable, "-c", program, str(tmp_path), str(kept)]
        run = subprocess.Popen(command, cwd=root, start_new_session=True)
        more = int(rng.integers(1, 4))  # runs that it may finish
        while run.poll() is None and len(list(kept.glob("*/*.run"))) < len(seen) + more:
            time.sleep(0.002)
        time.sleep(rng.uniform(0, 0.02))
        amid += run.poll() is None
        if k % 2:
            run.kill()  # alone: its workers see that it is gone
        else:
            os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        time.sleep(0.5)
        for path in kept.glob("*/*.run"):
            assert Kept(kept).read(path.stem)["impacts"] == len(Kept(kept).impacts(path.stem))
            stamp = path.stat().st_mtime_ns
            assert seen.setdefault(path, stamp) == stamp
    assert amid >= 15
    assert len(seen) < count
    whole = Experiment.read(tmp_path, RIG, workers=1, directory=tmp_path / "alone")
    last = Experiment.read(tmp_path, RIG, workers=1, directory=kept)
    assert last.to_frame().equals(whole.to_frame())
    assert len(list(kept.glob("*/*.run"))) == count
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in seen.items())


def test_sweeps_both_ways_begin_at_their_parameter(tmp_path):
    """Even of recordings with the same content: the law of each is a part of its name."""
    first = record(tmp_path / "up" / "20.0Hz.wav", 20.0)
    (tmp_path / "down").mkdir()
    (tmp_path / "down" / "20.5Hz.wav").write_bytes(first.read_bytes())
    sweep = {"from": "law", "start": "parameter", "rate": 0.1, "window": 20}
    rig = Rig(channel=RIG.channel, parameter=RIG.parameter, sweep=sweep)
    found = Experiment.read(tmp_path, rig, workers=1)
    assert not found.errors
    ends = {
        branch: [point.value for point in found.points() if point.branch == branch]
        for branch in ("up", "down")
    }
    for branch, begun, pace in (("up", 20.0, 0.1), ("down", 20.5, -0.1)):
        assert len(ends[branch]) > 1
        assert ends[branch] == sorted(ends[branch], reverse=branch == "down")
        middle = begun + pace * 1.0  # of two seconds
        assert np.mean([ends[branch][0], ends[branch][-1]]) == pytest.approx(middle, abs=0.02)


def test_what_is_kept_of_a_recording_that_waits_is_small(monkeypatch):
    """1e5 recordings are a list of names; the digest of the job took 10 kB of each."""

    def name_only(work, run):
        return {"names": np.zeros(8, np.uint64)}

    monkeypatch.setattr(_reading.Work, "__call__", name_only)
    count = 3000
    places = [_reading.Place(float(k), "") for k in range(count)]
    tasks = [_reading.Task(Path(f"{k}.wav"), place, None, RIG) for k, place in enumerate(places)]
    work = _reading.Work(pickle.dumps(tasks), Path("kept"))
    tracemalloc.start()
    try:
        found, errors = _reading._swept(work, count, 1, None, False)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (len(found), errors) == (count, {})
    assert peak < 3000 * count
