"""The pages of the site that are made of something else: API, bibliography and gallery."""

from __future__ import annotations

import re
import shutil
import unicodedata
from pathlib import Path
from types import ModuleType

import impactsig

ROOT = Path(__file__).resolve().parents[1]
MADE = ROOT / "docs" / "generated"
ACCENTS = {'"': "\N{COMBINING DIAERESIS}", "'": "\N{COMBINING ACUTE ACCENT}"}
TITLES = {
    "Recordings and files": ("recording", "io"),
    "Impacts": ("impacts", "detect", "combining", "matching", "alignment", "calibration", "report"),
    "Intervals and periods": ("intervals",),
    "Geometry of the intervals": ("reconstruct",),
    "Machines": ("oscillators",),
    "Simulation": ("simulation",),
    "Orbits and diagrams": ("dynamics",),
    "Control": ("control",),
    "Noise": ("stochastic",),
    "Experiments": ("experiment",),
    "From measurement to model": (
        "identify",
        "fitting",
        "comparison",
        "reading_motion",
        "recorded",
    ),
    "Studies": ("studies",),
    "Errors": ("errors",),
}


def write_api() -> dict[str, str]:
    """Write the table of contents of the API; which files its pages get, where names collide."""
    home = {part: title for title, parts in TITLES.items() for part in parts}
    groups: dict[str, list[str]] = {title: [] for title in TITLES}
    modules: dict[str, ModuleType] = {}

    def add(path: str, value: object) -> None:
        """Under the title of the room it is from: a result stands beside what returns it."""
        groups[home[value.__module__.split(".")[1]]].append(path)

    for name in impactsig.__all__:
        value = getattr(impactsig, name)
        if value is impactsig.results:
            for inner in value.__all__:
                add(f"impactsig.{name}.{inner}", getattr(value, inner))
        elif isinstance(value, ModuleType):
            modules[name] = value
        else:
            add(f"impactsig.{name}", value)
    for name, module in modules.items():
        groups[f"`impactsig.{name}`"] = [
            f"impactsig.{name}.{inner}"
            for inner in module.__all__
            if inner not in impactsig.__all__
        ]
    lines = [
        "API",
        "===",
        "",
        "Functions and classes by subject. Functions return classes of ``impactsig.results``.",
        "",
    ]
    for title, names in groups.items():
        names.sort(key=lambda name: (name.split(".")[-1][0].isupper(), name))
        plain = title.replace("`", "``")
        lines += [plain, "-" * len(plain), "", ".. autosummary::", "   :toctree: api", ""]
        lines += [f"   {name}" for name in names] + [""]
    _write("api.rst", "\n".join(lines))
    names = [name for group in groups.values() for name in group]
    lower = [name.lower() for name in names]
    # On file systems that ignore case, `Surrogates` and `surrogates` would be one page.
    renamed = {
        name: f"{name}-class"
        for name in names
        if lower.count(name.lower()) > 1 and name.split(".")[-1][0].isupper()
    }
    # Of what has left the API, or is elsewhere in it, Sphinx would still make pages.
    pages = {renamed.get(name, name) for name in names}
    for page in (MADE / "api").glob("*.rst"):
        if page.stem not in pages:
            page.unlink()
    return renamed


def write_bibliography() -> None:
    """Write the works of refs.bib as the citations that docstrings refer to."""
    lines = [":orphan:", "", "References", "==========", ""]
    entries = re.split(r"^(?=@)", (ROOT / "refs.bib").read_text(), flags=re.MULTILINE)[1:]
    for entry in sorted(entries, key=lambda one: one.split("{")[1].lower()):
        key = entry.split("{", 1)[1].split(",", 1)[0]
        fields = {
            name: " ".join(_plain(value).split())
            for name, value in re.findall(
                r"^\s+(\w+)\s*=\s*\{(.*?)\},?\s*(?=^\s+\w+\s*=|^\})", entry, re.S | re.M
            )
        }
        lines += [f".. [{key}] {_cite(fields)}", ""]
    _write("references.rst", "\n".join(lines[2:]))


def _plain(value: str) -> str:
    value = re.sub(r"[{}]", "", value).replace("\\o", "ø").replace("--", "–")
    value = re.sub(r"\\([\"'])(\w)", lambda m: m[2] + ACCENTS[m[1]], value)
    return unicodedata.normalize("NFC", value.replace("\\", ""))


def _cite(fields: dict[str, str]) -> str:
    where = fields.get("journal") or fields.get("booktitle") or fields.get("school")
    where = where or fields.get("publisher")
    parts = [
        fields.get("author", "").replace(" and ", "; "),
        f"*{fields['title'].strip('[]')}*",
        " ".join(filter(None, [where, fields.get("volume")])),
        fields.get("pages"),
        fields.get("year"),
    ]
    return ", ".join(part for part in parts if part) + "."


def write_gallery() -> None:
    """Copy the notebooks: as `.ci/notebooks.py` ran them where it has, else without outputs."""
    shutil.rmtree(MADE / "notebooks", ignore_errors=True)
    (MADE / "notebooks").mkdir(parents=True)
    lines = ["# Notebooks", "", "```{toctree}", ":maxdepth: 1", ""]
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        ran = ROOT / "build" / "notebooks" / path.name
        shutil.copy(ran if ran.exists() else path, MADE / "notebooks" / path.name)
        lines.append(f"notebooks/{path.stem}")
    _write("gallery.md", "\n".join([*lines, "```", ""]))


def _write(name: str, text: str) -> None:
    """Leave a page alone that has not changed: Sphinx reads again what has."""
    MADE.mkdir(parents=True, exist_ok=True)
    path = MADE / name
    if not path.exists() or path.read_text() != text:
        path.write_text(text)
