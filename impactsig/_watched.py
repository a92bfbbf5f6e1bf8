"""Whether somebody is there to be told what takes long, and how far it is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ._arguments import flag


def watched() -> bool:
    """Whether a terminal or a notebook is watching."""
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


@contextmanager
def progress(
    total: int | None, unit: str, wanted: bool | None = None, *, done: int = 0, leave: bool = True
) -> Iterator[Callable[[int], Any]]:
    """A bar that is told of every advance; by default if watched, for work longer than a second.

    The time remaining is judged by what is done from here on, not by what was `done` before.
    """
    if not (watched() if wanted is None else flag("progress", wanted)):
        yield lambda count: None
        return
    from tqdm import tqdm

    delay = 1.0 if wanted is None else 0.0
    with tqdm(
        total=total, initial=done, unit=unit, unit_scale=True, delay=delay, leave=leave
    ) as bar:
        yield bar.update
