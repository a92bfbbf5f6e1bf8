"""Which channels of a file show impacts, where nobody says it."""

import functools
import re
import warnings

import numpy as np
import pytest
import soundfile

from impactsig import ImpactsigWarning, LoadCell, cli, synthesize
from impactsig.detect import files as _files
from impactsig.detect.roles import (
    ACCELERATION,
    FORCE,
    FORCING,
    MOTION,
    PULSES,
    SOUND,
    TIMING,
    UNKNOWN,
    role_by_label,
    role_by_look,
)
from impactsig.impacts import Impacts
from impactsig.report import analyse
from impactsig.report.analysing import choosing
from impactsig.report.contents import channels_in_words

RATE = 20_000
TIME = np.arange(RATE) / RATE
TRUTH = Impacts.from_times(0.03 + 0.0491 * np.arange(19), duration=1.0)
SINE = np.sin(2 * np.pi * 20 * TIME)
SWING = SINE + 0.4 * np.sin(2 * np.pi * 33 * TIME)
TACHO = np.where((20 * TIME) % 1 < 0.1, 5.0, 0.0) + 0.01 * np.sin(1e5 * TIME)


@functools.cache
def signals():
    """Not while tests are collected, for every worker would compile for it."""
    load = synthesize(TRUTH, LoadCell(noise=0.004), rate=RATE, seed=0).samples
    return {"load": load, "sine": SINE, "swing": SWING, "tacho": TACHO}


@pytest.mark.parametrize(
    ("name", "unit", "kind"),
    [
        ("left", "N", FORCE),
        ("Kraft 1", "V", FORCE),
        ("Fz", "", FORCE),
        ("loadCell", "mV", FORCE),
        ("impact_hammer", "lbf", FORCE),
        ("ch 3", "m/s²", ACCELERATION),
        ("Accel X", "V", ACCELERATION),
        ("mic 2", "", SOUND),
        ("ch 4", "Pa", SOUND),
        ("shaker force", "N", FORCING),
        ("F_exc", "N", FORCING),
        ("table acc", "g", FORCING),
        ("Tacho", "V", TIMING),
        ("Trigger", "", TIMING),
        ("x", "mm", MOTION),
        ("laser", "V", MOTION),
        ("impact velocity", "", MOTION),
        ("beam tip", "m/s", MOTION),
        ("T1", "°C", "another quantity"),
        ("CH1", "V", UNKNOWN),
        ("Voltage_0", "", UNKNOWN),
        ("Analog Input 1", "Volt", UNKNOWN),
    ],
)
def test_labels(name, unit, kind):
    assert role_by_label(name, unit).kind == kind


@pytest.mark.parametrize(
    ("signal", "kind"),
    [
        ("load", PULSES),
        ("sine", "an oscillation"),
        ("swing", "an oscillation"),
        ("tacho", TIMING),
    ],
)
@pytest.mark.parametrize("factor", [1e-6, -3.0])
def test_looks(signal, kind, factor):
    assert role_by_look(factor * signals()[signal] + 2.0).kind == kind


@pytest.mark.parametrize(
    "samples",
    [
        np.zeros(100),
        np.full(100, np.nan),
        np.empty(0),
        np.random.default_rng(0).standard_normal(50_000),
        np.exp(-4 * TIME) * SINE,  # a swing that decays is two-sided
        np.eye(1, 5000, 700)[0] + 1e-3 * np.sin(np.arange(5000)),  # one glitch does not recur
    ],
)
def test_what_has_no_look_of_its_own(samples):
    assert role_by_look(samples).kind in (UNKNOWN, "an oscillation")
    assert role_by_look(samples).kind != PULSES


def recorded(tmp_path, **columns):
    path = tmp_path / "run.csv"
    heads = ["time [s]", *(name.replace("_", " ", 1) for name in columns)]
    rows = np.column_stack((TIME, *(signals()[one] for one in columns.values())))
    np.savetxt(path, rows, delimiter=",", header=",".join(heads), comments="", fmt="%.7g")
    return path


@pytest.mark.parametrize(
    ("columns", "options", "shown", "searched", "doubt"),
    [
        ({"x_[mm]": "swing", "load_[N]": "load"}, {}, ["load", "x"], 1, ""),
        ({"shaker_[N]": "sine", "a_[g]": "load"}, {}, ["a", "shaker"], 1, ""),
        ({"a_[N]": "load", "b_[N]": "load", "c_[V]": "sine"}, {}, ["a", "b", "c"], 2, ""),
        ({"a_[N]": "sine", "b_[N]": "load"}, {}, ["b", "a"], 1, ""),
        ({"a_[N]": "sine", "b_[mm]": "sine"}, {}, ["a", "b"], 1, "'a' .* steady rather than"),
        ({"a_[V]": "sine", "b_[V]": "load"}, {}, ["b", "a"], 1, "'b' .* by the look alone"),
        ({"a_[V]": "sine", "b_[V]": "tacho"}, {}, ["a", "b"], 0, "not clear .* 0: 'a', 1: 'b'"),
        ({"a_[mm]": "load", "b_[mm]": "swing"}, {}, ["a", "b"], 0, "not clear which"),
        ({"a_[V]": "tacho", "b_[V]": "load"}, {"sensor": "force"}, ["b", "a"], 1, ""),
        ({"x_[mm]": "swing", "F_[V]": "load"}, {"scale": 2.0, "unit": "N"}, ["F", "x"], 1, ""),
    ],
)
def test_which_channels_are_searched(tmp_path, columns, options, shown, searched, doubt):
    path = recorded(tmp_path, **columns)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", ImpactsigWarning)
        found = analyse(path, **options)
    assert [one.channels[0] for one in found.overviews] == shown
    assert (found.searched, len(found.roles)) == (searched, len(shown))
    assert len(told) == bool(doubt)
    for warning in told:
        assert re.search(doubt, str(warning.message))
        assert str(warning.message) in found.warnings
    signal = dict(zip((one.split("_")[0] for one in columns), columns.values(), strict=True))
    pulsed = any(signal[one] == "load" for one in shown[:searched])
    assert len(found.impacts) == (len(TRUTH) if pulsed else 0)
    assert channels_in_words(found).count("not searched") == len(shown) - searched


def test_the_options_of_reading_are_those_of_what_is_searched(tmp_path):
    path = recorded(tmp_path, **{"x_[mm]": "swing", "F_[V]": "load"})
    found = analyse(path, scale=2.0, unit="N", start=0.5)
    assert [one.unit for one in found.overviews] == ["N", "mm"]
    assert found.overviews[0].samples.max() == pytest.approx(
        2 * signals()["load"][RATE // 2 :].max()
    )
    assert found.overviews[1].samples.max() == pytest.approx(SWING[RATE // 2 :].max())
    assert {one.start for one in found.overviews} == {0.5}


def test_long_files_in_blocks_give_the_same(tmp_path, monkeypatch):
    path = recorded(tmp_path, **{"x_[mm]": "swing", "F_[N]": "load", "G_[N]": "load"})
    whole = analyse(path)
    monkeypatch.setattr(_files, "WHOLE_BELOW", 1000)
    monkeypatch.setattr(choosing, "WHOLE_BELOW", 1000)
    blocks = analyse(path)
    np.testing.assert_array_equal(blocks.impacts.time, whole.impacts.time)
    assert blocks.roles == whole.roles


def test_a_forcing_beside_a_microphone_in_a_file_of_sound(tmp_path):
    knocks = 0.2 * np.random.default_rng(0).standard_normal(RATE) * np.exp(-((TIME % 0.1) / 0.01))
    soundfile.write(tmp_path / "s.wav", np.column_stack((0.3 * SINE, knocks)), 8000)
    found = analyse(tmp_path / "s.wav")
    assert [one.channels[0] for one in found.overviews] == ["channel 1", "channel 0"]
    assert (found.searched, found.impacts.sensor) == (1, "sound")
    assert len(found.impacts) >= 9


def test_more_channels_than_a_page_shows(tmp_path):
    few = {f"c{k}_[mm]": "swing" for k in range(12)}
    path = recorded(tmp_path, **few, **{"F_[N]": "load"})
    with pytest.warns(ImpactsigWarning, match="not shown, as there are so many channels: c8, c9"):
        found = analyse(path)
    assert len(found.overviews) == 1 + choosing.MOST


@pytest.mark.usefixtures("without_figures")
def test_the_command_says_what_was_taken_for_what(tmp_path, capsys, monkeypatch):
    path = recorded(tmp_path, **{"x_[mm]": "swing", "load_[N]": "load"})
    monkeypatch.chdir(tmp_path)
    assert cli.main(["report", str(path)]) == 0
    said = capsys.readouterr().out.splitlines()[1]
    assert said == (
        "channels: load, searched for impacts (a force, by its unit N); "
        "x, not searched (a motion, by its unit mm)"
    )
    page = (tmp_path / "impactsig-report-run.csv.html").read_text(encoding="utf-8")
    assert said.removeprefix("channels: ") in page
