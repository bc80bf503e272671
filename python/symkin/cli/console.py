# SPDX-License-Identifier: MIT
"""What is printed: text, or one JSON document; progress on a terminal's stderr."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from symkin.errors import printable

if TYPE_CHECKING:
    from symkin.result import Result


def say(text: str = "") -> None:
    """Print lines, however long; what a terminal would obey is escaped."""
    for line in text.split("\n"):
        sys.stdout.write(f"{printable(line)}\n")


def print_json(document: Mapping[str, Any]) -> None:
    """Print the JSON document of a command, as a results file has it."""
    from symkin.io.results import results_text

    sys.stdout.write(results_text(document))


def print_result(
    result: Result,
    document: Mapping[str, Any] | None = None,
    *,
    as_json: bool,
    after: object = None,
    whole: bool = False,
) -> None:
    """Print what there is to say of a result and, after it, a line; or its JSON document alone."""
    if as_json:
        print_json(result.to_dict() if document is None else document)
        return
    say(result.text(whole=whole))
    if after is not None:
        say(f"\n{after}")


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Show what is being done, on stderr and only if it is a terminal; yields what to tell it."""
    if not sys.stderr.isatty():
        yield lambda _stage: None
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield status.update


@contextmanager
def progress_bar() -> Iterator[Callable[[str, float], None]]:
    """Show what is being done, which share of it is done, and how long the rest may take.

    On stderr and only if it is a terminal; yields what to tell it.
    """
    if not sys.stderr.isatty():
        yield lambda _doing, _share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), Remaining()
    # Chunks are far apart: the rate is that of many of them.
    with Progress(*columns, console=Console(stderr=True), speed_estimate_period=600) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda doing, share: bar.update(task, description=doing, completed=share)
