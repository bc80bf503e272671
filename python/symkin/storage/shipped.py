# SPDX-License-Identifier: MIT
"""Where the mechanism files are that come with symkin, and files as another machine knows them."""

from __future__ import annotations

import functools
from pathlib import Path


@functools.cache
def shipped_folder() -> Path:
    """Return the folder of the shipped mechanisms: in the package, or beside its sources."""
    package = Path(__file__).parents[1]
    installed = package / "mechanisms"
    return installed if installed.is_dir() else package.parents[1] / "mechanisms"


@functools.cache
def shipped_files() -> dict[str, Path]:
    """Return the files of the shipped mechanisms by name, those of declared legs among them."""
    return {path.stem: path for path in sorted(shipped_folder().rglob("*.toml"))}


def portable(path: Path) -> str:
    """Return a file as another machine may know it: a shipped name, the way from here, or its name.

    See `located`.
    """
    if path == shipped_files().get(path.stem):
        return path.stem
    own, here = path.resolve(), Path.cwd()
    return (own.relative_to(here) if own.is_relative_to(here) else Path(path.name)).as_posix()


def located(name: str) -> Path:
    """Return the file that `portable` told of."""
    return shipped_files().get(name, Path(name))
