# SPDX-License-Identifier: MIT
"""The command that shows again what others have found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import symkin
from symkin.cli.console import Telling, print_result
from symkin.cli.options import argument, command, folder_of
from symkin.results import Result
from symkin.storage.output_files import OutputFiles

_FILES = ("results.json", "report.html")


@command("symkin run 3RRR --out out", "symkin show out --units inch")
def show(
    *,
    result: Annotated[
        Path,
        argument("RESULT", "A folder of --out, or the JSON file in it."),
    ],
    out: Annotated[Path | None, folder_of("results.json and report.html")] = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Show again what a command has found, as text, as a page or in other units.

    Nothing is read but the result's own file, which may come from another machine. Results of all
    commands that write JSON can be shown, and those of `save` in Python.
    """
    with OutputFiles([result], overwrite) as outputs:
        found: Result = symkin.read_result(result)
        if out is not None:
            target = outputs.folder(out, *_FILES)
            found.save(target / _FILES[0])
            if telling.report:
                found.report(target / _FILES[1])
    print_result(found, telling, out, _FILES)
