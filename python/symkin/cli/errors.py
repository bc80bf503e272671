# SPDX-License-Identifier: MIT
"""Errors as one sentence and an exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any, NoReturn

import typer

from symkin.errors import FailedFitError, SymkinError

__all__ = ["UsageError", "exit_code_of", "not_converged"]

_NOT_CONVERGED, _BAD_INPUT, _INTERRUPTED, _BROKEN_PIPE = 1, 2, 130, 141

# Which module holds it depends on typer's version.
UsageError: Any = typer.BadParameter.__mro__[1]


def exit_code_of(program: Callable[[], Any]) -> int:
    """Run a program; say in one sentence on stderr what it could not use."""
    try:
        code = program()
        sys.stdout.flush()
    except UsageError as error:
        return _refuse(_usage(error))
    except BrokenPipeError:  # such as `symkin check 3RRR | head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _BROKEN_PIPE
    except FailedFitError as error:
        return _tell_not_converged(str(error))
    except SymkinError as error:
        return _refuse(str(error))
    except OSError as error:
        return _refuse(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except MemoryError:
        return _refuse("this needs more memory than there is; ask for fewer poses")
    except (typer.Abort, KeyboardInterrupt):
        return _INTERRUPTED
    return code if isinstance(code, int) else 0


def not_converged(which: str) -> NoReturn:
    """End the command whose result is there, but did not converge."""
    raise typer.Exit(_tell_not_converged(which))


def _tell_not_converged(which: str) -> int:
    typer.echo(f"Not converged: {which}", err=True)
    return _NOT_CONVERGED


def _refuse(message: str) -> int:
    typer.echo(f"Error: {' '.join(message.split())}", err=True)
    return _BAD_INPUT


def _usage(error: Any) -> str:
    message = " ".join(error.format_message().split()).rstrip(".")
    message = message.removeprefix("Invalid value: ").replace("Value error, ", "")
    command = error.ctx.command_path if error.ctx is not None else "symkin"
    return f"{message} (see `{command} --help`)"
