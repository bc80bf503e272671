# SPDX-License-Identifier: MIT
"""Which symkin this is."""

from __future__ import annotations

import functools
from importlib import metadata

__all__ = ["version"]


@functools.cache
def version() -> str:
    """Return the version of the package that is installed."""
    try:
        return metadata.version("symkin")
    except metadata.PackageNotFoundError:  # run from the source tree
        return ""
