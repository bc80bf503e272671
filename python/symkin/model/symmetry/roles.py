# SPDX-License-Identifier: MIT
"""Parameters that play the same role in legs that a symmetry carries onto each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symkin import _core
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry.pairs import SymmetryPair, SymmetryPairs, symmetry_pairs
from symkin.model.tolerances import parameter_tolerances
from symkin.values import Array

_NEARLY = 3.0  # tolerances by which legs of a robot that was made may be off
_ROUNDING = 1e-6
# Tolerances that errors of a robot bring into one of a parameter: of one within rounding, whose
# legs are some micrometres off, and of one that was made.
_BY_ROUNDING, _BY_ERRORS = 1e-3, 0.05


class RoleImage(NamedTuple):
    """How a leg comes from the first of its orbit."""

    reference: int  # that leg, from 0
    element: SymmetryPair  # what carries it here
    # (p, p): derivatives of the leg's parameters by the reference's, where both are to keep the
    # symmetry; NaN for an angle that means nothing where the leg is.
    by: Array
    sign: int  # in which sense the joint counts, as the reference's does: 1 or -1


def role_images(mechanism: Mechanism) -> tuple[RoleImage, ...]:
    """Say of each leg from which it comes, and how its parameters go with that one's.

    By the symmetries that fix home, whatever they do to working modes: turns before mirrors, those
    that keep the modes first. The drawing's within rounding; where there are none, as of a robot
    that was calibrated, those within three tolerances.
    """
    pairs, off = symmetry_pairs(mechanism), _BY_ROUNDING
    if len(pairs.fix_home) == 1:
        tolerances = mechanism.tolerances
        near = _NEARLY * min(
            each for each in (tolerances.length, tolerances.angle, 1e-2) if each > 0
        )
        pairs, off = symmetry_pairs(mechanism, max(near, _ROUNDING)), _BY_ERRORS
    elements = _in_order(pairs)
    sizes = np.where(parameter_tolerances(mechanism) > 0, parameter_tolerances(mechanism), 1.0)
    images = []
    for leg in range(len(mechanism.legs)):
        reference = min(each.permutation.index(leg) for each in elements)
        element = next(each for each in elements if each.permutation[reference] == leg)
        found = _core.carried_derivatives(mechanism.straight, reference, element.core, leg)
        in_tolerances = found * sizes[reference] / sizes[leg][:, None]
        whole = np.round(in_tolerances)
        by = np.where(np.abs(in_tolerances - whole) < off, np.round(found), found)
        images.append(RoleImage(reference, element, by, element.joints[reference].sign))
    return tuple(images)


def _in_order(pairs: SymmetryPairs) -> list[SymmetryPair]:
    return sorted(pairs.fix_home, key=lambda each: (not each.keeps_modes, each.improper))
