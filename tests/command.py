"""The command line, called in this process."""

from __future__ import annotations

from impactsig import cli


def run(*words):
    """Exit code of a command line, as the shell would see it."""
    try:
        return cli.main([str(word) for word in words])
    except SystemExit as leave:
        return leave.code
