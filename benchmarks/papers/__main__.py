"""Run every claim of the papers, and fail where one no longer comes out as it is written down.

python -m benchmarks.papers              all of them; writes docs/papers
python -m benchmarks.papers --short      those of a few seconds; writes nothing
python -m benchmarks.papers tian okolewski
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import begley_virgin, karpodinis, okolewski, tian, van_der_pol_duffing
from .rows import Paper

PAPERS: tuple[Paper, ...] = tuple(
    module.PAPER for module in (karpodinis, begley_virgin, okolewski, tian, van_der_pol_duffing)
)
PAGES = Path(__file__).parents[2] / "docs" / "papers"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--short", action="store_true", help="only the rows of a few seconds")
    parser.add_argument("papers", nargs="*", help="names of pages; all of them by default")
    asked = parser.parse_args()
    known = [paper.name for paper in PAPERS]
    if wrong := set(asked.papers) - set(known):
        parser.error(f"no page {', '.join(sorted(wrong))}; there are {', '.join(known)}")
    changed = 0
    for paper in PAPERS:
        if asked.papers and paper.name not in asked.papers:
            continue
        results = []
        for row in paper.rows:
            if asked.short and not row.quick:
                continue
            text, verdict, spent = row.run()
            results.append((text, verdict))
            same = verdict == row.verdict
            changed += not same
            mark = "" if same else f"  <-- is written down as: {row.verdict}"
            print(f"{paper.name}, {row.place}: {verdict} [{spent:.1f} s] {text}{mark}", flush=True)
        if not asked.short:
            PAGES.mkdir(exist_ok=True)
            (PAGES / f"{paper.name}.md").write_text(paper.page(results), encoding="utf-8")
    print(f"{changed} claims come out otherwise than written down" if changed else "all as written")
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
