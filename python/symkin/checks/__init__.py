# SPDX-License-Identifier: MIT
"""What a mechanism is like before anything is measured."""

from symkin.checks.check import CheckResult, HomePose, LegOrigin, check_mechanism

__all__ = ["CheckResult", "HomePose", "LegOrigin", "check_mechanism"]
