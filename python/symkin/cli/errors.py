# SPDX-License-Identifier: MIT
"""Errors as one sentence and an exit code."""

from __future__ import annotations

import contextlib
import os
import sys
import traceback
from collections.abc import Callable
from typing import Any, NoReturn

import typer

from symkin.errors import FailedFitError, SymkinError, printable

__all__ = ["UsageError", "exit_code_of", "not_converged"]

_NOT_CONVERGED, _BAD_INPUT, _INTERRUPTED, _BROKEN_PIPE = 1, 2, 130, 141
_LONGEST = 500

# Which module holds it depends on typer's version.
UsageError: Any = typer.BadParameter.__mro__[1]


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
        _tell(f"Not converged: {error}")
        return _NOT_CONVERGED
    except Exception as error:
        if debug:
            traceback.print_exc()
        _tell(f"Error: {_sentence(error)}")
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


def _usage(error: Any) -> str:
    message = " ".join(error.format_message().split()).rstrip(".")
    message = message.removeprefix("Invalid value: ").replace("Value error, ", "")
    command = error.ctx.command_path if error.ctx is not None else "symkin"
    return f"{message} (see `{command} --help`)"


def _tell(message: str) -> None:
    """Print one line on stderr, without its middle if it is too long."""
    line = printable(" ".join(message.split()))
    if len(line) > _LONGEST:
        half = (_LONGEST - 5) // 2
        line = f"{line[:half]} ... {line[-half:]}"
    typer.echo(line, err=True)


def _drop_output() -> None:
    """Leave nothing that Python would fail to write at its end, and complain of."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
