# SPDX-License-Identifier: MIT
"""What readers of logs take and give."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from symkin.errors import SymkinError
from symkin.model.mechanism import Mechanism
from symkin.values import Value, field, record


@record
class Asked:
    """What is said beside a log.

    Attributes
    ----------
    mechanism : Mechanism or None
        The robot that was logged.
    beside : Log or None
        A second log of the same motion: what the encoders showed.
    radius : float or None
        How far from the middle a bed was probed, m.
    body : str
        Name of the rigid body that is the platform's; empty: the first.
    """

    mechanism: Mechanism | None = None
    beside: Log | None = None
    radius: float | None = None
    body: str = ""


@record
class Log:
    """A file, and its text."""

    path: Path
    data: bytes

    @cached_property
    def text(self) -> str:
        """As UTF-8 or, where that does not fit, Latin-1."""
        for encoding in ("utf-8-sig", "latin-1"):
            try:
                return self.data.decode(encoding)
            except UnicodeDecodeError:
                continue
        raise self.error("is no text")

    @cached_property
    def lines(self) -> list[str]:
        """Lines without what ends them."""
        return self.text.splitlines()

    def error(self, message: str) -> SymkinError:
        """An error about this file."""
        return SymkinError(f"{self.path}: {message}")


@record
class ImportedLog(Value):
    """What was measured, read from a log.

    Attributes
    ----------
    kind : str
        Title of the format.
    columns : mapping of str to array
        A table of measurements; empty if the log has none.
    mechanism : Mechanism or None
        The robot, if the log has its geometry.
    took, left : tuple of str
        What was taken from the log, and what was left in it.
    """

    kind: str
    columns: Mapping[str, Any] = field(private=True)
    mechanism: Mechanism | None = field(private=True)
    took: tuple[str, ...]
    left: tuple[str, ...]


@record
class LogFormat:
    """A kind of log.

    Attributes
    ----------
    name, title : str
        In a word, and in words.
    recognises : callable
        Whether a file is one, by what it holds.
    read : callable
        What it says.
    """

    name: str
    title: str
    recognises: Callable[[Log], bool]
    read: Callable[[Log, Asked], ImportedLog]
