# SPDX-License-Identifier: MIT
"""``symkin run``."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.errors import not_converged
from symkin.cli.help import with_example
from symkin.cli.options import (
    CandidatesOption,
    CriterionOption,
    DesignOption,
    EstimatorOption,
    JsonOption,
    MarginSigmasOption,
    MechanismArgument,
    MethodOption,
    OverwriteOption,
    PoseCountOption,
    PoseUseOption,
    RowsOption,
    SeedOption,
)
from symkin.io.output_files import OutputFiles
from symkin.pipeline import ProtocolResult

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism


@with_example("symkin run 3RRR --out out")
def run(
    mechanism: MechanismArgument,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all files of the run.")],
    estimator: EstimatorOption = "implicit",
    use: PoseUseOption = "all",
    design: DesignOption = "legs",
    rows: RowsOption = "noise_aware",
    criterion: CriterionOption = "O1",
    method: MethodOption = "exchange",
    pose_count: PoseCountOption = None,
    candidates: CandidatesOption = None,
    margin_sigmas: MarginSigmasOption = 3.0,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run the whole protocol on a simulated robot and write a report.

    Writes plan.csv, measurements.csv, actual.toml (the simulated robot), calibrated.toml,
    results.json and report.html. The last line printed is the report's path.
    """
    with progress() as stage:
        stage("reading the mechanism")
        nominal = _with_protocol(symkin.load_mechanism(mechanism), pose_count, candidates)
        with OutputFiles([nominal.source], overwrite) as outputs:
            target = outputs.folder(out, *ProtocolResult.FILES)
            result = symkin.run_protocol(
                nominal,
                estimator=estimator,
                poses=use,
                design=design,
                rows=rows,
                criterion=criterion,
                method=method,
                margin_sigmas=margin_sigmas,
                seed=seed,
                progress=stage,
            )
            stage("writing the report")
            result.write(target)
    if as_json:
        print_json(result.to_dict())
    else:
        say(result.text())
        say(f"\n{out / 'report.html'}")
    if not result.identification.converged:
        not_converged(result.identification.failure)


def _with_protocol(
    mechanism: Mechanism, pose_count: int | None, candidates: int | None
) -> Mechanism:
    given = {"pose_count": pose_count, "candidates": candidates}
    changes = {name: value for name, value in given.items() if value is not None}
    if not changes:
        return mechanism
    return mechanism.replace(protocol=dataclasses.replace(mechanism.protocol, **changes))
