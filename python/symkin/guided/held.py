# SPDX-License-Identifier: MIT
"""A folder that one process at a time measures in, for as long as it has a session of it."""

from __future__ import annotations

import weakref
from contextlib import ExitStack
from pathlib import Path

from symkin.storage.output_files import only_one

_LOCK = "lock"
_OF_THIS_PROCESS: weakref.WeakValueDictionary[Path, Held] = weakref.WeakValueDictionary()


class Held:
    """Lets the folder go when nobody has it any more."""

    def __init__(self, folder: Path) -> None:
        kept = ExitStack()
        busy = (
            f"{folder}: another symkin measures there; end it first, or append rows to its "
            "measured.csv"
        )
        kept.enter_context(only_one(folder / _LOCK, busy))
        weakref.finalize(self, kept.close)


def held(folder: Path) -> Held:
    """Hold a folder, as other sessions of this process may do already.

    Raises
    ------
    SymkinError
        If another process holds it, or nothing can be written there.
    """
    place = folder.resolve()
    found = _OF_THIS_PROCESS.get(place)
    if found is None:
        found = _OF_THIS_PROCESS[place] = Held(folder)
    return found
