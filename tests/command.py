"""The command line, called in this process."""

from __future__ import annotations

from impactsig import cli


def run(*words):
    """Exit code of a command line, as the shell would see it."""
    try:
        return cli.main([str(word) for word in words])
    except SystemExit as leave:
        return leave.code


def output_before_error(capsys, *words):
    """Standard output of a command that ends with one line of error, which contains the words."""
    captured = capsys.readouterr()
    assert captured.err.startswith("error: ")
    assert captured.err.count("\n") == 1
    for word in words:
        assert word in captured.err
    return captured.out
