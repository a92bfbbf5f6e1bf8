"""How far a study is and the time remaining, for whoever is watching."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from .._watched import watched


@contextmanager
def progress(total: int, done: int, wanted: bool | None) -> Iterator[Callable[[int], Any]]:
    """A bar over cells; the time remaining is judged by those of this run alone."""
    if not (watched() if wanted is None else wanted):
        yield lambda count: None
        return
    from tqdm import tqdm

    delay = 1.0 if wanted is None else 0.0
    with tqdm(total=total, initial=done, unit=" cells", unit_scale=True, delay=delay) as bar:
        yield bar.update
