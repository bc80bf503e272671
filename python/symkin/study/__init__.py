# SPDX-License-Identifier: MIT
"""Studies: protocols compared on the same simulated robots, on one core or on a cluster."""

from symkin.study.cost import CostResult
from symkin.study.definition import Cell, StudyDefinition, builtin_studies, builtin_text, load_study
from symkin.study.result import StudyResult
from symkin.study.running import run_study
from symkin.study.summaries import CellSummary, ErrorFigure, PairedComparison, Ratio

__all__ = [
    "Cell",
    "CellSummary",
    "CostResult",
    "ErrorFigure",
    "PairedComparison",
    "Ratio",
    "StudyDefinition",
    "StudyResult",
    "builtin_studies",
    "builtin_text",
    "load_study",
    "run_study",
]
