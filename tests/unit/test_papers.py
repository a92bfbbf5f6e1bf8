"""The pages of the papers: verdicts follow from what was found, and the pages are up to date."""

from __future__ import annotations

import pytest

from benchmarks.papers import __main__ as pages
from benchmarks.papers.rows import Found, Outcome, Paper


def paper(found, verdict="agrees", why=""):
    made = Paper("one", "Key", "A title", "A note.")
    made.claims("Fig. 1", "a claim", "call()", verdict, why)(lambda: found)
    return made


@pytest.mark.parametrize(
    ("found", "verdict"),
    [
        (Found("as it says", True), "agrees"),
        (Found("not so", False), "differs"),
        ([Outcome("1", "", True), Outcome("2", "", True)], "agrees"),
        ([Outcome("1", "", True), Outcome("2", "", False)], "undecidable"),
        ([Outcome("1", "", False), Outcome("2", "", False)], "differs"),
    ],
)
def test_the_verdict_follows_from_what_was_found(found, verdict):
    assert paper(found).rows[0].run()[1] == verdict


@pytest.mark.parametrize("verdict", ["differs", "undecidable"])
def test_a_verdict_other_than_agreement_needs_a_reason(verdict):
    with pytest.raises(ValueError, match="reason"):
        paper(Found("", False), verdict)


@pytest.mark.parametrize(("holds", "code"), [(True, 0), (False, 1)])
def test_a_claim_that_no_longer_agrees_fails_the_run(monkeypatch, capsys, holds, code):
    monkeypatch.setattr(pages, "PAPERS", (paper(Found("what it gave", holds)),))
    monkeypatch.setattr("sys.argv", ["papers", "--short"])
    assert pages.main() == code
    assert "what it gave" in capsys.readouterr().out


def test_every_claim_is_on_its_page_with_its_verdict():
    for own in pages.PAPERS:
        text = (pages.PAGES / f"{own.name}.md").read_text(encoding="utf-8")
        rows = [line for line in text.splitlines() if line.startswith("| ")][1:]
        assert len(rows) == len(own.rows)
        for row, line in zip(own.rows, rows, strict=True):
            assert row.claim.replace("|", "\\|") in line
            assert f"**{row.verdict}**" in line.rsplit(" | ", 1)[-1]
