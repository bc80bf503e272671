# SPDX-License-Identifier: MIT
"""What is printed: text, or one JSON document; progress on a terminal's stderr."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from symkin.errors import printable

__all__ = ["print_json", "progress", "say"]


def say(text: str = "") -> None:
    """Print lines, however long; what a terminal would obey is escaped."""
    for line in text.split("\n"):
        sys.stdout.write(f"{printable(line)}\n")


def print_json(document: Mapping[str, Any]) -> None:
    """Print the JSON document of a command, as a results file has it."""
    from symkin.io.results import results_text

    sys.stdout.write(results_text(document))


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Show what is being done, on stderr and only if it is a terminal; yields what to tell it."""
    if not sys.stderr.isatty():
        yield lambda _stage: None
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield status.update
