# SPDX-License-Identifier: MIT
"""``symkin new`` and ``symkin list``: mechanism files to begin with."""

from __future__ import annotations

import itertools
import re
import sys
import textwrap
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from symkin.cli.console import print_json, say
from symkin.cli.options import JsonOption, command


def _chains(incomplete: str) -> list[str]:
    from symkin.chains import chains

    return [name for name in chains() if name.startswith(incomplete)]


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
    from symkin.io.mechanism_file import load_mechanism, shipped_mechanisms

    rows: list[dict[str, Any]] = []
    for name in shipped_mechanisms():
        mechanism = load_mechanism(name)
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
