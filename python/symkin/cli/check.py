# SPDX-License-Identifier: MIT
"""``symkin check`` and ``symkin workspace``: what a mechanism is, and where it can go."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import print_result, progress, write_result
from symkin.cli.option_values import angles_of
from symkin.cli.options import (
    JsonOption,
    MechanismArgument,
    OverwriteOption,
    SeedOption,
    command,
)
from symkin.io.output_files import OutputFiles


@command("symkin check 3RRR", "symkin check 3RRR --out checked")
def check(
    mechanism: MechanismArgument,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for check.html and check.json.")
    ] = None,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose",
            help="Print groups, the paper's conditions, home, and what poses show, too.",
        ),
    ] = False,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Say whether a mechanism file describes what you mean, and what it means for measuring.

    First whether the legs are alike, so that poses chosen for one serve all, or which leg and
    parameter differs; then whether poses can show every parameter, how many are needed, and the
    command that plans them.

    --verbose, --json and the page of --out have all of it: the groups G_M, G_W, G_Q and G_C; how
    near home is to singularities; the figures of identifiability; and the conditions (1)-(5) of
    section 4 and (1)-(7) of section 5 of the paper, each with its verdict, the figure behind it and
    what is allowed.

    With --out, the last line printed is the page's path. Legs that do not have the symmetry
    declared beside them are shown like any others, then refused; so is a workspace that cannot be
    sampled, such as one around a singular home, without what rests on its poses.
    """
    from symkin.checks import check_mechanism

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism, require_symmetry=False)
        with OutputFiles([loaded.source], overwrite) as outputs:
            target = None if out is None else outputs.folder(out, "check.json", "check.html")
            stage("sampling the workspace")
            result = check_mechanism(loaded, seed)
            document = {"command": "check", "settings": {"seed": seed}, **result.to_dict()}
            if target is not None:
                stage("writing the page")
                write_result(result, document, target, "check")
    after = out and out / "check.html"
    print_result(result, document, as_json=as_json, after=after, whole=verbose)
    symkin.load_mechanism(mechanism)  # tells in one sentence if the declared symmetry is absent
    if result.unusable is not None:
        raise symkin.SymkinError(result.unusable)


@command("symkin workspace 3RRR --out out --both-modes")
def workspace(
    mechanism: MechanismArgument,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for workspace.html and workspace.json."),
    ] = None,
    orientations: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLE,ANGLE,...",
            help="Of the constant-orientation workspaces, such as 0,0.4 or 0,20deg; by default "
            "home's, and 0.4 and 0.6 rad from there.",
        ),
    ] = None,
    count: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=1,
            max=10**8,
            help="Poses of the total workspace, and poses tested for each symmetry element.",
        ),
    ] = 100_000,
    resolution: Annotated[
        int, typer.Option(metavar="N", min=2, max=4000, help="Grid cells a side.")
    ] = 201,
    both_modes: Annotated[
        bool,
        typer.Option("--both-modes", help="Show the legs' other working mode too, for comparison."),
    ] = False,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Draw a workspace and test its symmetry.

    The workspace theorem (a pose is in the workspace exactly if its image is) and the active-joint
    conjecture (the readings at the image are the image of the readings) are tested on poses of the
    workspace box, for every element of the symmetry found. An element that does not keep the
    working modes is tested between the workspaces of the two modes.

    With --out, writes workspace.html and workspace.json, and the last line printed is the page's
    path.
    """
    from symkin.workspace.study import study_workspace

    orientation_list = None if orientations is None else angles_of(orientations, "--orientations")
    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        with OutputFiles([loaded.source], overwrite) as outputs:
            files = "workspace.json", "workspace.html"
            target = None if out is None else outputs.folder(out, *files)
            stage("studying the workspace")
            study = study_workspace(loaded, orientation_list, count, seed, resolution, both_modes)
            settings = {"count": count, "resolution": resolution, "seed": seed}
            document = {"command": "workspace", "settings": settings, **study.to_dict()}
            if target is not None:
                stage("writing the page")
                write_result(study, document, target, "workspace")
    print_result(study, document, as_json=as_json, after=out and out / "workspace.html")
