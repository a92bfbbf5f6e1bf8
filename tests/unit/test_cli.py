"""The command: results on standard output, one line and a non-zero exit for every error."""

import gc
import io
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
import soundfile

from impactsig import Impacts, ImpactsigWarning, UnreadableFile, UnwritableFile, cli
from impactsig._files.standard_input import FOLDER
from impactsig.cli import _commands, _files
from tests.command import output_before_error, run

RATE = 50_000
TOUCH = 0.02 + 0.05 * np.arange(19)


@pytest.fixture
def recording(tmp_path):
    """A WAV of half-sine pulses of 400 us, 20 a second, over a little noise."""
    t = np.arange(RATE) / RATE
    samples = 0.001 * np.random.default_rng(0).standard_normal(RATE)
    for touch in TOUCH:
        u = (t - touch) / 4e-4
        samples += 0.5 * np.where((u > 0) & (u < 1), np.sin(np.pi * u), 0)
    path = tmp_path / "rig.wav"
    soundfile.write(path, samples, RATE, subtype="PCM_24")
    return path


@pytest.fixture
def silent(tmp_path):
    path = tmp_path / "silent.wav"
    soundfile.write(path, np.zeros(RATE), RATE)
    return path


def python(*words, **options):
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, check=False, **options
    )


# -- what it does ----------------------------------------------------------------------------


def test_detect_writes_a_table_that_reads_back_as_the_same_impacts(recording, capsys, tmp_path):
    assert run("detect", recording, "--sensor", "force", "--unit", "V") == 0
    text = capsys.readouterr().out
    path = tmp_path / "table.csv"
    assert run("detect", recording, "--sensor=force", "--unit=V", "-o", path) == 0
    assert path.read_text() == text
    found = Impacts.read_csv(path)
    np.testing.assert_allclose(found.time, TOUCH, atol=40e-6)
    assert (found.unit, found.sensor, found.duration) == ("V", "force", 1.0)


@pytest.fixture
def unfrozen():
    """Without what pytest's collection left frozen (`conftest.py`)."""
    gc.unfreeze()
    yield
    gc.freeze()


@pytest.mark.usefixtures("unfrozen")
def test_the_collector_of_garbage_is_left_as_it_was(monkeypatch, recording):
    """A command looks seldom through what its imports have made; a caller's setting comes back."""
    within = []
    monkeypatch.setattr(
        "impactsig.cli._show_warnings_as_lines", lambda: within.append(gc.get_threshold())
    )
    before, frozen = gc.get_threshold(), gc.get_freeze_count()
    for path in (recording, "missing.wav"):
        run("detect", path, "--sensor", "force")
        assert (gc.get_threshold(), gc.get_freeze_count()) == (before, frozen)
    assert all(thresholds[0] > before[0] for thresholds in within)
    assert len(within) == 2


def test_detect_writes_parquet(recording, tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "table.parquet"
    assert run("detect", recording, "--sensor=force", "-o", path) == 0
    assert len(Impacts.read_parquet(path)) == len(TOUCH)


def test_options_reach_the_reader_and_the_detector(recording, capsys):
    words = ("--start", "0.1", "--stop=500e-3", "--scale", "-2e1", "--sensor=force", "--unit=N")
    assert run("detect", recording, *words, "--threshold=3") == 0
    run_of, *_ = capsys.readouterr().out.splitlines()
    told = json.loads(run_of.removeprefix("# impactsig "))
    assert (told["start"], told["duration"], told["unit"]) == (0.1, pytest.approx(0.4), "N")
    assert told["threshold"] == pytest.approx(3.0)


def test_no_impacts_is_a_result_with_a_reason(silent, capsys):
    assert run("detect", silent, "--sensor=force") == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[1].startswith("time")
    assert len(out.splitlines()) == 2
    assert err.startswith("warning: no impacts: ")
    assert err.count("\n") == 1


def test_info_lists_the_channels(recording, capsys):
    assert run("info", recording) == 0
    out = capsys.readouterr().out
    assert f"{recording.stat().st_size:,} bytes" in out
    assert "50000" in out
    assert "TRUNCATED" not in out


def test_info_goes_on_after_a_file_that_cannot_be_read(recording, tmp_path, capsys):
    assert run("info", tmp_path / "none.wav", recording) == 1
    out, err = capsys.readouterr()
    assert out.startswith(f"{recording}: ")
    assert err.splitlines() == [
        f"error: {tmp_path / 'none.wav'}: no such file. Check the path",
        "error: 1 of 2 files could not be read",
    ]


@pytest.mark.parametrize(
    ("words", "command"),
    [
        (["detect", "x.wav", "--nope"], "impactsig detect"),
        (["simulate", "karpodinis", "--nope", "3"], "impactsig simulate karpodinis"),
    ],
)
def test_an_unknown_option_names_the_command_that_lacks_it(words, command, capsys):
    assert run(*words) == 2
    unknown = " ".join(words[2:])
    told = capsys.readouterr().err
    assert told == f"error: unrecognized arguments: {unknown} (see: {command} --help)\n"


@pytest.mark.parametrize(
    ("given", "meant"),
    [("--treshold=3", "--threshold"), ("--forcing", "--forcing-frequency"), ("--Rate", "--rate")],
)
def test_an_option_that_is_misspelt_or_cut_short_is_told_the_one_meant(given, meant, capsys):
    assert run("report", "x.wav", given) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"error: unrecognized arguments: {given}; did you mean {meant}? (see: ")


@pytest.mark.usefixtures("without_figures")
def test_report_says_what_was_found_and_where_it_stands(recording, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("report", recording, "--sensor=force", "--forcing-frequency=20") == 0
    summary, where = capsys.readouterr().out.splitlines()
    assert summary.startswith("period(1,1): 1 impact per forcing period; 19 impacts in 1 s")
    assert where == "report: impactsig-report-rig.wav.html"
    assert "period(1,1)" in (tmp_path / "impactsig-report-rig.wav.html").read_text()


def test_demo_writes_its_report_here_and_says_what_it_found(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("demo") == 0
    summary, where = capsys.readouterr().out.splitlines()
    assert summary.startswith("period(1,1)")
    assert where == f"report: {tmp_path / 'impactsig-demo.html'}"
    assert [path.name for path in tmp_path.iterdir()] == ["impactsig-demo.html"]


def test_samples_are_found_inside_an_installed_package_first(tmp_path, monkeypatch):
    place = tmp_path / "site" / "impactsig" / "cli" / "_files.py"
    monkeypatch.setattr(_files, "__file__", str(place))
    with pytest.raises(UnreadableFile, match="sample recording is missing"):
        _files.sample("a.wav")
    for folder in ("site/data_samples", "site/impactsig/_samples"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "a.wav").touch()
        assert _files.sample("a.wav") == tmp_path / folder / "a.wav"


# -- what goes wrong -------------------------------------------------------------------------


def test_a_missing_file_is_one_line(tmp_path, capsys):
    assert run("report", tmp_path / "none.wav") == 1
    assert output_before_error(capsys, "none.wav") == ""


def test_several_channels_without_a_choice_are_listed(tmp_path, capsys, monkeypatch):
    path = tmp_path / "stereo.wav"
    soundfile.write(path, np.zeros((1000, 2)), 8000)
    monkeypatch.chdir(tmp_path)
    for command, code in (("report", 0), ("detect", 1)):
        assert run(command, path) == code
        err = capsys.readouterr().err
        assert "0: 'channel 0', 1: 'channel 1'" in err
        assert err.count("\n") == 1
    assert run("detect", path, "--channel=1") == 0


@pytest.mark.parametrize("name", ["report.pdf", "report", "report.html.txt"])
def test_a_report_is_a_page_and_nothing_else(recording, tmp_path, capsys, name):
    assert run("report", recording, "-o", tmp_path / name) == 1
    told = capsys.readouterr().err
    assert told.startswith("error: output: got ")
    assert "required: a name ending in .html or .htm" in told
    assert not (tmp_path / name).exists()


def test_a_report_that_cannot_be_written_leaves_nothing(recording, tmp_path, capsys):
    assert run("report", recording, "-o", tmp_path / "no" / "such.html") == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["rig.wav"]


@pytest.mark.usefixtures("without_figures")
def test_numbers_without_a_header_are_read_as_told(recording, tmp_path, capsys):
    samples, _ = soundfile.read(recording)
    force = np.round(samples * 30_000)
    path = tmp_path / "rig.bin"
    path.write_bytes(b"12345" + np.column_stack([0 * force, force]).astype(">i2").tobytes())
    laid = ["--raw", "int16", "--raw-channels", 2, "--raw-byte-order", "big", "--raw-skip", 5]
    assert run("info", path, *laid, "--rate", RATE) == 0
    told = capsys.readouterr().out
    assert "raw binary" in told
    assert told.count(f"{RATE}        {len(force)}            1\n") == 2
    table, page = tmp_path / "table.csv", tmp_path / "page.html"
    assert run("detect", path, *laid, "--rate", RATE, "--channel", 1, "-o", table) == 0
    np.testing.assert_allclose(Impacts.read_csv(table).time, TOUCH, atol=2e-5)
    assert run("report", path, *laid, "--rate", RATE, "--channel", 1, "-o", page) == 0
    # The page says how it is made again.
    again = page.read_text().partition("<code>impactsig ")[2].partition("</code>")[0].split()
    assert run(*again) == 0
    assert "19 impacts" in capsys.readouterr().out


@pytest.mark.usefixtures("without_figures")
def test_of_several_files_without_a_header_each_is_read_as_told(tmp_path, capsys):
    pulse = np.sin(np.pi * np.arange(20) / 20)
    for name, count in (("a.bin", 5), ("b.bin", 9)):
        samples = np.random.default_rng(0).normal(0, 1e-3, 50_000).astype("f4")
        for k in range(count):
            samples[1000 + 4000 * k : 1020 + 4000 * k] += pulse
        samples.tofile(tmp_path / name)
    words = ["--raw", "float32", "--rate", RATE, "--workers", 1, "-o", tmp_path / "pages"]
    assert run("report", tmp_path / "a.bin", tmp_path / "b.bin", *words) == 0
    told = capsys.readouterr().out
    assert "5 impacts in 1 s" in told
    assert "9 impacts in 1 s" in told


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "of no known format .* numbers without a header .*--raw"),
        (["--raw", "int16"], r"rate: got None; .*give rate= \(--rate\)"),
        (["--raw", "int17", "--rate", 1], "raw.dtype: got int17; required: .*int16"),
        (["--raw-channels", 2, "--rate", 1], "raw: .*Give --raw int16, say, with --raw-channels"),
        (["--raw-byte-order", "big"], "Give --raw int16, say, with --raw-byte-order"),
        (["--raw", "int16", "--raw-channels", 0, "--rate", 1], "raw.channels: got 0; .*at least 1"),
        (["--raw", "int16", "--raw-skip", 99, "--rate", 1], "contains no row .*Check dtype"),
    ],
)
def test_what_is_untold_of_numbers_without_a_header_is_asked_for(words, told, tmp_path, capsys):
    path = tmp_path / "rig.bin"
    path.write_bytes(bytes(range(60)))
    assert run("detect", path, *words) == 1
    assert re.search(told, capsys.readouterr().err)


def test_a_rate_that_is_none_is_refused_by_info(recording, capsys):
    assert run("info", recording, "--rate", -5) == 1
    assert "rate: got -5.0; required: a positive number" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["repotr"],
        ["report"],
        ["detect", "x.wav", "--start", "nan"],
        ["detect", "x.wav", "--rate", "inf"],
        ["detect", "x.wav", "--scale", "two"],
        ["detect", "x.wav", "--threshold", "six"],
        ["detect", "x.wav", "--sensor", "smell"],
        ["detect", "x.wav", "--thresh", "6sigma"],
        ["report", "x.wav", "--forcing-frequency", "0"],
    ],
)
def test_a_wrong_command_line_exits_with_2(words, capsys):
    assert run(*words) == 2
    assert "see: impactsig" in capsys.readouterr().err


def test_what_a_threshold_may_be_is_told(capsys):
    assert run("detect", "x.wav", "--threshold", "5 bananas") == 2
    assert '"6 sigma"' in capsys.readouterr().err


def test_an_output_of_no_known_kind_is_refused_before_work_begins(tmp_path, capsys):
    assert run("detect", tmp_path / "none.wav", "-o", tmp_path / "table.xlsx") == 1
    assert ".csv or .parquet" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (KeyboardInterrupt(), 130, "interrupted\n"),
        (
            RuntimeError("two\nlines \x1b[31m"),
            1,
            "error: unexpected RuntimeError: two lines \\x1b[31m",
        ),
        (UnwritableFile("x", "full"), 1, "error: x: full\n"),
    ],
)
def test_every_failure_is_one_line_and_an_exit_code(error, code, line, monkeypatch, capsys):
    def fail(chosen):
        raise error

    monkeypatch.setitem(_commands.COMMANDS, "info", fail)
    assert run("info", "x") == code
    err = capsys.readouterr().err
    assert err.startswith(line)
    assert err.count("\n") == 1


def test_the_traceback_is_there_for_who_asks(monkeypatch):
    def fail(chosen):
        raise RuntimeError("inside")

    monkeypatch.setitem(_commands.COMMANDS, "info", fail)
    monkeypatch.setenv(cli.DEBUG, "1")
    with pytest.raises(RuntimeError, match="inside"):
        run("info", "x")


def test_warnings_are_a_line_each_and_foreign_ones_are_silent(monkeypatch, capsys):
    import warnings

    def warn(chosen):
        for _ in range(2):
            warnings.warn("channel b\nleft out", ImpactsigWarning, stacklevel=1)
        warnings.warn("in some library", DeprecationWarning, stacklevel=1)

    monkeypatch.setitem(_commands.COMMANDS, "info", warn)
    assert run("info", "x") == 0
    assert capsys.readouterr().err == "warning: channel b left out\n" * 2


@pytest.mark.skipif(os.name == "nt", reason="pipes end otherwise there")
def test_a_reader_that_leaves_early_is_told_by_the_exit_code_alone(recording):
    read_end, write_end = os.pipe()
    os.close(read_end)
    words = [sys.executable, "-m", "impactsig", "detect", str(recording), "--sensor=force"]
    with os.fdopen(write_end) as gone:
        done = subprocess.run(words, stdout=gone, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (141, "")


def test_table_goes_to_an_open_file_as_to_a_path(tmp_path):
    impacts = Impacts.from_times([0.1, 0.25], duration=1.0, start=0.0, peak=[1 / 3, 2.0])
    held = io.StringIO()
    impacts.to_csv(held)
    impacts.to_csv(tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text() == held.getvalue()


# -- what it costs ---------------------------------------------------------------------------

HEAVY = {"numpy", "scipy", "pandas", "matplotlib", "numba", "soundfile", "jinja2"}


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["report", "--help"]])
def test_help_imports_nothing_heavy(words):
    code = (
        "import sys\nfrom impactsig.cli import main\n"
        f"try: main({words!r})\nexcept SystemExit: pass\n"
        f"print(sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr)"
    )
    done = python("-c", code)
    assert done.stderr == "[]\n"
    assert "impactsig" in done.stdout


def test_it_runs_as_a_module(tmp_path):
    done = python("-m", "impactsig", "info", str(tmp_path / "none.wav"), cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1


class Piped:
    """Standard input with bytes in it."""

    def __init__(self, data):
        self.buffer = io.BytesIO(data)


def test_a_dash_is_standard_input(recording, capsys, monkeypatch):
    assert run("detect", recording, "--sensor", "force") == 0
    expected = capsys.readouterr().out
    monkeypatch.setattr(sys, "stdin", Piped(recording.read_bytes()))
    assert run("detect", "-", "--sensor", "force") == 0
    found = capsys.readouterr().out
    assert found.splitlines()[1:] == expected.splitlines()[1:]
    assert '"source": "standard input"' in found.splitlines()[0]
    monkeypatch.setattr(sys, "stdin", Piped(expected.encode()))  # a table of impacts
    assert run("compare", recording, "-", "--sensor", "force") == 0
    assert "standard-input" in capsys.readouterr().out


def test_notes_of_a_report_call_standard_input_so(capsys, monkeypatch, tmp_path):
    noise = np.random.default_rng(3).standard_normal((400, 2))
    rows = "".join(f"{k / 1000:.3f},{a:.4f},{b:.4f}\n" for k, (a, b) in enumerate(noise))
    monkeypatch.setattr(sys, "stdin", Piped(b"time [s],x,y\n" + rows.encode()))
    page = tmp_path / "page.html"
    assert run("report", "-", "-o", page) == 0
    assert FOLDER not in capsys.readouterr().err
    text = page.read_text(encoding="utf-8")
    assert FOLDER not in text
    assert "standard input: no channel was searched" in text


@pytest.mark.usefixtures("without_figures")
def test_standard_input_is_called_so(recording, capsys, monkeypatch, tmp_path):
    """And not by the file it is kept in, which is gone when the command ends."""
    data, page = recording.read_bytes(), tmp_path / "page.html"
    for words in (["info", "-"], ["report", "-", "--sensor=force", "-o", page], ["rig", "-"]):
        monkeypatch.setattr(sys, "stdin", Piped(data))
        assert run(*words) == 0
        told = capsys.readouterr()
        assert FOLDER not in told.out + told.err, words
    monkeypatch.setattr(sys, "stdin", Piped(data[: len(data) // 2]))
    assert run("info", "-") == 0
    assert capsys.readouterr().out.startswith("standard input: ")
    monkeypatch.setattr(sys, "stdin", Piped(b"none"))
    assert run("info", "-") == 1
    assert capsys.readouterr().err.startswith("error: standard input: is of no known format")
    text = page.read_text(encoding="utf-8")
    assert FOLDER not in text
    assert "impactsig report --sensor=force -</code></pre>" in text


def test_standard_input_is_read_once(recording, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stdin", Piped(b""))
    assert run("compare", "-", "-") == 1
    assert "files: got" in capsys.readouterr().err
