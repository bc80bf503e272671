# SPDX-License-Identifier: MIT
"""``symkin check``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, SeedOption
from symkin.io.output_files import OutputFiles


@with_example("symkin check 3RRR", "symkin check 3RRR --out checked")
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
    from symkin.io.results import write_results

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
                write_results(document, target / "check.json")
                result.report(target / "check.html")
    if as_json:
        print_json(document)
    else:
        say(result.text(whole=verbose))
        if out is not None:
            say(f"\n{out / 'check.html'}")
    symkin.load_mechanism(mechanism)  # tells in one sentence if the declared symmetry is absent
    if result.unusable is not None:
        raise symkin.SymkinError(result.unusable)
