# SPDX-License-Identifier: MIT
"""A page: its content as one HTML file that needs no other, and its figures as PNG files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

import jinja2
from markupsafe import Markup, escape

from symkin.io.output_files import OutputFiles
from symkin.report.content import Image, Section, Summary

__all__ = ["render_page", "write_page"]

_TEMPLATES = Path(__file__).parent / "templates"


def write_page(
    summary: Summary, sections: Sequence[Section], path: Path, *, overwrite: bool = False
) -> Path:
    """Write a page and, beside it, the PNG files of its figures.

    Parameters
    ----------
    summary : Summary
        What stands on top.
    sections : sequence of Section
        What follows.
    path : Path
        The HTML file; its folder is made if it does not exist.
    overwrite : bool
        Whether files that exist may be replaced.

    Returns
    -------
    Path
        The HTML file.
    """
    figures = [figure for section in sections for figure in section.images]
    names = [f"{figure.name}.png" for figure in figures]
    page = render_page(summary, sections)
    with OutputFiles(overwrite=overwrite) as outputs:
        folder = outputs.folder(path.parent, *names, path.name)
        for name, figure in zip(names, figures, strict=True):
            (folder / name).write_bytes(figure.png)
        (folder / path.name).write_text(page, encoding="utf-8")
    return path


def render_page(summary: Summary, sections: Sequence[Section]) -> str:
    """Return a page as HTML with everything in it: style, figures, symbols."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["image"] = lambda part: isinstance(part, Image)
    environment.filters["symbols"] = _symbols
    template = environment.get_template("report.html")
    page = template.render(summary=summary, sections=sections, version=_version())
    # A file's name may have bytes that are no character.
    return page.encode("utf-8", "backslashreplace").decode("utf-8")


def _symbols(text: str) -> Markup:
    """Set the subscripts of symbols such as ``G_M``; names such as ``base_radius`` stay."""
    return Markup(re.sub(r"\b([A-Zs])_(\w+)", r"\1<sub>\2</sub>", str(escape(text))))


def _version() -> str:
    try:
        return metadata.version("symkin")
    except metadata.PackageNotFoundError:  # run from the source tree
        return ""
