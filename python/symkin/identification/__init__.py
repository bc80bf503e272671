# SPDX-License-Identifier: MIT
"""From measurements to parameters, their uncertainty, and what speaks against them."""

from symkin.identification.estimate import (
    Estimator,
    GoodnessOfFit,
    Identification,
    LegFit,
    Loss,
    PoseUse,
    identify,
)

__all__ = ["Estimator", "GoodnessOfFit", "Identification", "LegFit", "Loss", "PoseUse", "identify"]
