# SPDX-License-Identifier: MIT
"""What is printed: text and tables, or one JSON document; progress on a terminal's stderr."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from symkin.errors import printable

__all__ = ["print_json", "progress", "say", "show_legs", "show_table"]

_PIPE_WIDTH = 100


def say(text: str = "") -> None:
    """Print lines, however long; what a terminal would obey is escaped."""
    for line in text.split("\n"):
        sys.stdout.write(f"{printable(line)}\n")


def print_json(document: Mapping[str, Any]) -> None:
    """Print the JSON document of a command, as a results file has it."""
    from symkin.io.results import results_text

    sys.stdout.write(results_text(document))


def show_table(heading: Sequence[str], rows: Sequence[Sequence[str]], words: int = 1) -> None:
    """Print an aligned table after an empty line; the first columns are words, then numbers."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for number, name in enumerate(heading):
        table.add_column(name, justify="left" if number < words else "right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    console = _console()
    # A table that is too wide is better wrapped by the terminal than cut by rich.
    unbound = console.options.update(max_width=10_000)
    console.width = max(console.width, console.measure(table, options=unbound).maximum)
    say()
    console.print(table, highlight=False)


def show_legs(title: str, rows: Sequence[tuple[str, Sequence[str]]]) -> None:
    """Print a table with a column a leg; legs that do not fit beside the first ones go below."""
    labels = max(len(text) for text in [title, *(label for label, _ in rows)])
    cells = 2 + max(len("leg 1"), *(len(cell) for _, row in rows for cell in row))
    fitting = max(1, (_console().width - labels) // cells)
    count = len(rows[0][1])
    abreast = math.ceil(count / math.ceil(count / fitting))
    for first in range(0, count, abreast):
        legs = range(first, min(first + abreast, count))
        heading = [title, *(f"leg {leg + 1}" for leg in legs)]
        show_table(heading, [[label, *(row[leg] for leg in legs)] for label, row in rows])


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Show what is being done, on stderr and only if it is a terminal; yields what to tell it."""
    if not sys.stderr.isatty():
        yield lambda _stage: None
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield status.update


def _console() -> Any:
    from rich.console import Console

    # Made anew, since tests and callers may replace sys.stdout.
    return Console(width=None if sys.stdout.isatty() else _PIPE_WIDTH, markup=False)
