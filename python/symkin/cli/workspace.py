# SPDX-License-Identifier: MIT
"""``symkin workspace``."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from symkin.cli.console import print_json, progress, say, show_table
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, SeedOption
from symkin.cli.plan_options import angles
from symkin.io.output_files import OutputFiles

if TYPE_CHECKING:
    from symkin.symmetry.verification import ElementCheck
    from symkin.workspace.slices import ModeSlices
    from symkin.workspace.study import WorkspaceStudy


@with_example("symkin workspace 3RRR --out out --both-modes")
def workspace(
    mechanism: MechanismArgument,
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Folder for the page, its figures and workspace.json."),
    ],
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

    Writes workspace.html, its figures and workspace.json. The last line printed is the page's path.
    """
    from symkin import load_mechanism
    from symkin.io.results import write_results
    from symkin.outputs import WORKSPACE_FILES
    from symkin.report.workspace_report import write_workspace_report
    from symkin.workspace.study import study_workspace

    orientation_list = None if orientations is None else angles(orientations, "--orientations")
    with progress() as stage:
        stage("reading the mechanism")
        loaded = load_mechanism(mechanism)
        with OutputFiles([loaded.source], overwrite) as outputs:
            target = outputs.folder(out, *WORKSPACE_FILES)
            stage("studying the workspace")
            study = study_workspace(loaded, orientation_list, count, seed, resolution, both_modes)
            document = _document(study)
            write_results(document, target / "workspace.json")
            stage("writing the report")
            report = write_workspace_report(study, target)
    if as_json:
        print_json(document)
    else:
        _show(study)
        say()
        say(str(out / report.name))


def _document(study: WorkspaceStudy) -> dict[str, Any]:
    symmetry, sample, unit = study.symmetry, study.sample, study.mechanism.reading_unit
    return {
        "command": "workspace",
        "mechanism": study.mechanism.name,
        "symmetry": {
            "structure": symmetry.structure.name,
            "structure_in_the_paper": symmetry.structure.paper_name,
            "with_working_modes": symmetry.with_modes.name,
            "workspace": study.workspace_group,
        },
        "elements": [_element_document(check, unit) for check in study.elements],
        "total_workspace": {
            "poses": len(sample.poses),
            "drawn": sample.drawn,
            "share": study.share,
            "rejected": sample.rejected,
        },
        "active_joint_workspace": {
            f"lower_{unit}": sample.readings.min(axis=0),
            f"upper_{unit}": sample.readings.max(axis=0),
        },
        "constant_orientations": [_modes_document(modes) for modes in study.modes],
    }


def _element_document(check: ElementCheck, unit: str) -> dict[str, Any]:
    values = dataclasses.asdict(check)
    return values | {f"reading_deviation_{unit}": values.pop("reading_deviation")}


def _modes_document(modes: ModeSlices) -> dict[str, Any]:
    return {
        "working_modes": modes.mechanism.working_modes,
        "singular_orientations_at_home_rad": modes.singular_orientations,
        "slices": [
            {
                "orientation_rad": found.orientation,
                "reachable_area_m2": found.reachable_area,
                "usable_area_m2": found.usable_area,
                "aspect_areas_m2": found.aspect_areas,
            }
            for found in modes.slices
        ],
    }


def _show(study: WorkspaceStudy) -> None:
    from symkin.report.workspace_report import singular_orientations_text

    symmetry = study.symmetry
    say(
        f"{study.mechanism.name}: structure {symmetry.structure.paper_name} "
        f"({symmetry.structure.name}), with its working modes {symmetry.with_modes.name}"
    )
    group = ", ".join(study.workspace_group)
    say(f"workspace: {study.share:.1%} of its box, carried onto itself by {group}")
    _show_elements(study)
    _show_slices(study)
    for modes in study.modes:
        if text := singular_orientations_text(modes):
            say(text)


def _show_elements(study: WorkspaceStudy) -> None:
    rows = []
    for check in study.elements:
        counts = (check.tested, check.inside, check.mismatches)
        rows.append(
            [
                check.element,
                _yes(check.keeps_modes),
                _yes(check.keeps_aspect),
                *map(str, counts),
                f"{check.reading_deviation:.2g}",
            ]
        )
    deviation = f"largest deviation, {study.mechanism.reading_unit}"
    heading = [
        "element",
        "keeps modes",
        "keeps aspect",
        "tested",
        "inside",
        "mismatches",
        deviation,
    ]
    show_table(heading, rows, words=3)


def _show_slices(study: WorkspaceStudy) -> None:
    rows = [
        [
            modes.title,
            "-" if math.isnan(found.orientation) else f"{found.orientation:.3g}",
            f"{found.usable_area:.4g}",
            f"{found.area_of_side(1):.4g}",
            f"{found.area_of_side(-1):.4g}",
            str(len(found.aspect_areas)),
        ]
        for modes in study.modes
        for found in modes.slices
    ]
    show_table(
        ["", "orientation, rad", "workspace, m2", "home's side, m2", "other side, m2", "aspects"],
        rows,
    )


def _yes(value: bool) -> str:
    return "yes" if value else "no"
