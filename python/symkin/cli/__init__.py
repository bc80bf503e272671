# SPDX-License-Identifier: MIT
"""The command line: each command a thin layer over one public function."""

from __future__ import annotations

import contextlib
import functools
import io
import logging
import os
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import typer

from symkin.cli.console import exit_code_of
from symkin.cli.help import WHOLE_HELP, Commands
from symkin.cli.options import command, refuse_unless
from symkin.present import asked_by
from symkin.version import version as installed_version

_DEBUG, _HELP, _WHOLE = "--debug", "--help", "--help-all"

# Plain help starts faster than rich's, and pastes cleanly.
app = typer.Typer(
    cls=Commands,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
@command("symkin run 3RRR --out out")
def overview(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    debug: Annotated[  # noqa: ARG001  # taken out of the command line before it is read
        bool, typer.Option("--debug", help="Show where an error arose; with any command, anywhere.")
    ] = False,
) -> None:
    """Calibrate parallel robots: find their true dimensions from measured poses.

    \b
    A robot of yours, step by step:
      new, list, import   a file that describes it, or one that comes with symkin
      check               is it what you mean, and what can be found out
      pose-count, plan    how many poses to measure, and which
      measure             stand beside whoever measures, and say what comes next
      identify            find its dimensions, and say how far to trust them
      evaluate, accept    how good it is now, and whether it keeps a tolerance
      export, kinematics  for its controller

    Without a robot, run does all of it on a simulated one; simulate makes the measurements of a
    plan, simulate-device plays robot and device for measure. align says where a device stands;
    identify-batch and study are for many robots, compare for one that was calibrated twice. show
    tells again what any of them has found, from its --out.
    MECHANISM is a file, or the name of a mechanism that comes with symkin, such as 3RRR.

    A file that exists is replaced with --overwrite alone, and one that the command reads never is.
    Outputs appear whole or not at all.

    Help of a command has what is used every day; --help-all has all of it.

    Exit code: 0; 1 for a result that did not converge, or for rows out of reach (kinematics); 2 for
    an input that cannot be used.
    """  # noqa: D301  # a backspace alone tells typer to leave the lines that follow as they are
    if version:
        refuse_unless(context.invoked_subcommand is None, "--version goes without a command")
        typer.echo(f"symkin {installed_version()}")
    elif context.invoked_subcommand is None:
        raise typer.BadParameter("a command is missing")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line, by default the program's own, and return its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    debug = _DEBUG in given
    given = [argument for argument in given if argument != _DEBUG] or [_HELP]
    streams = _own_streams(debug) if arguments is None else contextlib.nullcontext()
    with streams, asked_by("command"):
        return exit_code_of(lambda: _run(given), debug)


def _run(given: Sequence[str]) -> Any:
    """Run a command line, whose errors are the caller's; what it returns may be an exit code."""
    if any(each == "" or re.fullmatch(r"--[a-z-]+=", each) for each in given):
        raise typer.BadParameter("an argument is empty, as of a variable without a value")
    try:
        known = {WHOLE_HELP: _WHOLE in given}
        plain = [_HELP if each == _WHOLE else each for each in given]
        return _command()(args=plain, prog_name="symkin", standalone_mode=False, obj=known)
    except SystemExit as ended:  # typer ends so for a closed pipe, by code 1, and completions
        if ended.code != 1:
            raise
        raise BrokenPipeError from ended


@functools.cache
def _command() -> Any:
    return typer.main.get_command(app)


@contextlib.contextmanager
def _own_streams(debug: bool) -> Iterator[None]:
    """Keep libraries off stderr, and let any character be printed to a stdout that may be closed.

    A caller in the same process has its own streams and filters.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            lasting = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115
            setattr(sys, name, lasting)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if debug:
        yield
        return
    logging.disable(logging.WARNING)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
