"""The option `--seeds` of benchmarks."""

from __future__ import annotations

from argparse import ArgumentParser


def add_seeds(parser: ArgumentParser, default: str) -> None:
    """Add `--seeds`: a range without its end, or a single seed."""
    words = f"a range without its end, or one seed ({default})"
    parser.add_argument("--seeds", type=seed_range, default=default, metavar="SEEDS", help=words)


def seed_range(text: str) -> range:
    """The seeds of "first:end", without the end, or of "first"."""
    first, _, end = text.partition(":")
    return range(int(first), int(end) if end else int(first) + 1)
