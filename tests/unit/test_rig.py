"""A rig as data: what its file may say, and where a mistake stands."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import soundfile

from impactsig import InvalidInput, Rig, UnreadableFile, cli, info
from impactsig.cli._commands import report_options
from impactsig.cli._parser import parser
from impactsig.experiment.parameter import Place
from impactsig.experiment.writing import _pattern, rig_text

WHOLE = """
files = "*.wav"

[[channel]]
name = "left"
sensor = "force"
scale = 2.0
stop = 0

[[channel]]
number = 1
unit = "N"
stop = 1

[[channel]]
name = "drive"
use = "tacho"
pulses = 2

[parameter]
name = "frequency"
unit = "Hz"
from = "file name"
pattern = '(?P<branch>up|down)_(?P<value>[0-9.]+)Hz'

[forcing]
frequency = "parameter"

[reading]
start = 1.5

[detection]
contact_time = [0, 0.01]
"""


@pytest.fixture
def written(tmp_path):
    def write(text, name="rig.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_file_says_what_the_functions_are_called_with(written):
    rig = Rig.read(written(WHOLE))
    assert rig.reading_options() == {
        "start": 1.5,
        "channel": ["left", 1],
        "scale": [2.0, 1.0],
        "unit": [None, "N"],
        "sensor": ["force", None],
    }
    assert rig.detecting_options() == {"contact_time": (0.0, 0.01), "stops": [0, 1]}
    assert rig.forcing_channel["pulses"] == 2


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ('sensor = "force"', 'sensr = "force"', "sensr", "Did you mean sensor?"),
        ('sensor = "force"', 'sensor = "ear"', "sensor", '"force" or "sound"'),
        ("number = 1", 'number = "one"', "number", "a whole number"),
        ("[reading]", "[detection.x]\n[reading]", "[detection.x]", "one of the keys"),
        ("start = 1.5", 'start = "soon"', "start", "a finite number"),
        ("(?P<value>", "(", "pattern", "a group named value"),
        ("[0, 0.01]", "[0.01, 0]", "contact_time", "such as [0, 0.1]"),
        ("number = 1\n", "", "[[channel]]\nunit", "a name or a number"),
        ("pulses = 2", "pulses = 0", "pulses", "a whole number"),
        ('frequency = "parameter"', 'frequency = "told"', "frequency =", '"parameter" or a number'),
        ('files = "*.wav"', 'files = "../*.wav"', "files", "a pattern within the folder"),
        ("[forcing]", "[forces]", "[forces]", "one of channel, parameter"),
        ('use = "tacho"', 'use = "impacts"', "pulses", 'use = "tacho"'),
    ],
)
def test_a_mistake_is_named_with_its_line_and_a_remedy(written, old, new, place, words):
    assert old in WHOLE
    wrong = WHOLE.replace(old, new)
    line = wrong[: wrong.index(f"\n{place}") + 1].count("\n") + 1
    with pytest.raises(UnreadableFile) as caught:
        Rig.read(written(wrong))
    assert f"line {line}: " in str(caught.value)
    assert words in str(caught.value)
    assert caught.value.remedy


def test_what_is_no_toml_is_said_with_its_line(written):
    with pytest.raises(UnreadableFile, match=r"is no TOML.*line 2"):
        Rig.read(written("a = 1\nb = = 2"))
    with pytest.raises(UnreadableFile, match="cannot be read"):
        Rig.read("no such rig.toml")


def test_tables_contradict_each_other():
    named = {"name": "f", "from": "file name"}
    with pytest.raises(InvalidInput, match='a key "pattern"'):
        Rig(parameter=named)
    with pytest.raises(InvalidInput, match="no such key"):
        Rig(parameter={**named, "pattern": "(?P<value>.)", "table": "a.csv"})
    with pytest.raises(InvalidInput, match="every channel once"):
        Rig(channel=[{"number": 0}, {"number": 0}])
    with pytest.raises(InvalidInput, match="several channels"):
        Rig(channel=[{"number": 0, "stop": 1}])
    with pytest.raises(InvalidInput, match="from the"):
        Rig(forcing={"frequency": "parameter"})
    with pytest.raises(InvalidInput, match=r"sweep\.from"):
        Rig(sweep={"from": "channel"})
    with pytest.raises(InvalidInput, match=r"sweep\.start: got parameter"):
        Rig(sweep={"from": "law", "start": "parameter", "rate": 0.1})
    with pytest.raises(InvalidInput, match=r"sweep\.start"):
        Rig(sweep={"from": "law", "start": "anywhere", "rate": 0.1})


@pytest.fixture
def recording(tmp_path):
    """Half a second of pulses, a second channel that is quiet."""
    rate, rng = 20_000, np.random.default_rng(1)
    t = np.arange(rate // 2) / rate
    samples = 1e-3 * rng.standard_normal((len(t), 2))
    for touch in np.arange(0.03, 0.48, 0.05):
        u = (t - touch) / 5e-4
        samples[:, 0] += 0.5 * np.where((u > 0) & (u < 1), np.sin(np.pi * u), 0)
    path = tmp_path / "run_20.0Hz.wav"
    soundfile.write(path, samples, rate, subtype="PCM_24")
    return path


@pytest.mark.parametrize(
    ("stem", "value", "branch", "back"),
    [
        ("beam up 20.5Hz", "20.5", "up", "beam down 20.5Hz"),
        ("run3-Falling-20.25_Hz", "20.25", "Falling", "run3-Rising-20.25_Hz"),
        ("beam.down.20.5Hz", "20.5", "down", "beam.up.20.5Hz"),
        ("20.5 Hz, DOWN again", "20.5", "DOWN", "20.5 Hz, UP again"),
    ],
)
def test_the_pattern_of_a_name_finds_the_branch(stem, value, branch, back):
    pattern = re.compile(_pattern(stem))
    assert pattern.search(stem).groupdict() == {"value": value, "branch": branch}
    ways = {Place.of(1, pattern.search(one)["branch"]).branch for one in (stem, back)}
    assert ways == {"up", "down"}


@pytest.mark.parametrize("stem", ["beam.20.5Hz", "setup 20.5Hz", "20.5Hz_upper", "a20.5 Hz"])
def test_the_pattern_of_a_name_without_a_branch(stem):
    assert re.search(_pattern(stem), stem).groupdict() == {"value": "20.5"}


def test_a_name_without_a_frequency_has_no_pattern():
    assert _pattern("up 20") is None


def test_what_is_written_of_a_file_reads_back(recording, written, capsys, monkeypatch):
    text = rig_text(info(recording), "force")
    rig = Rig.read(written(text, "other.toml"))
    assert rig.parameter["pattern"] == "(?P<value>[0-9.]+)Hz"
    assert len(rig.channel) == 2
    # Every line that is a comment reads back too, once it is set.
    for key in ("scale = 1.0", "threshold", "skip = 0", "window = 60"):
        assert key in text
    assert cli.main(["rig", str(recording)]) == 0
    assert capsys.readouterr().out == rig_text(info(recording), "force")
    target = recording.parent / "rig.toml"
    assert cli.main(["rig", str(recording), "-o", str(target)]) == 0
    assert Rig.read(target) == Rig.read(recording.parent / "other.toml")
    target.write_text("# by hand\n", encoding="utf-8")
    capsys.readouterr()
    assert cli.main(["rig", str(recording), "-o", str(target)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert target.read_text(encoding="utf-8") == "# by hand\n"


def test_a_written_rig_names_what_its_pattern_leaves_out(recording, written, capsys):
    for name in ("run_21.0Hz.csv", "run_22.0Hz.csv", "notes.txt", "picture.png"):
        (recording.parent / name).touch()
    assert cli.main(["rig", str(recording)]) == 0
    text = capsys.readouterr().out
    assert '# This leaves out .csv, .txt; files = "run_*" would not.' in text
    assert Rig.read(written(text)).files == "*.wav"
    assert "the file does not say of which sensor" in text


def test_every_key_of_a_written_rig_is_accepted(recording, written):
    """Each example, set alone in its table, is a value that the key may have."""
    from impactsig.experiment._rig_tables import CHANNEL, TABLES
    from impactsig.experiment.writing import _EXAMPLES

    for name, value in _EXAMPLES.items():
        table, _, key = name.rpartition(".")
        keys = TABLES[table] if table else CHANNEL
        keys[key].check(name, value)


def test_the_stop_of_a_channel_is_shown_where_it_may_be_set(recording, written):
    """Each cell of two may be at a stop of its own; of one channel the stop is refused."""
    file = info(recording)
    text = rig_text(file, "force")
    shown = re.findall("^# stop = .*stop that it is at", text, re.MULTILINE)
    assert [one.split()[3] for one in shown] == ["0", "1"]
    stops = Rig.read(written(re.sub("# (stop = .*stop that it is at)", r"\1", text)))
    assert stops.detecting_options()["stops"] == [0, 1]
    alone = rig_text(replace(file, channels=file.channels[:1]), "force")
    assert "stop that it is at" not in alone


def test_commands_read_the_rig_beside_a_recording(recording, written, capsys):
    assert cli.main(["detect", str(recording)]) == 1
    assert "Impacts are detected in one channel" in capsys.readouterr().err
    rig = written('[[channel]]\nnumber = 0\nsensor = "force"\nunit = "N"\nscale = 3.0\n')
    assert cli.main(["detect", str(recording)]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 9 + 2
    assert '"unit": "N"' in out
    # What the command line says comes first, and --rig in place of what lies there.
    assert cli.main(["detect", str(recording), "--unit", "kN"]) == 0
    assert '"unit": "kN"' in capsys.readouterr().out
    other = written('[[channel]]\nnumber = 1\nsensor = "force"\n', "quiet.toml")
    assert cli.main(["detect", str(recording), "--rig", str(other)]) == 0
    assert "no impacts" in capsys.readouterr().err
    rig.write_text("[[channel]]\nnumbr = 0\n", encoding="utf-8")
    assert cli.main(["detect", str(recording)]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert "line 2" in error


def test_a_report_takes_the_forcing_from_the_name(recording, written):
    """As its options: drawing the page takes seconds."""
    chosen = parser().parse_args(["report", str(recording)])
    assert report_options(recording, chosen) == {"dynamics": False}
    written(
        '[[channel]]\nnumber = 0\nsensor = "force"\n'
        '[parameter]\nfrom = "file name"\npattern = "(?P<value>[0-9.]+)Hz"\n'
        '[forcing]\nfrequency = "parameter"\n'
    )
    expected = {"dynamics": False, "channel": 0, "sensor": "force", "forcing_period": 1 / 20.0}
    assert report_options(recording, chosen) == expected
    chosen = parser().parse_args(["report", str(recording), "--forcing-frequency", "10"])
    assert report_options(recording, chosen)["forcing_period"] == 0.1
