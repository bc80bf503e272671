# SPDX-License-Identifier: MIT
"""``symkin check``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import symkin
from symkin.cli.console import print_json, progress, say, show_legs
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, SeedOption
from symkin.cli.units import numbers, parameter_labels

if TYPE_CHECKING:
    from symkin.checking import CheckResult
    from symkin.conditions import Conditions
    from symkin.workspace import WorkspaceSample


@with_example("symkin check 3RRR")
def check(
    mechanism: MechanismArgument, seed: SeedOption = None, as_json: JsonOption = False
) -> None:
    """Say what a mechanism file describes.

    The legs that its symmetry generates, how near home is to singularities, how much of the
    workspace box can be used, and which parameters measurements there would show.
    """
    from symkin.checking import check_mechanism

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        stage("sampling the workspace")
        result = check_mechanism(loaded, seed)
    if as_json:
        print_json(_document(result))
    else:
        _show(result)


def _document(result: CheckResult) -> dict[str, Any]:
    mechanism, sample, home = result.mechanism, result.sample, result.home
    return {
        "command": "check",
        "mechanism": mechanism.name,
        "file": mechanism.source,
        "chain": mechanism.chain,
        "pose_space": mechanism.pose_space,
        "reading_unit": mechanism.reading_unit,
        "symmetry": {"group": result.group, "declared": result.declared},
        "conditions": result.conditions,
        "legs": [
            {
                "leg": number,
                "reference_leg": origin.reference + 1,
                "element": origin.element,
                "working_mode": leg.working_mode,
                "parameters": leg.parameters,
            }
            for number, (leg, origin) in enumerate(
                zip(mechanism.legs, result.origins, strict=True), 1
            )
        ],
        "home": home,
        "workspace": sample
        and {"drawn": sample.drawn, "share": _share(sample), "rejected": sample.rejected},
        "identifiability": [
            {
                "leg": number,
                "rank": shown.rank,
                "condition": shown.condition,
                "singular_values": shown.singular_values,
                "r_diagonal": dict(zip(mechanism.parameter_names, shown.r_diagonal, strict=True)),
                "unseen": shown.unseen,
                "indices": shown.indices,
            }
            for number, shown in enumerate(result.observability, 1)
        ],
    }


def _show(result: CheckResult) -> None:
    mechanism = result.mechanism
    origin = "declared" if result.declared else "found from the legs"
    say(f"{mechanism.name}: {len(mechanism.legs)} legs {mechanism.chain}, {mechanism.pose_space}")
    say(f"symmetry {result.group}, {origin}")
    _show_legs(result)
    _show_home(result)
    _show_workspace(result)
    if result.observability:
        _show_identifiability(result)
    if result.conditions is not None:
        _show_conditions(result.conditions)


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


def _show_home(result: CheckResult) -> None:
    mechanism, home = result.mechanism, result.home
    given = mechanism.workspace.home if mechanism.workspace else None
    coordinates = ", ".join(f"{value:g}" for value in given or (0.0,) * mechanism.core.dof)
    show_legs(
        f"home ({coordinates})",
        [
            (f"reading, {mechanism.reading_unit}", numbers(home.readings.round(12))),
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
        say("no [workspace] in the file, so identifiability is not checked")
        return
    causes = ", ".join(f"{cause} {count}" for cause, count in sample.rejected.items())
    say(f"workspace: {_share(sample):.0%} of its box ({sample.drawn} poses drawn)")
    say(f"rejected: {causes}")


def _show_identifiability(result: CheckResult) -> None:
    legs, names = result.observability, result.mechanism.parameter_names
    show_legs(
        f"identifiability, {len(result.sample.poses) if result.sample else 0} poses",
        [
            ("rank", [f"{leg.rank} of {len(names)}" for leg in legs]),
            ("condition number", numbers([leg.condition for leg in legs], 3)),
            *(
                (f"|R_ii| {name}", numbers([leg.r_diagonal[index] for leg in legs]))
                for index, name in enumerate(names)
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
    say(f"symmetry of the structure {found.structure}, with the working modes {found.with_modes}")
    say(f"conditions of the paper, each element tested on {found.tested} poses")
    for item in found.conditions:
        allowed = f" (allowed {item.tolerance})" if item.tolerance else ""
        verdict = "holds" if item.holds else "FAILS"
        say(f"  {item.section}({item.number}) {verdict}  {item.text}: {item.figure}{allowed}")


def _share(sample: WorkspaceSample) -> float:
    return 1 - sum(sample.rejected.values()) / sample.drawn
