# SPDX-License-Identifier: MIT
"""How much of a drift the poses of a plan show, in the order in which they are visited."""

from __future__ import annotations

import dataclasses

import numpy as np

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.changes import change_tests
from symkin.estimate.fit import by_leg
from symkin.estimate.options import EstimateOptions
from symkin.estimate.solution import together
from symkin.estimate.survey import Survey
from symkin.model.mechanism import Mechanism
from symkin.planning.accuracy import PlannedPoses


def drift_shown(
    mechanism: Mechanism, plan: PlannedPoses, survey: Survey | None = None
) -> float | None:
    """Return how much of the drift of a sensor is not taken for geometry, between 0 and 1.

    The mean over the legs: of the whitened rows that change with the drift, the length that is left
    when all that the unknowns explain is taken out. None where that cannot be told.
    """
    wanted = ~plan.spare
    exact = Measurements.of(
        plan.poses[wanted],
        mechanism.inverse_kinematics(plan.poses[wanted]),
        plan.leg_sets[wanted],
        reading_unit=mechanism.reading_unit,
        pose_space=mechanism.pose_space,
    )
    try:
        if survey is None:
            found = by_leg(mechanism.replace(frames=None), exact, EstimateOptions())
        else:
            seen = survey.observed.exact(exact)
            options = dataclasses.replace(survey.options, estimator="joint")
            found = together(survey.mechanism, seen, options)
    except SymkinError:
        return None
    tests = change_tests(found)
    shares = [each.seen for each in tests if each.what == "drift" and each.leg >= 0]
    return float(np.mean(shares)) if shares else None
