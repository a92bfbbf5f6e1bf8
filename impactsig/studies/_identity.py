"""What makes a study the same study: its parameters, its seed and the code it is made of."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InvalidInput
from ._cells import Job, name_of
from ._fingerprint import digest
from ._grid import Grid, tile_shape
from ._store import Store


def identity_of(job: Job, grid: Grid, code: dict[str, str]) -> dict[str, Any]:
    """What makes a study the same study."""
    return {
        "function": name_of(job.function),
        "vectorized": job.vectorized,
        "seed": job.key,
        "parameters": {
            name: f"{_brief(values)} ({values.dtype}, {digest(values.tobytes())})"
            for name, values in grid.axes.items()
        },
        "order": list(grid.axes),
        "code": code,
    }


def _brief(values: np.ndarray) -> str:
    if len(values) == 1:
        return f"{values[0]:.12g}"
    return f"{len(values)} values from {values[0]:.12g} to {values[-1]:.12g}"


def refuse_other(store: Store, identity: dict[str, Any], tile: int | None) -> None:
    """Refuse to go on with another study, and say what makes it another.

    Raises
    ------
    InvalidInput
        Unless parameters, code, seed and tiles are those of the study in the store.
    """
    then, now = store.identity, identity
    names = sorted(then["parameters"].keys() | now["parameters"].keys())
    other = [
        _parameter(name, then["parameters"].get(name), now["parameters"].get(name))
        for name in names
    ]
    if not any(other) and then["order"] != now["order"]:
        other.append(f"order of parameters ({', '.join(then['order'])} there)")
    other += [
        f"{name} ({then[name]} there, {now[name]} here)"
        for name in ("function", "vectorized", "seed")
        if then[name] != now[name]
    ]
    parts = sorted(then["code"].keys() | now["code"].keys())
    other += [_part(name, then["code"].get(name), now["code"].get(name)) for name in parts]
    if tile is not None and store.tiling.block != tile_shape(store.tiling.grid.shape, tile):
        other.append(f"tile (blocks of {store.tiling.block} there)")
    if any(other):
        raise InvalidInput(
            "directory",
            store.directory,
            f"the directory of this very study; in it differ: {'; '.join(filter(None, other))}",
            "Give another directory, or call as before to go on with that study",
        )


def _parameter(name: str, then: str | None, now: str | None) -> str:
    if then == now:
        return ""
    there, here = (one.rpartition(" (")[0] if one else "none" for one in (then, now))
    return f"{name} ({'other values' if there == here else f'{there} there, {here} here'})"


def _part(name: str, then: str | None, now: str | None) -> str:
    """A part of the code; versions are told, digests are not."""
    if then == now:
        return ""
    if then is None or now is None:
        return f"code: {name} ({'no longer used' if then else 'new'})"
    versions = max(len(then), len(now)) < 32
    return f"code: {name} ({f'{then} there, {now} here' if versions else 'changed'})"
