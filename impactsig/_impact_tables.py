"""Impacts as tables: a column for each thing measured, and what is known of the run beside them."""

from __future__ import annotations

import json
from dataclasses import fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

from ._atomic import atomic_path
from ._impact_columns import COLUMNS, columns
from .errors import MissingExtra, UnreadableFile

if TYPE_CHECKING:
    import pandas as pd

    from .impacts import Impacts

HEAD = "# impactsig "
"""Begins the line that holds the run."""


def write_csv(impacts: Impacts, path: Any) -> None:
    """As `Impacts.to_csv`."""
    if hasattr(path, "write"):
        path.write(f"{HEAD}{json.dumps(_run(impacts), ensure_ascii=True)}\n")
        impacts.to_frame().to_csv(path, index=False, lineterminator="\n")
        return
    with (
        atomic_path(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        write_csv(impacts, file)


def read_csv(kind: type[Impacts], path: Any) -> Impacts:
    """As `Impacts.read_csv`."""
    import pandas as pd

    try:
        with Path(path).open(encoding="utf-8") as file:
            head = file.readline()
        run = json.loads(head[len(HEAD) :]) if head.startswith(HEAD) else {}
        # As text: Python's own conversion to float is exact, that of pandas is not.
        frame = pd.read_csv(path, comment="#", dtype=str)
    except (OSError, ValueError) as error:
        raise UnreadableFile(path, f"not a table of impacts ({error})") from error
    return _made(kind, path, _arrays(frame), run)


def write_parquet(impacts: Impacts, path: Any) -> None:
    """As `Impacts.to_parquet`."""
    arrow, parquet = _pyarrow()
    table = arrow.Table.from_pandas(impacts.to_frame(), preserve_index=False)
    note = {**(table.schema.metadata or {}), b"impactsig": json.dumps(_run(impacts)).encode()}
    with atomic_path(path) as temporary:
        parquet.write_table(table.replace_schema_metadata(note), temporary)


def read_parquet(kind: type[Impacts], path: Any) -> Impacts:
    """As `Impacts.read_parquet`."""
    arrow, parquet = _pyarrow()
    try:
        table = parquet.read_table(path)
        run = json.loads((table.schema.metadata or {}).get(b"impactsig", b"{}"))
    except (OSError, ValueError, arrow.ArrowException) as error:
        raise UnreadableFile(path, f"not a Parquet table of impacts ({error})") from error
    return _made(kind, path, _arrays(table.to_pandas()), run)


def write_npz(impacts: Impacts, path: Any) -> None:
    """As arrays, which are read again in a twentieth of the time that text takes."""
    import numpy as np

    run = np.array(json.dumps(_run(impacts)))
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(file, run=run, **columns(impacts))  # type: ignore[arg-type]


def read_npz(kind: type[Impacts], path: Any) -> Impacts:
    """What `write_npz` has written."""
    import numpy as np

    try:
        with np.load(path, allow_pickle=False) as file:
            values = dict(file.items())
        run = json.loads(str(values.pop("run")))
    except (OSError, ValueError, KeyError, BadZipFile) as error:
        raise UnreadableFile(path, f"not a table of impacts ({error})") from error
    return _made(kind, path, values, run)


def _run(impacts: Impacts) -> dict[str, Any]:
    """What is known of the run rather than of each impact, as JSON can hold it."""
    names = (item.name for item in fields(impacts) if item.name not in COLUMNS)
    run = {name: getattr(impacts, name) for name in names}
    run["gaps"] = impacts.gaps.tolist()
    run["settings"] = dict(impacts.settings)
    run["recorded_at"] = impacts.recorded_at.isoformat() if impacts.recorded_at else None
    return run


def _arrays(frame: pd.DataFrame) -> dict[str, Any]:
    return {str(name): frame[name].to_numpy() for name in frame}


def _made(kind: type[Impacts], path: Any, columns: Any, run: dict[str, Any]) -> Impacts:
    if "time" not in columns:
        raise UnreadableFile(path, f"no column 'time' among {list(columns)}")
    names = {item.name for item in fields(kind)}
    values: dict[str, Any] = {name: columns[name] for name in COLUMNS if name in columns}
    try:
        if "flags" in values:  # of CSV they are text
            values["flags"] = values["flags"].astype(int)
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
