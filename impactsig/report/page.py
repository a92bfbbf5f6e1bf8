"""The report: one HTML file that works offline and runs only its own scripts."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from .._arguments import path
from .._files.atomic import atomic_path
from ..errors import InvalidInput
from ._template import page_of
from .analysing.analysis import Analysis, analyse
from .cards import tiles
from .contents import (
    channels_in_words,
    notes,
    parameters,
    printable,
    samples_held,
)
from .reproduction import command, python_lines
from .tables import download, table

ROWS_SHOWN = 20
"""Rows on paper, and where scripts do not run."""

LIMIT = 3_000_000
"""Bytes of a page at most; samples around impacts fill what the rest leaves."""

CONTROLS = (
    ("previous", "Previous impact"), ("next", "Next impact"), ("nearer", "Zoom in"),
    ("farther", "Zoom out"), ("earlier", "Earlier"), ("later", "Later"), ("whole", "Show all"),
)  # fmt: skip


def write_report(source_path: str | Path, output: str | Path | None = None, **options: Any) -> Path:
    """Analyse a recording and write the results as one HTML page.

    The page works offline. It has a summary in words, a zoomable waveform, the figures, the
    analysis of the intervals, a table of impacts, the parameters, the SHA-256 of the recording, and
    how to reproduce the result.

    Parameters
    ----------
    source_path : path-like
        The recording.
    output : path-like, optional
        The page, a name ending in .html or .htm; ``impactsig-report-NAME.html`` in the current
        folder by default.
    **options
        As for `impactsig.report.analyse`: forcing_period, dynamics, threshold, polarity,
        contact_level, contact_time, merge_within, dead_time, gaps, least_probability, channel,
        stops, separate_stops, start, stop, scale, offset, unit, rate, sensor, raw.

    Returns
    -------
    Path
        The page written.

    Raises
    ------
    InvalidInput, UnreadableFile
        If the recording cannot be analysed, or `output` has another extension; nothing is written
        in this case.
    UnwritableFile
        If the page cannot be written; an existing file is unchanged.

    See Also
    --------
    write_reports, detect_impacts

    Examples
    --------
    >>> import tempfile
    >>> from impactsig import write_report
    >>> recording = "data_samples/loadcell_periodic_22.1Hz_short.csv"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write_report(recording, f"{folder}/page.html")
    ...     print(page.name, page.stat().st_size < 3_000_000)
    page.html True
    """
    return analyse_to_page(source_path, output, **options)[1]


def analyse_to_page(
    source_path: str | Path, output: str | Path | None = None, **options: Any
) -> tuple[Analysis, Path]:
    """As `write_report`, but returns the analysis that the page shows."""
    name = path("source_path", source_path).name
    target = Path(f"impactsig-report-{name}.html") if output is None else path("output", output)
    if target.suffix.lower() not in (".html", ".htm"):
        raise InvalidInput(
            "output",
            target,
            "a name ending in .html or .htm",
            "A report is an HTML page; a browser prints it to PDF",
        )
    with atomic_path(target) as temporary:
        # Opened first: hours of analysis must not end at a folder that cannot be written.
        analysis = analyse(source_path, **options)
        temporary.write_text(render(analysis), encoding="utf-8")
    return analysis, target


def write_page(analysis: Analysis, output: str | Path) -> Path:
    """Write the page of an existing analysis; see `write_report`."""
    with atomic_path(output) as temporary:
        temporary.write_text(render(analysis), encoding="utf-8")
    return Path(output)


def render(analysis: Analysis) -> str:
    """The page as HTML text."""
    from . import figures, findings, interactive

    scripts = interactive.scripts()
    fill = page_of("page.html.j2", images="data: blob:", scripts=scripts, style=interactive.style())
    path = analysis.file.path
    said = dict(
        name=printable(Path(path).name),
        summary=printable(re.sub(r"(\d) (m?s)\b", "\\1\u00a0\\2", analysis.summary())),
        notes=notes(analysis),
        tiles=tiles(analysis),
        still=figures.waveform(analysis) if any(map(len, analysis.overviews)) else None,
        controls=CONTROLS,
        channels=channels_in_words(analysis),
        panels=[figures.waveform_in_words(analysis, one) for one in analysis.overviews],
        between=len(analysis.impacts.intervals()),
        stops=[(name, colour) for name, colour, _ in interactive.colours(analysis.impacts)],
        scripts=scripts,
        marked=len(interactive.marked(analysis.impacts)),
        impacts=analysis.impacts,
        pictures=list(figures.pictures(analysis)),
        findings=list(findings.findings(analysis)),
        verdict=findings.verdict(analysis),
        care=findings.care(analysis),
        table=table(analysis.impacts, ROWS_SHOWN),
        download=download(analysis.impacts, printable(Path(path).stem)),
        parameters=parameters(analysis),
        command=printable(command(analysis)),
        python=printable(python_lines(analysis)),
        made=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )
    rest = fill(**said, numbers="", samples_held=samples_held(analysis, 0))
    numbers, held = interactive.numbers(analysis, LIMIT - len(rest.encode()))
    return fill(**said, numbers=numbers, samples_held=samples_held(analysis, held))
