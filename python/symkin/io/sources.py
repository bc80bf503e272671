# SPDX-License-Identifier: MIT
"""Getting at the bytes of a file that somebody named."""

from __future__ import annotations

import stat
from collections.abc import Callable
from pathlib import Path

from symkin.errors import SymkinError

__all__ = ["file_bytes"]


def file_bytes(path: Path, error: Callable[[str], SymkinError]) -> bytes:
    """Return what a regular file holds.

    Pipes and devices are refused, since they may never end.

    Parameters
    ----------
    path : Path
        The file.
    error : callable
        Makes the exception out of what is wrong with the file.

    Returns
    -------
    bytes
    """
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise error("is a directory, not a file")
        if not stat.S_ISREG(mode):
            raise error("is a device or a pipe; expected a regular file")
        data = path.read_bytes()
    except FileNotFoundError as missing:
        raise error("no such file") from missing
    except OSError as unreadable:
        raise error(f"cannot be read: {unreadable.strerror}") from unreadable
    except UnicodeError as unreadable:
        raise error("has a name that the system does not take") from unreadable
    if not data.strip():
        raise error("the file is empty")
    return data
