"""How Sphinx builds the site: `python -m sphinx -W --keep-going docs build/site`."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from docutils.nodes import Node, TextElement
from pages import write_api, write_bibliography, write_gallery
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

import impactsig

# `impactsig.scenes` is a name for a module that lies elsewhere; autodoc imports by name.
sys.modules |= {f"impactsig.{name}": getattr(impactsig, name) for name in ("scenes", "flows")}

project = "impactsig"
author = "the impactsig developers"
version = release = impactsig.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_nb",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx-mathjax-offline",
]
exclude_patterns = ["_templates", "**/.ipynb_checkpoints"]
default_role = "py:obj"

write_bibliography()
write_gallery()
autosummary_filename_map = write_api()
autosummary_generate = True
suppress_warnings = ["ref.citation"]  # works cited in private modules; test_references checks all
autodoc_typehints = "none"  # numpydoc's sections say what each parameter is
numpydoc_show_class_members = False  # the template lists them
templates_path = ["_templates"]

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "cache"  # how-to pages run; the notebooks are run by .ci/notebooks.py
nb_execution_excludepatterns = ["docs/generated/notebooks/*"]
nb_execution_raise_on_error = True
nb_execution_timeout = 900
nb_merge_streams = True
nb_output_stderr = "remove"  # progress bars
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "pydata_sphinx_theme"
html_title = "impactsig"
html_theme_options = {
    "header_links_before_dropdown": 7,
    "show_prev_next": False,
    "navigation_with_keys": True,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": [],
    "footer_end": [],
}
html_static_path = ["_static"]
html_css_files = ["wide.css"]
html_sidebars = {"start": [], "index": []}


def setup(app: Sphinx) -> None:
    """Docstrings name things as `impactsig` does, also those of `impactsig.results`."""
    app.connect("missing-reference", _public_name)


def _public_name(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, content: TextElement
) -> Node | None:
    if node.get("refdomain") != "py":
        return None
    domain, page, name = env.get_domain("py"), node["refdoc"], node["reftarget"]
    for path in (f"impactsig.{name}", f"impactsig.results.{name}"):
        found = domain.resolve_xref(env, page, app.builder, "obj", path, node, content)
        if found is not None:
            return found
    return None
