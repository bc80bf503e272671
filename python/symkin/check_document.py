# SPDX-License-Identifier: MIT
"""What a check found as plain values, for files and for machines; legs count from 1."""

from __future__ import annotations

from typing import Any

from symkin.checks.check import CheckResult
from symkin.symmetry.comparison import ParameterDeviation, SymmetryComparison
from symkin.symmetry.conditions import Conditions
from symkin.symmetry.named import NamedGroup

__all__ = ["check_document"]

Document = dict[str, Any]


def check_document(result: CheckResult) -> Document:
    """Return what ``check.json`` holds.

    Parameters
    ----------
    result : CheckResult
        Of `check_mechanism`.

    Returns
    -------
    dict
        Of values that JSON has.
    """
    mechanism, sample = result.mechanism, result.sample
    return {
        "command": "check",
        "mechanism": mechanism.name,
        "file": mechanism.source,
        "chain": mechanism.chain,
        "pose_space": mechanism.pose_space,
        "reading_unit": mechanism.reading_unit,
        "symmetry": {
            "group": result.group,
            "declared": result.declared,
            **_comparison_document(result.comparison),
            "groups": [_group_document(group) for group in result.groups],
            "orbits": [[leg + 1 for leg in orbit] for orbit in result.orbits],
        },
        "conditions": result.conditions and _conditions_document(result.conditions),
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
        "home": result.home,
        "workspace": sample
        and {"drawn": sample.drawn, "share": result.share, "rejected": sample.rejected},
        "unusable": result.unusable and str(result.unusable),
        "undefined": result.undefined,
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


def _group_document(group: NamedGroup) -> Document:
    return {
        "symbol": group.symbol,
        "meaning": group.meaning,
        "name_in_the_paper": group.paper_name,
        "name": group.name,
        "elements": dict(zip(group.elements, group.described, strict=True)),
    }


def _comparison_document(comparison: SymmetryComparison) -> Document:
    reference = comparison.reference
    return {
        "verdict": comparison.verdict,
        "declared_group": comparison.declared and comparison.declared.name,
        "compared_with": reference
        and {
            "name_in_the_paper": reference.paper_name,
            "name": reference.name,
            "elements_that_keep_the_working_modes": comparison.reference_elements,
            "worst_in_tolerances": comparison.worst,
        },
        "deviations": _deviations_document(comparison.deviations),
        "sensors": {
            "verdict": comparison.sensors,
            "deviations": _deviations_document(comparison.sensor_deviations),
        },
    }


def _deviations_document(deviations: tuple[ParameterDeviation, ...]) -> list[Document]:
    return [
        {
            "leg": found.leg + 1,
            "parameter": found.parameter,
            "deviation": found.deviation,
            "in_tolerances": found.in_tolerances,
            "standard_deviation": found.standard_deviation,
        }
        for found in deviations
    ]


def _conditions_document(conditions: Conditions) -> Document:
    return {
        "structure": conditions.structure,
        "with_modes": conditions.with_modes,
        "carriers": conditions.carriers,
        "conditions": conditions.conditions,
        "tested": conditions.tested,
        "tested_group": conditions.group.paper_name,
        "elements": conditions.elements,
    }
