"""What can go wrong, as types: every message names the cause and the remedy."""

from __future__ import annotations

import os
from typing import Any


class ImpactsigError(Exception):
    """Base of every error this package raises on purpose.

    See Also
    --------
    InvalidInput, UnreadableFile, MissingExtra

    Examples
    --------
    >>> from impactsig import ImpactsigError, read
    >>> try:
    ...     read("absent.wav")
    ... except ImpactsigError as error:
    ...     print(type(error).__name__)
    UnreadableFile
    """


class InvalidInput(ImpactsigError, ValueError):
    """An argument that cannot be used.

    Parameters
    ----------
    argument : str
        Name of the argument.
    value : object
        The value received.
    required : str
        The requirement that it does not meet.
    remedy : str, optional
        How to correct it, if that is not obvious from `required`.

    See Also
    --------
    ImpactsigError, UnreadableFile

    Examples
    --------
    >>> from impactsig import InvalidInput
    >>> print(InvalidInput("rate", -1, "a positive number [Hz]"))
    rate: got -1; required: a positive number [Hz]
    """

    def __init__(self, argument: str, value: Any, required: str, remedy: str = "") -> None:
        self.argument, self.value, self.required, self.remedy = argument, value, required, remedy
        message = f"{argument}: got {shown(value)}; required: {required}"
        super().__init__(f"{message}. {remedy}" if remedy else message)

    def __reduce__(self) -> tuple[Any, ...]:
        """Keep the fields when the error crosses a process boundary."""
        return type(self), (self.argument, self.value, self.required, self.remedy)


def shown(value: Any) -> str:
    """Text of a value for a message, at most 80 characters."""
    try:
        text = os.fspath(value) if isinstance(value, os.PathLike) else value
        shown = text if isinstance(text, str) and text else repr(value)
    except Exception:  # a value's own methods may raise anything
        shown = f"<{type(value).__name__}>"
    return shown if len(shown) <= 80 else shown[:77] + "..."


class UnreadableFile(ImpactsigError, OSError):
    """A file that is missing, empty, truncated, corrupt or of no known format.

    Parameters
    ----------
    path : object
        The file.
    reason : str
        What is wrong with the file, with the position if known.
    remedy : str, optional
        How to correct it.

    See Also
    --------
    ImpactsigError, UnwritableFile

    Examples
    --------
    >>> from impactsig import UnreadableFile
    >>> print(UnreadableFile("beam.wav", "the file is empty", "record it again"))
    beam.wav: the file is empty. record it again
    """

    def __init__(self, path: Any, reason: str, remedy: str = "") -> None:
        self.path, self.reason, self.remedy = str(path), reason, remedy
        message = f"{path}: {reason}"
        super().__init__(f"{message}. {remedy}" if remedy else message)

    def __reduce__(self) -> tuple[Any, ...]:
        """Keep the fields when the error crosses a process boundary."""
        return type(self), (self.path, self.reason, self.remedy)


class UnwritableFile(UnreadableFile):
    """A file that cannot be written; nothing was left behind in its place.

    See Also
    --------
    ImpactsigError, UnreadableFile

    Examples
    --------
    >>> from impactsig import Impacts, UnwritableFile
    >>> try:
    ...     Impacts.from_times([0.1]).to_csv("absent folder/impacts.csv")
    ... except UnwritableFile:
    ...     print("nothing was left behind")
    nothing was left behind
    """


class MissingExtra(ImpactsigError, ImportError):
    """An optional library is not installed.

    Parameters
    ----------
    library : str
        The library that is missing.
    extra : str
        The extra of impactsig that installs it.
    purpose : str
        What it is needed for.

    See Also
    --------
    ImpactsigError

    Examples
    --------
    >>> from impactsig import MissingExtra
    >>> error = MissingExtra("nptdms", "daq", "reading TDMS files")
    >>> "impactsig[daq]" in str(error)
    True
    """

    def __init__(self, library: str, extra: str, purpose: str) -> None:
        self.library, self.extra, self.purpose = library, extra, purpose
        super().__init__(
            f"{purpose} needs {library}, which is not installed. "
            f'Install it with: python -m pip install "impactsig[{extra}]"'
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Keep the fields when the error crosses a process boundary."""
        return type(self), (self.library, self.extra, self.purpose)


class ImpactsigWarning(UserWarning):
    """Warning of what a result lacks or assumes, such as a channel left out or a file cut short.

    See Also
    --------
    ImpactsigError

    Examples
    --------
    >>> import warnings
    >>> from impactsig import ImpactsigWarning
    >>> warnings.simplefilter("error", ImpactsigWarning)  # stop where something was left out
    """
