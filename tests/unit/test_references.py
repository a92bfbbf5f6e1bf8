"""Every work cited in a docstring stands in refs.bib, and every entry there is cited."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_citations_and_bibliography_agree():
    code = "\n".join(path.read_text() for path in (ROOT / "impactsig").rglob("*.py"))
    cited = set(re.findall(r"\[([A-Z]\w+)\]_", code))
    entries = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "refs.bib").read_text(), re.MULTILINE))
    assert cited
    assert cited == entries


def test_entries_stand_once_and_are_closed():
    entries = re.split(r"^(?=@)", (ROOT / "refs.bib").read_text(), flags=re.MULTILINE)[1:]
    keys = [entry.split("{", 1)[1].split(",", 1)[0] for entry in entries]
    assert len(keys) == len(set(keys))
    for key, entry in zip(keys, entries, strict=True):
        assert entry.count("{") == entry.count("}"), key
        assert entry.rstrip().endswith("\n}"), key
