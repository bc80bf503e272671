# SPDX-License-Identifier: MIT
"""Groups that carry a mechanism onto itself, what they are called, and what breaks them."""

from symkin.model.symmetry.comparison import (
    ParameterDeviation,
    SymmetryComparison,
    compare_symmetry,
)
from symkin.model.symmetry.groups import (
    Carrying,
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
from symkin.model.symmetry.pairs import (
    JointMap,
    Motion,
    SymmetryPair,
    SymmetryPairs,
    symmetry_pairs,
)

__all__ = [
    "Carrying",
    "DetectedSymmetry",
    "JointMap",
    "Motion",
    "NamedGroup",
    "ParameterDeviation",
    "SymmetryComparison",
    "SymmetryElement",
    "SymmetryFrame",
    "SymmetryGroup",
    "SymmetryPair",
    "SymmetryPairs",
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
    "symmetry_pairs",
    "verify_declared",
]
