# SPDX-License-Identifier: MIT
"""Groups that carry a mechanism onto itself, what they are called, and the conditions on them."""

from symkin.symmetry.group import (
    DetectedSymmetry,
    SymmetryElement,
    SymmetryGroup,
    declared_group,
    detect_symmetry,
    generate_legs,
    leg_carriers,
    map_poses,
    observability_group,
    symmetry_deviations,
    symmetry_group,
    verify_declared,
)

__all__ = [
    "DetectedSymmetry",
    "SymmetryElement",
    "SymmetryGroup",
    "declared_group",
    "detect_symmetry",
    "generate_legs",
    "leg_carriers",
    "map_poses",
    "observability_group",
    "symmetry_deviations",
    "symmetry_group",
    "verify_declared",
]
