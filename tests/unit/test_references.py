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
