# SPDX-License-Identifier: MIT
"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from symkin.identification.estimate import Estimator, PoseUse
from symkin.observability import RowKind
from symkin.planning import Design
from symkin.planning.selection import Criterion, SelectionMethod

__all__ = [
    "CandidatesOption",
    "ColumnsOption",
    "CriterionOption",
    "DesignOption",
    "EstimatorOption",
    "JsonOption",
    "MarginSigmasOption",
    "MechanismArgument",
    "MethodOption",
    "OptionalEstimatorOption",
    "OverwriteOption",
    "PoseCountOption",
    "PoseUseOption",
    "RowsOption",
    "SeedOption",
    "ThreadsOption",
]


def _shipped(incomplete: str) -> list[str]:
    """What completes a mechanism's name, besides the shell's own files."""
    from symkin.io.mechanism_file import shipped_mechanisms

    return [name for name in shipped_mechanisms() if name.startswith(incomplete)]


MechanismArgument = Annotated[
    str,
    typer.Argument(
        metavar="MECHANISM",
        help="A mechanism file, or the name of a shipped one (see `symkin list`).",
        autocompletion=_shipped,
        show_default=False,
    ),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON document instead of text.")
]
SeedOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=0,
        max=2**63 - 1,
        help="Of all that is random; by default the mechanism's. Same seed, same bytes.",
    ),
]
OverwriteOption = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace output files that exist; never one that is read."),
]
CandidatesOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        max=10**7,
        help="Poses drawn from the workspace; by default the mechanism's.",
    ),
]
ColumnsOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="TOML file whose [measurements] section says which columns hold what; by default the "
        "section of the mechanism's file, or symkin's own column names.",
    ),
]
PoseCountOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        max=10**6,
        help="Poses that each leg is identified from; by default the mechanism's.",
    ),
]
DesignOption = Annotated[
    Design,
    typer.Option(
        help="A set of poses for each leg; whole orbits of poses under the symmetry, N in all, "
        "which every leg uses; or N poses in all, chosen for all legs at once."
    ),
]
CriterionOption = Annotated[
    Criterion,
    typer.Option(
        help="Observability index to maximise, or the expected end-effector error to minimise."
    ),
]
RowsOption = Annotated[
    RowKind,
    typer.Option(
        help="What a pose is worth to the selection: the paper's dg/dparam, or the closures' "
        "derivatives weighted by the declared noise."
    ),
]
MethodOption = Annotated[
    SelectionMethod,
    typer.Option(help="Exchange; Sun and Hollerbach's; exchange with a proof; or a baseline."),
]
EstimatorOption = Annotated[
    Estimator,
    typer.Option(
        help="Whitened closures of each leg; the paper's Gauss-Newton on g - psi; the same cost by "
        "Levenberg-Marquardt; or all legs together."
    ),
]
MarginSigmasOption = Annotated[
    float,
    typer.Option(
        metavar="K",
        min=0,
        help="Keep poses K standard deviations of what the tolerances do away from the end of "
        "a leg's reach and from singularities, if that is more than the mechanism's margins.",
    ),
]
OptionalEstimatorOption = Annotated[
    Estimator | None,
    typer.Option(
        help="Whitened closures of each leg, the default; the paper's Gauss-Newton on g - psi; the "
        "same cost by Levenberg-Marquardt; or all together, the default where it is needed."
    ),
]
ThreadsOption = Annotated[
    int,
    typer.Option(metavar="N", min=0, max=1024, help="0 for all; the plan is always the same."),
]
PoseUseOption = Annotated[
    PoseUse,
    typer.Option(help="Whether a leg uses all poses, or only its own set, as in the paper."),
]
