"""A claim of a paper, the call that tests it, and the page that shows what it gives."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

Verdict = Literal["agrees", "differs", "undecidable", "no record"]
"""No record: a claim about an experiment of which the text keeps no data."""


class Found(NamedTuple):
    """What a call gave, and whether it is what the paper says."""

    text: str
    holds: bool


class Outcome(NamedTuple):
    """Of a value of what the text lacks: the value, what the call gave, whether it holds there."""

    value: str
    text: str
    holds: bool


@dataclass(frozen=True)
class Row:
    """A claim and its test; `find` returns a `Found`, or the outcomes over what the text lacks."""

    place: str
    claim: str
    call: str
    verdict: Verdict
    why: str
    quick: bool
    find: Callable[[], Found | Sequence[Outcome]] | None

    def run(self) -> tuple[str, Verdict, float]:
        """What it gives, in words; the verdict that follows; and the processor time [s]."""
        if self.find is None:
            return "", "no record", 0.0
        start = time.process_time()
        found = self.find()
        spent = time.process_time() - start
        if isinstance(found, Found):
            return found.text, "agrees" if found.holds else "differs", spent
        text = "; ".join(f"{one.value}: {one.text}" for one in found)
        seen = {one.holds for one in found}
        if seen == {True, False}:
            return text, "undecidable", spent
        return text, "agrees" if seen == {True} else "differs", spent


@dataclass(frozen=True)
class Paper:
    """A paper: the name of its page, its key in refs.bib, and its rows.

    `figure` says what the map of the parameters that the text lacks shows, where there is one.
    """

    name: str
    key: str
    title: str
    note: str
    figure: str = ""
    rows: list[Row] = field(default_factory=list)

    def claims(
        self,
        place: str,
        claim: str,
        call: str,
        verdict: Verdict = "agrees",
        why: str = "",
        *,
        quick: bool = True,
    ) -> Callable[[Callable[[], Found | Sequence[Outcome]]], Callable]:
        """Make a row of the decorated function; all but "agrees" needs a reason."""
        if (verdict == "agrees") != (why == ""):
            raise ValueError(f"{self.name}, {place}: a reason where, and only where, it differs")

        def add(find: Callable[[], Found | Sequence[Outcome]]) -> Callable:
            self.rows.append(Row(place, claim, call, verdict, why, quick, find))
            return find

        return add

    def experiment(self, place: str, claim: str) -> None:
        """Add a claim about an experiment whose data the text does not keep."""
        why = "the text keeps no data of the experiment"
        self.rows.append(Row(place, claim, "", "no record", why, True, None))

    def page(self, results: Sequence[tuple[str, Verdict]]) -> str:
        """The page, in Markdown."""
        counts = {
            verdict: sum(verdict == one for _, one in results)
            for verdict in ("agrees", "differs", "undecidable", "no record")
        }
        told = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
        lines = [
            f"# {self.title}", "",
            f"`{self.key}` in refs.bib. {self.note}", "",
            f"{len(self.rows)} claims: {told}. Written by `python -m benchmarks.papers`.", "",
            *([f"![{self.figure}]({self.name}.svg)", ""] if self.figure else []),
            "| Where | What the paper says | Call | Result | Verdict |",
            "|---|---|---|---|---|",
        ]  # fmt: skip
        for row, (text, verdict) in zip(self.rows, results, strict=True):
            call = f"`{row.call}`" if row.call else "–"
            judged = f"**{verdict}**" + (f": {row.why}" if row.why else "")
            cells = (row.place, row.claim, call, text or "–", judged)
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        return "\n".join(lines) + "\n"
