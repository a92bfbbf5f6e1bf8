"""Optional libraries, imported when they are first used."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from .errors import MissingExtra


def library(name: str, extra: str, use: str) -> Any:
    """Import a library, or raise an error that names the extra it comes with.

    Raises
    ------
    MissingExtra
        If it is not installed; `use` is what it is for.
    """
    root = logging.getLogger()
    handlers = root.handlers[:]
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtra(name, extra, use) from error
    finally:
        # Some libraries set up logging for the whole program.
        for added in set(root.handlers) - set(handlers):
            root.removeHandler(added)


@contextmanager
def quiet() -> Iterator[None]:
    """Silence the log and the warnings of a library, whose messages impactsig passes on itself."""
    disabled = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(disabled)
