"""What a terminal or notebook is told while work goes on; nobody else is told anything."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .._watched import watched


@contextmanager
def compiling() -> Iterator[None]:
    """Say so, once, if kernels have to be compiled: it takes seconds, and happens once."""
    if not watched():
        yield
        return
    from numba.core import event

    class Teller(event.Listener):
        told = False

        def on_start(self, event: Any) -> None:
            if not self.told:
                self.told = True
                print("impactsig: compiling for this machine, once (about 15 s)", file=sys.stderr)

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", Teller()):
        yield
