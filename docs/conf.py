# SPDX-License-Identifier: MIT
"""Sphinx configuration; `make docs` builds into build/docs."""

import json
import re
import sys
from pathlib import Path

from numpydoc.xref import DEFAULT_LINKS

import symkin

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(Path(__file__).parent))  # mathml.py
# What editors complete and check mechanism files with, beside the page that links to it.
SCHEMA = ROOT / "build" / "schema" / "mechanism.schema.json"
SCHEMA.parent.mkdir(parents=True, exist_ok=True)
SCHEMA.write_text(json.dumps(symkin.mechanism_schema(), indent=1) + "\n", encoding="utf-8")

project = "symkin"
author = "symkin contributors"
copyright = "symkin contributors, MIT licence"
release = re.search(
    r"project\(\s*symkin\s+VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
).group(1)

exclude_patterns = ["figures/*.md"]  # included by pages
extensions = [
    "mathml",
    "matplotlib.sphinxext.plot_directive",
    "myst_parser",
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
