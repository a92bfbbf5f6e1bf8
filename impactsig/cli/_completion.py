"""`impactsig completion SHELL`: a script for tab completion in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from .._extras import library

SHELLS = ("bash", "zsh", "fish")
FOLDERS = ("folder", "directory", "out")
"""Destinations of the arguments that are folders."""


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The script, by shtab: fixed text, so that completing starts no Python.

    Raises
    ------
    MissingExtra
        If shtab is not installed.
    """
    shtab = library("shtab", "completion", "Shell completion")
    for one in _arguments(parser):
        if one.type is Path:
            kind = shtab.DIRECTORY if one.dest in FOLDERS else shtab.FILE
            one.complete = kind  # type: ignore[attr-defined]
    return str(shtab.complete(parser, shell=shell))


def _arguments(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The arguments of a parser and of those below it."""
    for one in parser._actions:
        yield one
        if isinstance(one, argparse._SubParsersAction):
            for below in one.choices.values():
                yield from _arguments(below)
