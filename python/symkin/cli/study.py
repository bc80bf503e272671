# SPDX-License-Identifier: MIT
"""``symkin study``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from symkin.cli.console import print_result, progress_bar
from symkin.cli.option_values import accuracies_of
from symkin.cli.options import (
    AccuracyOption,
    JsonOption,
    OverwriteOption,
    SchedulerOption,
    WorkersOption,
    command,
)


def _builtin(incomplete: str) -> list[str]:
    from symkin.study import builtin_studies

    return [name for name in builtin_studies() if name.startswith(incomplete)]


@command(
    "symkin study protocols --accuracy 0.05mm --workers 2 --out studied",
    "symkin study --show protocols > mine.toml",
)
def study(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|FILE]",
            help="A study file, or a built-in study: paper, protocols, cost or symmetry.",
            autocompletion=_builtin,
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for the table, results.json, report.html and, while it runs, parts.",
        ),
    ] = None,
    show: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Print the file of a built-in study, to begin one's own with.",
            autocompletion=_builtin,
        ),
    ] = None,
    mechanism: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MECHANISM",
            help="Instead of those of the study; a file or a name. May be given several times.",
        ),
    ] = None,
    robots: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=10**7, help="In each cell, instead of the study's."),
    ] = None,
    accuracy: AccuracyOption = None,
    workers: WorkersOption = 1,
    scheduler: SchedulerOption = None,
    format: Annotated[  # noqa: A002  # the option's name
        Literal["csv", "parquet"], typer.Option(help="Of the table, a row a robot and cell.")
    ] = "csv",
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare protocols on the same simulated robots.

    A study is a TOML file of lists: mechanisms, designs, rows, criteria, estimators, numbers of
    poses, noise. Every combination is a cell; all cells have the same robots and the same noise.
    The same command continues a study that was killed, and adds robots to one that has fewer. The
    same seed gives the same table, byte for byte, on any number of processes or machines.
    """
    from symkin.study import StudyResult, builtin_text, load_study, run_study

    if show is not None:
        if name is not None or out is not None:
            raise typer.BadParameter(
                "prints a study; expected no other study and no --out", param_hint="--show"
            )
        sys.stdout.write(builtin_text(show))
        return
    if name is None:
        raise typer.BadParameter("a study is missing: expected its name or file, or --show NAME")
    if out is None:
        raise typer.BadParameter("is missing: expected a folder", param_hint="--out")
    definition = load_study(name)
    changes = {"mechanisms": tuple(mechanism) if mechanism else None, "robots": robots}
    definition = definition.replace(**{key: each for key, each in changes.items() if each})
    wanted = accuracies_of(accuracy)
    if accuracy and definition.kind != "accuracy":
        raise typer.BadParameter(
            f"goes with a study of accuracy, and {definition.name} is one of {definition.kind}",
            param_hint="--accuracy",
        )
    with progress_bar() as tell:
        result = run_study(
            definition,
            out,
            workers=workers,
            scheduler=scheduler,
            format=format,
            progress=tell,
            overwrite=overwrite,
        )
        if accuracy and isinstance(result, StudyResult):
            tell("looking for the cheapest protocol", 1.0)
            result = result.for_accuracy(*wanted)
        tell("writing the report", 1.0)
        report = result.write(out, overwrite=True)
    print_result(result, as_json=as_json, after=report)
