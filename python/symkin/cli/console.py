# SPDX-License-Identifier: MIT
"""What is printed: text, or one JSON document; errors as one sentence and an exit code."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from symkin.cli.words import usage_words
from symkin.errors import FailedFitError, SymkinError, printable
from symkin.estimate.evidence.watching import unwatched_search, watched_search
from symkin.options import OPTIONS
from symkin.results import Result
from symkin.show.rendering import files_text
from symkin.storage.results_file import results_text, write_results
from symkin.values import record

_NOT_CONVERGED, _BAD_INPUT, _INTERRUPTED, _BROKEN_PIPE = 1, 2, 130, 141
_LONGEST = 500
_LONG = 1.0  # seconds, after which it is said what takes so long

JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON document instead of text.")
]

# Which module holds it depends on typer's version.
UsageError: Any = typer.BadParameter.__mro__[1]


@record
class Telling:
    """How a result is told: on the screen, and in a page."""

    verbose: Annotated[
        bool, typer.Option("--verbose", help="Print all sections of the page, with their tables.")
    ] = False
    report: Annotated[bool, typer.Option("--report/--no-report", help=OPTIONS["report"].help)] = (
        True
    )
    all_figures: bool = False
    as_json: JsonOption = False
    units: str = ""

    def of_files(self, names: Sequence[str]) -> list[str]:
        """Of these files, those that are written."""
        return [name for name in names if self.report or not name.endswith(".html")]


def say(text: object = "") -> None:
    """Print lines, however long; what a terminal would obey is escaped."""
    for line in str(text).split("\n"):
        sys.stdout.write(f"{printable(line)}\n")


def print_json(document: Mapping[str, Any]) -> None:
    """Print the JSON document of a command, as a results file has it."""
    sys.stdout.write(results_text(document))


def print_result(
    result: Result,
    telling: Telling,
    folder: Path | None,
    files: Sequence[str],
    document: Mapping[str, Any] | None = None,
) -> None:
    """Print what there is to say of a result, its files, the last on its own line; or its JSON."""
    if telling.as_json:
        print_json(result.document(document))
        return
    written: Sequence[str] = () if folder is None else telling.of_files(files)
    say(result.text(whole=telling.verbose, folder=str(folder or ""), files=written))
    if folder is None:
        return
    say(f"\n{files_text(written, str(folder))}")


def write_result(
    result: Result, telling: Telling, document: Mapping[str, Any], folder: Path, name: str
) -> None:
    """Write a result's JSON document and its page."""
    write_results(result.document(document), folder / f"{name}.json")
    if telling.report:
        result.report(folder / f"{name}.html")


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
def searching(stage: Callable[[str], None]) -> Iterator[None]:
    """Show the search for what is wrong once it takes long; Ctrl-C ends it, and not the command."""
    begun = time.monotonic()

    def tell(tried: int) -> None:
        if time.monotonic() - begun > _LONG:
            stage(
                f"looking for the cause: {tried} tried (Ctrl-C ends this, and keeps the estimate)"
            )

    with watched_search(tell):
        yield


@contextmanager
def kept(words: str) -> Iterator[None]:
    """Have Ctrl-C end this alone, and say so in words."""
    try:
        with unwatched_search():  # of one part, which Ctrl-C would end for it alone
            yield
    except KeyboardInterrupt:
        _tell(f"Interrupted: {words}")


def write_result_then_report(result: Any, folder: Path, telling: Telling, **how: Any) -> Telling:
    """Write a result's files, for which Ctrl-C waits, then its page, which it ends alone.

    Returns how the result is told then: without a page that was not drawn.
    """
    with _held_interrupts() as came:
        result.write(folder, report=False, **how)
    if not telling.report:
        return telling
    try:
        if came:
            raise KeyboardInterrupt
        result.write_report(folder)
    except KeyboardInterrupt:
        _tell("Interrupted: the page is not drawn; the other files are written")
        (folder / "report.html").unlink(missing_ok=True)
        return replace(telling, report=False)
    return telling


@contextmanager
def _held_interrupts() -> Iterator[list[int]]:
    """Have Ctrl-C wait; yields a list that is empty as long as it has not come."""
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return
    before = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield came
    finally:
        signal.signal(signal.SIGINT, before)


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


def exit_code_of(program: Callable[[], Any], debug: bool = False) -> int:
    """Run a program; say in one sentence on stderr what it could not use.

    With `debug`, the trace of the error comes before the sentence.
    """
    try:
        code = program()
        sys.stdout.flush()
    except (typer.Abort, KeyboardInterrupt):
        return _INTERRUPTED
    except BrokenPipeError:  # such as `symkin check 3RRR | head -1`
        _drop_output()
        return _BROKEN_PIPE
    except FailedFitError as error:
        _tell(f"Not converged: {error}", _longest(error))
        return _NOT_CONVERGED
    except Exception as error:
        if debug:
            traceback.print_exc()
        _tell(f"Error: {_sentence(error)}", _longest(error))
        _drop_output()
        return _BAD_INPUT
    return code if isinstance(code, int) else 0


def not_converged(which: str) -> NoReturn:
    """End the command whose result is there, but did not converge."""
    _tell(f"Not converged: {which}")
    raise typer.Exit(_NOT_CONVERGED)


def _sentence(error: Exception) -> str:
    if isinstance(error, UsageError):
        return _usage(error)
    if isinstance(error, SymkinError):
        return str(error)
    if isinstance(error, MemoryError):
        return "this needs more memory than there is; ask for fewer poses"
    if isinstance(error, OSError):
        return f"{error.filename}: {error.strerror}" if error.filename else str(error)
    return (
        f"unforeseen {type(error).__name__}: {error} (this is a fault of symkin: please report it "
        "with what --debug shows)"
    )


def _longest(error: Exception) -> int:
    """How many characters are told: a likely cause whole, and what is to be copied."""
    if not isinstance(error, SymkinError):
        return _LONGEST
    return (1 if error.likely_cause is None else 2) * _LONGEST + len(error.mapping)


def _usage(error: Any) -> str:
    command = error.ctx.command_path if error.ctx is not None else "symkin"
    return f"{usage_words(error)} (see `{command} --help`)"


def _tell(message: str, longest: int = _LONGEST) -> None:
    """Print one line on stderr, without its middle if it is too long."""
    line = printable(" ".join(message.split()))
    if len(line) > longest:
        half = (longest - 5) // 2
        line = f"{line[:half]} ... {line[-half:]}"
    typer.echo(line, err=True)


def _drop_output() -> None:
    """Leave nothing that Python would fail to write at its end, and complain of."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
