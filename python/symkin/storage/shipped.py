# SPDX-License-Identifier: MIT
"""Where the mechanism files are that come with symkin, and files as another machine knows them."""

from __future__ import annotations

import functools
from pathlib import Path

__all__ = ["located", "portable", "shipped_folder"]


@functools.cache
def shipped_folder() -> Path:
    """Return the folder of the shipped mechanisms: in the package, or beside its sources."""
    package = Path(__file__).parents[1]
    installed = package / "mechanisms"
    return installed if installed.is_dir() else package.parents[1] / "mechanisms"


def portable(path: Path) -> str:
    """Return a file as another machine may know it: a shipped name, the way from here, or its name.

    See `located`.
    """
    if path.parent == shipped_folder():
        return path.stem
    own, here = path.resolve(), Path.cwd()
    return (own.relative_to(here) if own.is_relative_to(here) else Path(path.name)).as_posix()


def located(name: str) -> Path:
    """Return the file that `portable` told of."""
    shipped = shipped_folder() / f"{name}.toml"
    return shipped if Path(name).name == name and shipped.is_file() else Path(name)
