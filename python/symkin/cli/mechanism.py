# SPDX-License-Identifier: MIT
"""``symkin new``, ``list``, ``check`` and ``workspace``: mechanism files and what they mean."""

from __future__ import annotations

import itertools
import re
import sys
import textwrap
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import symkin
from symkin.cli.console import print_json, print_result, progress, say, write_result
from symkin.cli.option_values import angles_of
from symkin.cli.options import (
    JsonOption,
    MechanismArgument,
    OverwriteOption,
    SeedOption,
    command,
)
from symkin.io.output_files import OutputFiles


def _chains(incomplete: str) -> list[str]:
    return [name for name in symkin.chains() if name.startswith(incomplete)]


@command('symkin new --chain "[R]RR" --legs 3 > robot.toml')
def new(
    chain: Annotated[
        str,
        typer.Option(
            metavar="CHAIN",
            help='Joints of a leg from base to platform, the actuated one in brackets: "[R]RR". '
            'Or how many legs have which: "2 [R]RR + 1 [P]RP".',
            show_default=False,
            autocompletion=_chains,
        ),
    ],
    legs: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="By default as few as the platform needs."),
    ] = None,
    platform: Annotated[
        Literal["rigid", "point", "translating", "spherical"],
        typer.Option(
            help="A platform that turns, a point that only moves in the plane (five-bar), one "
            "that moves in space and never turns (delta), or one that only turns (Agile Eye)."
        ),
    ] = "rigid",
) -> None:
    """Print a mechanism file to begin with: symmetrical legs, every key explained.

    It works with every command before you put your dimensions in place of its own.
    """
    from symkin.io.template import mechanism_template

    sys.stdout.write(mechanism_template(chain, legs, platform))


@command("symkin list")
def list_mechanisms(as_json: JsonOption = False) -> None:
    """List the mechanisms that come with symkin; their names can stand for a file."""
    rows: list[dict[str, Any]] = []
    for name in symkin.shipped_mechanisms():
        mechanism = symkin.load_mechanism(name)
        assert mechanism.source is not None
        rows.append(
            {
                "name": name,
                "chain": mechanism.chain,
                "legs": len(mechanism.legs),
                "platform": mechanism.pose_space,
                "symmetry": mechanism.symmetry.group if mechanism.symmetry else None,
                "description": _first_sentence(mechanism.source),
                "file": mechanism.source,
            }
        )
    if as_json:
        print_json({"command": "list", "mechanisms": rows})
        return
    for row in rows:
        apart = "," if " + " in row["chain"] else ""
        legs = f"{row['legs']} legs{apart} {row['chain']}"
        symmetry = f", {row['symmetry']}" if row["symmetry"] else ""
        say(f"{row['name']}: {legs}, {row['platform']}{symmetry}")
        for line in textwrap.wrap(row["description"], 94):
            say(f"    {line}")
    say(f"The files are in {rows[0]['file'].parent}.")


def _first_sentence(path: Path) -> str:
    """What the comment at the top of a file says first."""
    lines = path.read_text(encoding="utf-8").splitlines()[1:]
    comment = itertools.takewhile(lambda line: line.startswith("#"), lines)
    text = " ".join(line.lstrip("# ") for line in comment).strip()
    return re.split(r"(?<=\.) +(?=[A-Z])|  ", text)[0]


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
    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism, require_symmetry=False)
        with OutputFiles(loaded.files, overwrite) as outputs:
            target = None if out is None else outputs.folder(out, "check.json", "check.html")
            stage("sampling the workspace")
            result = symkin.check_mechanism(loaded, seed)
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
    orientation_list = None if orientations is None else angles_of(orientations, "--orientations")
    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        with OutputFiles(loaded.files, overwrite) as outputs:
            files = "workspace.json", "workspace.html"
            target = None if out is None else outputs.folder(out, *files)
            stage("studying the workspace")
            study = symkin.study_workspace(
                loaded, orientation_list, count, seed, resolution, both_modes
            )
            settings = {"count": count, "resolution": resolution, "seed": seed}
            document = {"command": "workspace", "settings": settings, **study.to_dict()}
            if target is not None:
                stage("writing the page")
                write_result(study, document, target, "workspace")
    print_result(study, document, as_json=as_json, after=out and out / "workspace.html")
