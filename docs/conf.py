# SPDX-License-Identifier: MIT
"""Sphinx configuration; `make docs` builds into build/docs."""

import json
import os
import re
import sys
from pathlib import Path

import nbformat
from myst_nb.core.read import read_myst_markdown_notebook
from numpydoc.xref import DEFAULT_LINKS

import symkin

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(Path(__file__).parent))  # gallery.py, mathml.py
# What editors complete and check mechanism files with, beside the page that links to it.
SCHEMA = ROOT / "build" / "schema" / "mechanism.schema.json"
SCHEMA.parent.mkdir(parents=True, exist_ok=True)
SCHEMA.write_text(json.dumps(symkin.mechanism_schema(), indent=1) + "\n", encoding="utf-8")

# The notebooks as Jupyter reads them, which their pages offer below the title.
NOTEBOOKS = ROOT / "build" / "notebooks"
NOTEBOOKS.mkdir(parents=True, exist_ok=True)
for page in (ROOT / "docs" / "notebooks").glob("*.md"):
    notebook = read_myst_markdown_notebook(page.read_text(encoding="utf-8"))
    nbformat.write(notebook, NOTEBOOKS / f"{page.stem}.ipynb")

project = "symkin"
author = "symkin contributors"
copyright = "symkin contributors, MIT licence"
release = re.search(
    r"project\(\s*symkin\s+VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
).group(1)

exclude_patterns = ["figures/*.md"]  # included by pages
extensions = [
    "gallery",
    "mathml",
    "matplotlib.sphinxext.plot_directive",
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
]

html_math_renderer = "mathml"
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# Backticks in a docstring link to what is documented, and are code otherwise.
default_role = "py:obj"
# Fields are told in the docstring's section Attributes; members are methods and properties.
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "none"
maximum_signature_line_length = 80
numpydoc_show_class_members = False
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"
# Names of this package are linked; those of others stay words.
documented = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs/api").glob("*.md"))
numpydoc_xref_aliases = {name: name for name in DEFAULT_LINKS} | {
    full.rpartition(".")[2]: full for full in re.findall(r":: (symkin\.[\w.]+)", documented)
}

nb_execution_in_temp = True
nb_merge_streams = True
nb_execution_raise_on_error = True
nb_execution_timeout = 180  # s, for a cell on a machine that is busy
os.environ["PLOTLY_RENDERER"] = "notebook"  # in the page, which then loads nothing

plot_formats = ["svg"]
plot_html_show_formats = False
plot_html_show_source_link = False

html_theme = "furo"
html_title = f"symkin {release}"
html_copy_source = False
html_show_sphinx = False
html_static_path = ["_static"]
html_extra_path = [str(SCHEMA.parent)]
html_css_files = ["wide.css"]


def offer_notebook(_, name, source):
    """Link a page of `notebooks` to what Jupyter reads."""
    folder, _, stem = name.rpartition("/")
    if folder == "notebooks":
        link = f"{{download}}`{stem}.ipynb <../../build/notebooks/{stem}.ipynb>`"
        below = rf"\1\n\nAs a Jupyter notebook: {link}"
        source[0] = re.sub(r"^(# .*)$", below, source[0], count=1, flags=re.M)


def load_nothing(*event):
    """Leave out the formulas' script that plotly would load; its views here have no formulas."""
    context = event[3]
    script = r'<script [^>]*src="https://[^"]*mathjax[^"]*"[^>]*></script>'
    context["body"] = re.sub(script, "", context.get("body", ""))


def setup(app):
    """Connect what this configuration adds."""
    app.connect("source-read", offer_notebook)
    app.connect("html-page-context", load_nothing)
