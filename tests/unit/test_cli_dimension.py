"""`impactsig dimension`: the dimension of a file's intervals in words, and why there is none."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from impactsig import Impacts, surrogate_test
from tests import command

SAMPLES = Path(__file__).resolve().parents[2] / "data_samples"
CHAOTIC = SAMPLES / "loadcell_chaotic_20.1Hz.wav"
PERIODIC = SAMPLES / "loadcell_periodic_22.1Hz.wav"


def run(*words):
    return command.run("dimension", *words)


def write(path, intervals):
    Impacts.from_times(np.cumsum([0.0, *intervals])).to_csv(path)
    return path


def series(count):
    """Intervals by the logistic map at r = 4: dimension 1, exponent ln 2."""
    x = [0.4]
    for _ in range(count - 1):
        x.append(4 * x[-1] * (1 - x[-1]))
    return 0.05 + 0.01 * np.array(x)


@pytest.fixture
def logistic(tmp_path):
    return write(tmp_path / "logistic.csv", series(700))


def test_a_chaotic_recording(capsys):
    assert run(CHAOTIC, "--sensor=force") == 0
    train, found = capsys.readouterr().out.splitlines()
    assert train.startswith("loadcell_chaotic_20.1Hz.wav: 115 intervals, mean 86.1 ms")
    assert "periodic" not in train
    low, high = re.search(r"slope \S+, 95 % interval (\S+) to (\S+),", found).groups()
    assert float(low) < 1.054 < float(high)  # of 20 000 intervals, over the same scales
    assert re.search(r"slope \S+, 95 % interval .* by the time_error of the impacts", found)


def test_a_periodic_recording_has_dimension_0_whatever_its_jitter(capsys):
    assert run(PERIODIC, "--sensor=force") == 0
    train, found = capsys.readouterr().out.splitlines()
    assert "periodic: 1 impact every 45.25 ms" in train
    assert found.startswith("dimension 0: the series is periodic (every value recurs, ")


def test_intervals_that_recur_exactly_have_dimension_0(tmp_path, capsys):
    path = write(tmp_path / "two.csv", np.tile([0.0625, 0.125], 60))
    assert run(path) == 0
    found = capsys.readouterr().out.splitlines()[1]
    assert found.startswith("dimension 0: the series is periodic (recurs every 2 steps")


def test_only_what_is_asked_for_is_told(logistic, capsys):
    assert run(logistic, "--dimension=2", "--surrogates", "--exponent") == 0
    out = capsys.readouterr().out
    assert "figure" not in out
    assert "\nsurrogates: more than a linear Gaussian process" in out
    value = float(re.search(r"\nexponent: largest Lyapunov exponent (\S+) per value", out)[1])
    assert abs(value - np.log(2)) < 0.1
    low, high = re.search(
        r"\ncorrelation dimension \S+ 95 % interval (\S+) to (\S+) ", out
    ).groups()
    assert float(low) < 1 < float(high)


def test_the_options_reach_the_estimate(logistic, capsys):
    chosen = "--dimension=2", "--theiler=7", "--timing-error=1e-6", "--contraction=3"
    assert run(logistic, *chosen, "--missed=0.01", "--spurious=0.02") == 0
    out = capsys.readouterr().out
    assert "(embedding dimension 2; noise of 1.4e-06 as given; floor 2.12e-06;" in out
    assert "covers chance and missed and spurious impacts" in out
    assert "D1 by Kaplan and Yorke 1." in out
    assert run(logistic, "--theiler=699") == 1
    assert "a Theiler window of 699" in capsys.readouterr().err


def test_the_seed_decides_the_surrogates(tmp_path, capsys):
    path = write(tmp_path / "short.csv", series(300))
    assert run(path, "--dimension=2", "--seed=3", "--surrogates") == 0
    told = capsys.readouterr().out.splitlines()[-1]
    impacts = Impacts.read_csv(path)
    assert told == f"surrogates: {surrogate_test(impacts, seed=3).describe()}"
    assert told != f"surrogates: {surrogate_test(impacts, seed=4).describe()}"


@pytest.mark.parametrize(
    ("ending", "magic"),
    [
        pytest.param(".png", b"\x89PNG", marks=pytest.mark.slow),
        (".svg", b"<?xml"),
    ],
)
def test_the_figure_is_written(ending, magic, tmp_path, capsys):
    few = write(tmp_path / "few.csv", series(300))
    path = tmp_path / f"dimension{ending}"
    assert run(few, "--dimension=2", "-o", path) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"figure: {path}"
    assert path.read_bytes().startswith(magic)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("short.csv",), "intervals of short.csv: got 2 values; required: at least "),
        (("empty.csv",), "intervals of empty.csv: got 0 values"),
        (("none.wav",), "none.wav"),
        (("none.parquet",), "none.parquet"),
        (("two.csv", "-o", "figure.xlsx"), ".png or .pdf or .svg"),
        (("two.csv", "--dimension=2", "-o", "no/such.png"), "such.png"),
        (("two.csv", "--dimension=0"), "dimension: got 0"),
        (("two.csv", "--timing-error=-1"), "timing_error: got -1"),
    ],
)
def test_every_failure_is_one_line(words, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "two.csv", np.tile([0.0625, 0.125], 60))
    Impacts.from_times([0.1, 0.2, 0.35]).to_csv("short.csv")
    Impacts([]).to_csv("empty.csv")
    before = sorted(tmp_path.iterdir())
    assert run(*words) == 1
    command.output_before_error(capsys, told)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("option", ["--dimension=two", "--dimension=2,", "--theiler=1.5"])
def test_numbers_must_be_whole(option, capsys):
    assert run("a.csv", option) == 2
    assert "is not a whole number" in capsys.readouterr().err


def test_help_imports_nothing_heavy():
    code = (
        "import sys\nfrom impactsig.cli import main\n"
        "try:\n    main(['dimension', '--help'])\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'numba', 'scipy', 'pandas', 'matplotlib'} & set(sys.modules)\n"
        "sys.exit(', '.join(heavy) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "--surrogates" in done.stdout
