"""Check the type of the result before a figure is drawn."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar

from ..errors import InvalidInput

Given = ParamSpec("Given")
Drawn = TypeVar("Drawn")


def checked(paint: Callable[Given, Drawn]) -> Callable[Given, Drawn]:
    """Refuse a first argument of another class than annotated.

    Classes are compared by name: those annotated are imported for type checkers only.

    Raises
    ------
    InvalidInput
        From the decorated function, if its first argument is of none of these classes.
    """
    first = next(iter(signature(paint).parameters.values()))
    kinds = str(first.annotation).split(" | ")

    @wraps(paint)
    def refusing(*given: Given.args, **options: Given.kwargs) -> Drawn:
        if given or first.name in options:
            refuse_others(first.name, given[0] if given else options[first.name], kinds)
        return paint(*given, **options)

    return refusing


def refuse_others(argument: str, value: Any, kinds: list[str]) -> None:
    """Refuse a value that is not an instance of one of the classes.

    Raises
    ------
    InvalidInput
        If so.
    """
    names = {base.__name__ for base in type(value).__mro__}
    if names.isdisjoint(kinds):
        drawn = hasattr(value, "plot") and hasattr(type(value), "plot")
        remedy = f"Its own method plot() draws a {type(value).__name__}" if drawn else ""
        article = "an" if kinds[0][0] in "AEIO" else "a"
        raise InvalidInput(argument, value, f"{article} {' or '.join(kinds)}", remedy)
