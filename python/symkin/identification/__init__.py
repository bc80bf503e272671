# SPDX-License-Identifier: MIT
"""From measurements to parameters, their uncertainty, and what speaks against them."""

from symkin.identification.diagnosis import Diagnosis, Outlier, ResidualTest
from symkin.identification.estimate import (
    CrossValidation,
    Identification,
    cross_validate,
    identify,
)
from symkin.identification.fit import Estimator, FitOptions, GoodnessOfFit, LegFit, Loss, PoseUse
from symkin.identification.fleet import Fleet, identify_many

__all__ = [
    "CrossValidation",
    "Diagnosis",
    "Estimator",
    "FitOptions",
    "Fleet",
    "GoodnessOfFit",
    "Identification",
    "LegFit",
    "Loss",
    "Outlier",
    "PoseUse",
    "ResidualTest",
    "cross_validate",
    "identify",
    "identify_many",
]
