"""How the values of options are parsed."""

from __future__ import annotations

import argparse
import math


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def period(text: str) -> float:
    """The period [s] of a positive frequency [Hz]."""
    hertz = number(text)
    if hertz <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive frequency [Hz]")
    return 1 / hertz


def stops(text: str) -> list[int | None]:
    """Index of the stop of each channel, or None."""
    words = [word.strip() for word in text.split(",")]
    if not all(word == "none" or word.isdecimal() for word in words):
        raise argparse.ArgumentTypeError(
            f'{text!r} is not a list of whole numbers or "none", such as 0,1'
        )
    return [None if word == "none" else int(word) for word in words]


def contact_level(text: str) -> float | str:
    """A level, or a share of the peak."""
    return text if text.rstrip().endswith("%") else number(text)


def threshold(text: str) -> float | str:
    """A level, or a multiple of the noise."""
    if text.endswith(("sigma", "sigmas", "σ")):
        return text
    try:
        return number(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f'{error}, nor noise levels such as "6 sigma"') from None
