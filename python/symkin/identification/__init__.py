# SPDX-License-Identifier: MIT
"""From measurements to parameters, their uncertainty, and what speaks against them."""

from symkin.identification.diagnosis import Diagnosis, Outlier, ResidualTest
from symkin.identification.estimate import CrossValidation, Identification, cross_validate, identify
from symkin.identification.fit import Estimator, FitOptions, GoodnessOfFit, LegFit, Loss, PoseUse
from symkin.identification.fleet import Fleet, identify_many
from symkin.identification.joint import JointIdentification, Unknown
from symkin.identification.knowledge import Heights, Shown
from symkin.identification.problem import JointOptions, Rows

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
