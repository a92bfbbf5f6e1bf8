"""Read and write trains of impacts as CSV, as Parquet, and packed."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import fields
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._files.atomic import atomic_path
from .._running.watched import progress
from ..errors import MissingExtra, UnreadableFile
from .impact_columns import COLUMNS, columns

if TYPE_CHECKING:
    from ..impacts import Impacts

ROWS = 10_000  # that are written at a time
PACKED = "<f8"
HEAD = "# impactsig "
"""Begins the line that holds the run."""


def write_csv(impacts: Impacts, path: Any) -> None:
    """As `Impacts.to_csv`."""
    if hasattr(path, "write"):
        path.write(f"{HEAD}{json.dumps(_run(impacts), ensure_ascii=True)}\n")
        table = columns(impacts)
        path.write(",".join(table) + "\n")
        rows = zip(*(map(repr, values.tolist()) for values in table.values()), strict=True)
        with progress(len(impacts), " rows", leave=False) as advance:
            while part := [",".join(row) + "\n" for row in islice(rows, ROWS)]:
                path.writelines(part)
                advance(len(part))
        return
    with (
        atomic_path(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        write_csv(impacts, file)


def read_csv(kind: type[Impacts], path: Any) -> Impacts:
    """As `Impacts.read_csv`."""
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as file:
            head = file.readline()
            run = json.loads(head[len(HEAD) :]) if head.startswith(HEAD) else {}
            file.seek(0)
            lines = (line.partition("#")[0] for line in file)
            names, *rows = csv.reader(line for line in lines if line.strip())
            cells = zip(*((cell.strip() for cell in row) for row in rows), strict=True)
            table = dict(zip(names, cells, strict=True)) if rows else dict.fromkeys(names, ())
    except (OSError, ValueError, csv.Error) as error:
        raise UnreadableFile(path, f"not a table of impacts ({error})") from error
    return _made(kind, path, {name: np.array(cells) for name, cells in table.items()}, run)


def write_parquet(impacts: Impacts, path: Any) -> None:
    """As `Impacts.to_parquet`."""
    arrow, parquet = _pyarrow()
    table = arrow.table(columns(impacts), metadata={"impactsig": json.dumps(_run(impacts))})
    with atomic_path(path) as temporary:
        parquet.write_table(table, temporary)


def read_parquet(kind: type[Impacts], path: Any) -> Impacts:
    """As `Impacts.read_parquet`."""
    arrow, parquet = _pyarrow()
    try:
        table = parquet.read_table(path)
        run = json.loads((table.schema.metadata or {}).get(b"impactsig", b"{}"))
    except (OSError, ValueError, arrow.ArrowException) as error:
        raise UnreadableFile(path, f"not a Parquet table of impacts ({error})") from error
    return _made(kind, path, {name: table[name].to_numpy() for name in table.column_names}, run)


def packed(impacts: Impacts) -> bytes:
    """A line of JSON, and the columns as numbers, written in less time than an npz is."""
    table = columns(impacts)
    head = {"columns": list(table), "count": len(impacts), "run": _run(impacts)}
    return json.dumps(head).encode() + b"\n" + np.array(list(table.values()), PACKED).tobytes()


def unpacked(kind: type[Impacts], path: Any, content: bytes) -> Impacts:
    """The impacts that `packed` has made bytes of; `path` is where these are from.

    Raises
    ------
    UnreadableFile
        If they are anything else.
    """
    try:
        line, _, numbers = content.partition(b"\n")
        head = json.loads(line)
        names, run = head["columns"], head["run"]
        table = np.frombuffer(numbers, PACKED).reshape(len(names), head["count"])
        return _made(kind, path, dict(zip(names, table, strict=True)), run)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        remedy = "Remove it, read again"
        raise UnreadableFile(path, f"not a table of impacts ({error})", remedy) from error


def _run(impacts: Impacts) -> dict[str, Any]:
    """The attributes of the run, in a form that JSON can hold."""
    names = (item.name for item in fields(impacts) if item.name not in COLUMNS)
    run = {name: getattr(impacts, name) for name in names}
    run["gaps"] = impacts.gaps.tolist()
    run["settings"] = dict(impacts.settings)
    run["recorded_at"] = impacts.recorded_at.isoformat() if impacts.recorded_at else None
    return run


def _made(
    kind: type[Impacts], path: Any, table: Mapping[str, np.ndarray], run: dict[str, Any]
) -> Impacts:
    if "time" not in table:
        raise UnreadableFile(path, f"no column 'time' among {list(table)}")
    names = {item.name for item in fields(kind)}
    try:
        values: dict[str, Any] = {
            name: table[name].astype(float) for name in COLUMNS if name in table
        }
        if "flags" in values:
            values["flags"] = table["flags"].astype(int)
        run = {key: value for key, value in run.items() if key in names}
        if run.get("recorded_at"):
            run["recorded_at"] = datetime.fromisoformat(run["recorded_at"])
        return kind(**values, **run)
    except (ValueError, TypeError, AttributeError) as error:
        raise UnreadableFile(path, f"not a table of impacts ({error})") from error


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingExtra("pyarrow", "parquet", "Parquet") from None
    return pyarrow, parquet
