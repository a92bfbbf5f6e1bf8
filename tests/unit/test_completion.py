"""The completion of the command's words: what a shell offers where Tab is pressed."""

import subprocess
import sys

import pytest

from impactsig import cli
from impactsig.cli import _commands

SHELLS = ("bash", "zsh", "fish")
OFFERED = """
source "$1"
read -ra COMP_WORDS <<< "$2"
[[ "$2" == *" " ]] && COMP_WORDS+=("")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
$(complete -p impactsig | sed -E 's/.*-F ([^ ]+).*/\\1/')
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    """The script for bash, as a file."""
    pytest.importorskip("shtab")
    told = subprocess.run(
        [sys.executable, "-m", "impactsig", "completion", "bash"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert told.stderr == ""
    path = tmp_path_factory.mktemp("completion") / "impactsig.bash"
    path.write_text(told.stdout)
    return path


@pytest.fixture
def offered(script, tmp_path):
    """What bash offers after these words, in a folder with a recording and a folder in it."""
    (tmp_path / "record.wav").touch()
    (tmp_path / "runs").mkdir()

    def offered(line):
        told = subprocess.run(
            ["bash", "-c", OFFERED, "bash", script, line],
            capture_output=True,
            text=True,
            check=True,
            cwd=tmp_path,
        )
        assert told.stderr == ""
        return told.stdout.split()

    return offered


def test_every_command_is_offered(offered):
    assert set(_commands.COMMANDS) <= set(offered("impactsig "))
    assert offered("impactsig de") == ["detect", "demo"]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("impactsig detect --thr", ["--threshold"]),
        ("impactsig detect --sensor ", ["force", "sound"]),
        ("impactsig detect rec", ["record.wav"]),
        ("impactsig report --dynamics record.wav ru", ["runs"]),
        ("impactsig detect --rig rec", ["record.wav"]),
        ("impactsig simulate kar", ["karpodinis", "karpodinis_control"]),
        ("impactsig simulate karpodinis --freq", ["--frequency"]),
        ("impactsig completion ", ["bash", "zsh", "fish"]),
    ],
)
def test_what_bash_offers(offered, line, expected):
    assert sorted(offered(line)) == sorted(expected)


def test_folders_alone_are_offered_where_a_folder_is_meant(offered):
    assert offered("impactsig experiment r") == ["runs"]
    assert offered("impactsig sweep karpodinis --out r") == ["runs"]


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_has_a_script_of_all_commands(shell, capsys):
    pytest.importorskip("shtab")
    assert cli.main(["completion", shell]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in _commands.COMMANDS)


def test_a_missing_library_is_an_error_that_names_the_extra(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert cli.main(["completion", "bash"]) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert 'pip install "impactsig[completion]"' in told.err
