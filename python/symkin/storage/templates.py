# SPDX-License-Identifier: MIT
"""Templates of files, from a folder of the package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import jinja2


def templates_of(folder: Path) -> jinja2.Environment:
    """Templates whose values must all be given, and are escaped but in TOML."""
    import jinja2  # which takes a while

    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=lambda name: name is None or not name.endswith(".toml"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
