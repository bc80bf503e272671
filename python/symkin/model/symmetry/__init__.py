# SPDX-License-Identifier: MIT
"""Groups that carry a mechanism onto itself, what they are called, and what breaks them."""

from symkin.model.symmetry.comparison import (
    ParameterDeviation,
    SymmetryComparison,
    compare_symmetry,
)
from symkin.model.symmetry.groups import (
    DetectedSymmetry,
    NamedGroup,
    SymmetryElement,
    SymmetryFrame,
    SymmetryGroup,
    declared_group,
    detect_symmetry,
    generate_legs,
    generate_orbits,
    leg_carriers,
    map_poses,
    observability_group,
    symmetry_deviations,
    symmetry_group,
    verify_declared,
)

__all__ = [
    "DetectedSymmetry",
    "NamedGroup",
    "ParameterDeviation",
    "SymmetryComparison",
    "SymmetryElement",
    "SymmetryFrame",
    "SymmetryGroup",
    "compare_symmetry",
    "declared_group",
    "detect_symmetry",
    "generate_legs",
    "generate_orbits",
    "leg_carriers",
    "map_poses",
    "observability_group",
    "symmetry_deviations",
    "symmetry_group",
    "verify_declared",
]
