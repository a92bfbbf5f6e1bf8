"""The shipped recordings are what data_samples/README.md says they are."""

import importlib.util
import json
import sys
from itertools import pairwise
from math import pi
from pathlib import Path

import numpy as np
import pytest
import soundfile

from benchmarks.recordings import score
from impactsig import Impacts, detect_impacts, read
from impactsig.simulation.instruments.synthesis import SPEED_OF_SOUND
from tests import naive

FOLDER = Path(__file__).resolve().parents[2] / "data_samples"
FILES = sorted(
    path.name
    for path in FOLDER.iterdir()
    if path.name.startswith(("loadcell", "sound")) and ".truth" not in path.name
)


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_samples", FOLDER / "make_samples.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_samples"] = module  # dataclasses look their module up by name
    spec.loader.exec_module(module)
    yield module
    del sys.modules["make_samples"]


LATE = 0.3 / SPEED_OF_SOUND  # [s]


def truth(recording):
    lines = Path(recording).with_suffix(".truth.csv").read_text().splitlines()
    run = json.loads(lines[0].removeprefix("# impactsig "))
    return run, np.genfromtxt(lines[1:], delimiter=",", names=True)


def samples(path):
    if path.suffix == ".csv":
        return np.loadtxt(path, delimiter=",", skiprows=1)[:, 1]
    return soundfile.read(path)[0]


def test_every_sample_has_its_truth_and_is_listed(maker):
    files = {path.name for path in FOLDER.iterdir()} - {"__pycache__"}
    expected = {"README.md", "make_samples.py", "make_experiment.py", "experiment"}
    for sample in maker.SAMPLES:
        expected |= {sample.name, Path(sample.name).with_suffix(".truth.csv").name}
    assert files == expected
    listed = (FOLDER / "README.md").read_text()
    assert all(f"`{sample.name}`" in listed for sample in maker.SAMPLES)


def test_together_they_are_below_5_mb():
    assert sum(path.stat().st_size for path in FOLDER.glob("*.*")) < 5_000_000


@pytest.mark.parametrize(
    "name", ["loadcell_periodic_22.1Hz_short.csv", "sound_periodic_22.1Hz.flac"]
)
def test_the_script_makes_the_same_files_again(maker, tmp_path, name):
    """Of the periodic ones: chaos magnifies what another libm rounds."""
    sample = next(sample for sample in maker.SAMPLES if sample.name == name)
    maker.make(sample, tmp_path)
    _, made = truth(tmp_path / name)
    _, shipped = truth(FOLDER / name)
    for column in shipped.dtype.names:
        assert made[column] == pytest.approx(shipped[column], rel=1e-9)
    # another libm may round a sample the other way
    assert np.abs(samples(tmp_path / name) - samples(FOLDER / name)).max() <= 1.01 / 32768


@pytest.mark.parametrize("name", [name for name in FILES if "grazing" not in name])
def test_each_impact_follows_from_the_one_before(name):
    """The impact map, one impact at a time: chaos has no time to grow."""
    run, impacts = truth(FOLDER / name)
    setting = run["settings"]
    omega = naive.frequency_ratio(setting["forcing_frequency"])
    scale = 2 * pi * naive.NATURAL_FREQUENCY
    pairs = list(pairwise(impacts))[:15]
    assert len(pairs) >= 9
    begin = pi / omega  # the forcing is at its minimum at time 0
    for now, then in pairs:
        state = (
            now["time"] * scale + begin,
            1.0,
            -setting["restitution"] * now["approach_velocity"],
        )
        t, v, _ = naive.integrate_impacts(omega, 5, steps=800, state=state, most=1)
        assert t[0] - begin == pytest.approx(then["time"] * scale, abs=1e-7)
        assert v[0] == pytest.approx(then["approach_velocity"], abs=1e-7)


@pytest.mark.parametrize("name", [name for name in FILES if "periodic_22.1Hz" in name])
def test_the_periodic_files_follow_the_closed_form(name):
    _, impacts = truth(FOLDER / name)
    assert np.diff(impacts["time"]) == pytest.approx(1 / 22.1, abs=1e-9)
    assert impacts["approach_velocity"] == pytest.approx(0.5810258993557, abs=1e-7)


@pytest.mark.parametrize("name", [name for name in FILES if "grazing" in name])
def test_the_grazing_files_alternate_impacting_with_long_stretches_without(name):
    run, impacts = truth(FOLDER / name)
    gaps = np.diff(impacts["time"]) * run["settings"]["forcing_frequency"]
    assert np.median(gaps) < 4
    long = gaps[gaps > 10]
    assert len(long) >= 2
    assert long.min() > 40


@pytest.mark.parametrize("name", FILES)
def test_the_truth_is_a_table_of_impacts(name):
    run, table = truth(FOLDER / name)
    impacts = Impacts.read_csv((FOLDER / name).with_suffix(".truth.csv"))
    assert impacts.time == pytest.approx(table["time"], rel=1e-15)
    assert (impacts.start, impacts.duration, impacts.sensor) == (0, run["duration"], run["sensor"])
    if run["sensor"] == "force":
        assert impacts.peak == pytest.approx(0.6 * table["approach_velocity"])
        assert impacts.contact_time == pytest.approx(3e-4 * table["approach_velocity"] ** -0.2)


@pytest.mark.parametrize("name", FILES)
def test_what_was_put_in_is_found(name):
    """There and back: F1 = 1 within 1 ms, instants within a few samples."""
    known = Impacts.read_csv((FOLDER / name).with_suffix(".truth.csv"))
    heard = known.sensor == "sound"
    found = detect_impacts(read(FOLDER / name, sensor=known.sensor))
    f1, rms, _ = score(found.time - LATE * heard, known.time)
    assert f1 == 1
    assert rms < (80e-6 if heard else 20e-6)
