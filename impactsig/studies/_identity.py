"""Identity of a study: its parameters, its seed and the code of its function."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ._cells import Job, name_of
from ._grid import Grid, tile_shape
from ._store import Store
from .fingerprint import DIGITS, digest, digest_of

READABLE = 80
"""Characters of a bound value up to which it is shown in full."""


def identity_of(job: Job, grid: Grid, code: dict[str, str]) -> dict[str, Any]:
    """Identity of a study, as text for its store."""
    return {
        "function": name_of(job.function),
        "vectorized": job.vectorized,
        "seed": job.key,
        "parameters": {
            name: f"{_brief(values)} ({values.dtype}, {digest(values.tobytes())})"
            for name, values in grid.axes.items()
        },
        "order": list(grid.axes),
        "bound": _bound(job.function),
        "code": code,
    }


def _bound(function: Any) -> dict[str, str]:
    """Values that a partial or a dataclass holds besides the parameters, in words if short."""
    held: dict[str, Any] = {}
    if isinstance(function, functools.partial):
        held = {f"argument {n}": value for n, value in enumerate(function.args)}
        held |= function.keywords
    elif dataclasses.is_dataclass(function):
        held = {one.name: getattr(function, one.name) for one in dataclasses.fields(function)}
    flat: dict[str, Any] = {}
    for name, value in held.items():
        flat |= value if isinstance(value, Mapping) else {name: value}
    return {str(name): _shown(value) for name, value in flat.items()}


def _shown(value: Any) -> str:
    plain = value is None or isinstance(value, (bool, int, float, str, tuple))
    return repr(value) if plain and len(repr(value)) <= READABLE else digest_of(value)


def _brief(values: np.ndarray) -> str:
    if len(values) == 1:
        return f"{values[0]:.12g}"
    return f"{len(values)} values from {values[0]:.12g} to {values[-1]:.12g}"


def refuse_other(store: Store, identity: dict[str, Any], tile: int | None) -> None:
    """Refuse to resume another study, and say how it differs.

    Raises
    ------
    InvalidInput
        Unless parameters, code, seed and tiles are those of the study in the store.
    """
    then, now = store.identity, identity
    other = [
        f"{name} ({_parameter(before, after)})"
        for name, before, after in _differing(then["parameters"], now["parameters"])
    ]
    if not other and then["order"] != now["order"]:
        other.append(f"order of parameters ({', '.join(then['order'])} there)")
    for kind, label in (("bound", ""), ("code", "code: ")):
        other += [
            f"{label}{name} ({_part(before, after)})"
            for name, before, after in _differing(then[kind], now[kind])
            # What is bound to the function is part of its code, which the message names already.
            if name != "function" or kind == "bound" or then["bound"] == now["bound"]
        ]
    other += [
        f"{name} ({then[name]} there, {now[name]} here)"
        for name in ("function", "vectorized", "seed")
        if then[name] != now[name]
    ]
    if tile is not None and store.tiling.block != tile_shape(store.tiling.grid.shape, tile):
        other.append(f"tile (blocks of {store.tiling.block} there)")
    if other:
        raise InvalidInput(
            "directory",
            store.directory,
            f"the directory of this very study; in it differ: {'; '.join(other)}",
            "Give another directory, or call as before to go on with that study",
        )


def _differing(
    then: Mapping[str, str], now: Mapping[str, str]
) -> list[tuple[str, str | None, str | None]]:
    """Names whose values differ, with both; None where there is none."""
    names = sorted(then.keys() | now.keys())
    pairs = [(name, then.get(name), now.get(name)) for name in names]
    return [one for one in pairs if one[1] != one[2]]


def _parameter(then: str | None, now: str | None) -> str:
    there, here = (one.rpartition(" (")[0] if one else "none" for one in (then, now))
    return "other values" if there == here else f"{there} there, {here} here"


def _part(then: str | None, now: str | None) -> str:
    """A part in words, with its value or version; a digest would say nothing to a reader."""
    digests = {len(one) == DIGITS and one.isalnum() for one in (then, now) if one}
    if True not in digests:
        return f"{then or 'none'} there, {now or 'none'} here"
    return "changed" if then and now else "no longer used" if then else "new"
