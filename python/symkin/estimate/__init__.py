# SPDX-License-Identifier: MIT
"""From measurements to parameters, their uncertainty, and what speaks against them."""

from symkin.estimate.cross_validation import CrossValidation
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.findings import Doubt, Note
from symkin.estimate.evidence.outliers import Outlier
from symkin.estimate.evidence.residuals import ResidualTest
from symkin.estimate.fleet import Fleet, identify_many
from symkin.estimate.found import GoodnessOfFit, Latent, LegFit
from symkin.estimate.identification import cross_validate, identify
from symkin.estimate.options import EstimateOptions, Estimator, Loss, PoseUse
from symkin.estimate.parameters import Unknown
from symkin.estimate.precision import Heights, Shown
from symkin.estimate.problem import Rows
from symkin.estimate.strain import Strain

__all__ = [
    "CrossValidation",
    "Doubt",
    "Estimate",
    "EstimateOptions",
    "Estimator",
    "Fleet",
    "GoodnessOfFit",
    "Heights",
    "Latent",
    "LegFit",
    "Loss",
    "Note",
    "Outlier",
    "PoseUse",
    "ResidualTest",
    "Rows",
    "Shown",
    "Strain",
    "Unknown",
    "cross_validate",
    "identify",
    "identify_many",
]
