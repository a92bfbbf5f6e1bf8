"""What all pages have in common: their template, style and policy."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Sequence
from functools import partial
from importlib import resources

from .. import __version__


def page_of(
    name: str, *, images: str = "", scripts: Sequence[str] = (), style: str = ""
) -> Callable[..., str]:
    """The template of a page, to be filled.

    Scripts run only if their hash stands in the policy: text that slipped in stays text.
    """
    from jinja2 import Environment, StrictUndefined

    parts = resources.files("impactsig.report")
    template = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    ).from_string((parts / name).read_text(encoding="utf-8"))
    policy = ["default-src 'none'", "base-uri 'none'", "form-action 'none'"]
    policy += [f"img-src {images}"] if images else []
    policy.append("style-src 'unsafe-inline'")
    policy += [f"script-src {' '.join(map(_hash, scripts))}"] if scripts else []
    style += (parts / "page.css").read_text(encoding="utf-8")
    return partial(template.render, policy="; ".join(policy), style=style, version=__version__)


def _hash(script: str) -> str:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return f"'sha256-{digest}'"
