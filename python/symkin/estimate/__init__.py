# SPDX-License-Identifier: MIT
"""From measurements to parameters, their uncertainty, and what speaks against them."""

from symkin.estimate.cross_validation import CrossValidation
from symkin.estimate.diagnosis import Diagnosis, Outlier, ResidualTest
from symkin.estimate.fit import Estimator, FitOptions, GoodnessOfFit, LegFit, Loss, PoseUse
from symkin.estimate.fleet import Fleet, identify_many
from symkin.estimate.identification import Identification, cross_validate, identify
from symkin.estimate.joint import JointIdentification
from symkin.estimate.precision import Heights, Shown
from symkin.estimate.problem import JointOptions, Rows
from symkin.estimate.unknowns import Unknown

__all__ = [
    "CrossValidation",
    "Diagnosis",
    "Estimator",
    "FitOptions",
    "Fleet",
    "GoodnessOfFit",
    "Heights",
    "Identification",
    "JointIdentification",
    "JointOptions",
    "LegFit",
    "Loss",
    "Outlier",
    "PoseUse",
    "ResidualTest",
    "Rows",
    "Shown",
    "Unknown",
    "cross_validate",
    "identify",
    "identify_many",
]
