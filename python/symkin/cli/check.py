# SPDX-License-Identifier: MIT
"""``symkin check``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import symkin
from symkin.cli.console import print_json, progress, say, show_legs, show_table
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, SeedOption
from symkin.cli.units import numbers, parameter_labels
from symkin.io.output_files import OutputFiles

if TYPE_CHECKING:
    from symkin.checks.check import CheckResult
    from symkin.symmetry.conditions import Conditions
    from symkin.symmetry.named import NamedGroup

_SHOWN_DEVIATIONS = 10


@with_example("symkin check 3RRR", "symkin check 3RRR --out checked")
def check(
    mechanism: MechanismArgument,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for report.html, its figures and check.json."),
    ] = None,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Say what a mechanism file describes, and test the paper's conditions on it.

    The legs that its symmetry generates, the groups G_M, G_W, G_Q and G_C, and which legs and
    parameters break the symmetry that is declared or nearly there; how near home is to
    singularities, how much of the workspace box can be used, which parameters measurements there
    would show; and the conditions (1)-(5) of section 4 and (1)-(7) of section 5, each with its
    verdict, the figure behind it and what is allowed.

    With --out, writes report.html, its figures and check.json, and the last line printed is the
    report's path. Legs that do not have the symmetry declared beside them are shown like any
    others, then refused; so is a workspace that cannot be sampled, such as one around a singular
    home, without what rests on its poses.
    """
    from symkin.check_document import check_document
    from symkin.checks.check import check_mechanism
    from symkin.outputs import CHECK_FILES, write_check

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism, require_symmetry=False)
        with OutputFiles([loaded.source], overwrite) as outputs:
            target = None if out is None else outputs.folder(out, *CHECK_FILES)
            stage("sampling the workspace")
            result = check_mechanism(loaded, seed)
            document = check_document(result)
            if target is not None:
                stage("writing the report")
                write_check(result, target, document)
    if as_json:
        print_json(document)
    else:
        _show(result)
        if out is not None:
            say()
            say(str(out / "report.html"))
    symkin.load_mechanism(mechanism)  # tells in one sentence if the declared symmetry is absent
    if result.unusable is not None:
        raise result.unusable


def _show(result: CheckResult) -> None:
    mechanism = result.mechanism
    say(f"{mechanism.name}: {len(mechanism.legs)} legs {mechanism.chain}, {mechanism.pose_space}")
    _show_symmetry(result)
    _show_legs(result)
    _show_home(result)
    _show_workspace(result)
    if result.observability:
        _show_identifiability(result)
    if result.conditions is not None:
        _show_conditions(result.conditions)


def _show_symmetry(result: CheckResult) -> None:
    for sentence in result.comparison.sentences:
        say(sentence)
    _show_deviations(result)
    say(result.orbits_in_words)
    rows = [
        [
            f"{group.symbol} {group.meaning}",
            group.paper_name or "none",
            group.name or "none",
            _elements(group),
        ]
        for group in result.groups
    ]
    show_table(["group", "paper", "usual", "elements"], rows, words=4)


def _elements(group: NamedGroup) -> str:
    """The labels with their angles: ``r0, r1 120°, s0 axis 30°``."""
    return ", ".join(
        label if label == "r0" else f"{label} {_angle(words)}"
        for label, words in zip(group.elements, group.described, strict=True)
    )


def _angle(words: str) -> str:
    """The angle of an element described in words, with what it is of."""
    angle = words.rsplit(" ", 1)[1]
    return f"axis {angle}" if words.startswith("reflection") else angle


def _show_deviations(result: CheckResult) -> None:
    """Print what breaks the symmetry, largest first."""
    mechanism, comparison = result.mechanism, result.comparison
    deviations = comparison.deviations + comparison.sensor_deviations
    units = dict(zip(mechanism.parameter_names, mechanism.parameter_units, strict=True))
    for found in deviations[:_SHOWN_DEVIATIONS]:
        value = f"{found.deviation:+.6f} {units[found.parameter]}".rstrip()
        known = found.standard_deviation
        spread = "" if math.isnan(known) else f", standard deviation {known:.2g}"
        tolerances = f"{found.in_tolerances:.3g} tolerances"
        say(f"  leg {found.leg + 1} {found.parameter} {value} ({tolerances}{spread})")
    if len(deviations) > _SHOWN_DEVIATIONS:
        say(f"  and {len(deviations) - _SHOWN_DEVIATIONS} smaller ones, which --json lists")


def _show_legs(result: CheckResult) -> None:
    mechanism = result.mechanism
    show_legs(
        "legs",
        [
            ("image of leg", [f"{leg.reference + 1} by {leg.element}" for leg in result.origins]),
            ("working mode", [f"{mode:+d}" for mode in mechanism.working_modes]),
            *(
                (label, numbers(mechanism.parameters[:, index]))
                for index, label in enumerate(parameter_labels(mechanism))
            ),
        ],
    )
    for sentence in result.undefined:
        say(sentence)


def _show_home(result: CheckResult) -> None:
    mechanism, home = result.mechanism, result.home
    given = mechanism.workspace.home if mechanism.workspace else None
    coordinates = ", ".join(f"{value:g}" for value in given or (0.0,) * mechanism.core.dof)
    show_legs(
        f"home ({coordinates})",
        [
            (f"reading, {mechanism.reading_unit}", numbers(home.readings.round(12) + 0.0)),
            ("dh/dq (0: serial singularity)", numbers(home.serial)),
        ],
    )
    limit = f", limit {mechanism.workspace.conditioning_limit:g}" if mechanism.workspace else ""
    say(f"det(dg/dpose) {home.parallel:.3g} (0: parallel singularity)")
    say(f"condition number {home.condition:.3g}{limit}")


def _show_workspace(result: CheckResult) -> None:
    say()
    sample = result.sample
    if sample is None:
        say(f"conditions and identifiability are not tested: {result.untested}")
        return
    causes = ", ".join(f"{cause} {count}" for cause, count in sample.rejected.items())
    say(f"workspace: {result.share:.0%} of its box ({sample.drawn} poses drawn)")
    say(f"rejected: {causes}")


def _show_identifiability(result: CheckResult) -> None:
    legs, names = result.observability, result.mechanism.parameter_names
    show_legs(
        f"identifiability, {len(result.leg_poses[0])} poses",
        [
            ("rank", [f"{leg.rank} of {len(names)}" for leg in legs]),
            ("condition number", numbers([leg.condition for leg in legs], 3)),
            *(
                (f"|R_ii| {name}", numbers([leg.r_diagonal[index] for leg in legs]))
                for index, name in enumerate(names)
            ),
            *(
                (f"singular value {number}", numbers(values, 3))
                for number, values in enumerate(
                    zip(*(leg.singular_values for leg in legs), strict=True), 1
                )
            ),
            *(
                (index, numbers([leg.indices[index] for leg in legs], 4))
                for index in legs[0].indices
            ),
        ],
    )
    for number, leg in enumerate(legs, 1):
        for combination in leg.unseen:
            say(f"leg {number}: no pose shows {combination}")


def _show_conditions(found: Conditions) -> None:
    say()
    say(
        f"conditions of the paper, each element of {found.group.paper_name} tested on "
        f"{found.tested} poses"
    )
    for item in found.conditions:
        allowed = f" (allowed {item.tolerance})" if item.tolerance else ""
        verdict = "holds" if item.holds else "FAILS"
        say(f"  {item.section}({item.number}) {verdict}  {item.text}: {item.figure}{allowed}")
