# SPDX-License-Identifier: MIT
"""Which symkin this is."""

from __future__ import annotations

import functools


@functools.cache
def version() -> str:
    """Return the version of the package that is installed."""
    from importlib import metadata  # which takes long to import

    try:
        return metadata.version("symkin")
    except metadata.PackageNotFoundError:  # run from the source tree
        return ""
