# SPDX-License-Identifier: MIT
"""Words of a command line, as the system's own shell has them."""

from __future__ import annotations

import os
import re
import shlex

_WINDOWS = os.name == "nt"
_PLAIN = re.compile(r"[\w@+=:,./\\-]+")  # what no shell of Windows takes for something else


def typed_word(text: object) -> str:
    """A word as it is typed, in quotes where it needs them.

    Windows has double quotes alone, and backslashes that part folders.
    """
    word = str(text)
    if not _WINDOWS:
        return shlex.quote(word)
    return word if _PLAIN.fullmatch(word) else f'"{word}"'


def words_of(command: str) -> list[str]:
    """The words of a command line that was typed.

    Raises
    ------
    ValueError
        If a quotation has no end.
    """
    if not _WINDOWS:
        return shlex.split(command)
    if command.count('"') % 2:
        raise ValueError("No closing quotation")
    return [word.replace('"', "") for word in re.findall(r'(?:[^\s"]|"[^"]*")+', command)]
