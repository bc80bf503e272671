# SPDX-License-Identifier: MIT
"""``symkin workspace``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from symkin.cli.console import print_json, progress, say
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, SeedOption
from symkin.cli.plan_options import angles
from symkin.io.output_files import OutputFiles


@with_example("symkin workspace 3RRR --out out --both-modes")
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
    from symkin import load_mechanism
    from symkin.io.results import write_results
    from symkin.workspace.study import study_workspace

    orientation_list = None if orientations is None else angles(orientations, "--orientations")
    with progress() as stage:
        stage("reading the mechanism")
        loaded = load_mechanism(mechanism)
        with OutputFiles([loaded.source], overwrite) as outputs:
            files = "workspace.json", "workspace.html"
            target = None if out is None else outputs.folder(out, *files)
            stage("studying the workspace")
            study = study_workspace(loaded, orientation_list, count, seed, resolution, both_modes)
            settings = {"count": count, "resolution": resolution, "seed": seed}
            document = {"command": "workspace", "settings": settings, **study.to_dict()}
            if target is not None:
                stage("writing the page")
                write_results(document, target / "workspace.json")
                study.report(target / "workspace.html")
    if as_json:
        print_json(document)
    else:
        say(study.text())
        if out is not None:
            say(f"\n{out / 'workspace.html'}")
