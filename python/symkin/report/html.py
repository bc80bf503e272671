# SPDX-License-Identifier: MIT
"""A page as HTML: one file that needs no other."""

from __future__ import annotations

import base64
import io
import re
from importlib import metadata
from pathlib import Path

import jinja2
from markupsafe import Markup, escape

from symkin.io.output_files import OutputFiles
from symkin.report.content import Image, Page, Table

__all__ = ["page_html", "summary_html", "write_page"]

_TEMPLATES = Path(__file__).parent / "templates"
_DOTS_PER_INCH = 160  # of the image
_PIXELS_PER_INCH = 108  # on the page


def write_page(page: Page, path: Path, *, overwrite: bool = False) -> Path:
    """Write a page.

    Parameters
    ----------
    page : Page
        What it says.
    path : Path
        The HTML file; its folder is made if it does not exist.
    overwrite : bool
        Whether a file that exists may be replaced.

    Returns
    -------
    Path
        The file.
    """
    text = page_html(page)
    with OutputFiles(overwrite=overwrite) as outputs:
        folder = outputs.folder(path.parent, path.name)
        (folder / path.name).write_text(text, encoding="utf-8")
    return path


def page_html(page: Page) -> str:
    """Return a page with everything in it: style, figures, symbols."""
    return _rendered("report.html", page)


def summary_html(page: Page) -> str:
    """Return title, verdict and the few numbers that matter, for a notebook."""
    return _rendered("summary.html", page)


def _rendered(template: str, page: Page) -> str:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["table"] = lambda part: isinstance(part, Table)
    environment.filters["symbols"] = _symbols
    environment.filters["drawn"] = _drawn
    text = environment.get_template(template).render(page=page, version=_version())
    # A file's name may have bytes that are no character.
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _symbols(text: str) -> Markup:
    """Set the subscripts of symbols such as ``G_M``; names such as ``base_radius`` stay."""
    return Markup(re.sub(r"\b([A-Zs])_(\w+)", r"\1<sub>\2</sub>", str(escape(text))))


def _drawn(image: Image) -> Markup:
    """The image as an element."""
    figure, buffer = image.draw(), io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DOTS_PER_INCH)
    address = "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
    width = round(_PIXELS_PER_INCH * figure.get_figwidth())
    alternative = escape(image.alternative)
    return Markup(f'<img src="{address}" alt="{alternative}" width="{width}">')


def _version() -> str:
    try:
        return metadata.version("symkin")
    except metadata.PackageNotFoundError:  # run from the source tree
        return ""
