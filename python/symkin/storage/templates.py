# SPDX-License-Identifier: MIT
"""Templates of files, from a folder of the package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import jinja2


def templates_of(folder: Path) -> jinja2.Environment:
    """Templates of HTML and XML, whose values are escaped, and must all be given."""
    import jinja2  # which takes a while

    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
