# SPDX-License-Identifier: MIT
"""Figures: each function takes data and returns a `matplotlib.figure.Figure`."""

from symkin.report.figures.errors import error_histogram_figure, error_map_figure
from symkin.report.figures.mechanism import mechanism_figure
from symkin.report.figures.mirrors import DrawnSymmetry
from symkin.report.figures.observability import observability_figure
from symkin.report.figures.parameters import parameter_errors_figure
from symkin.report.figures.pose_count import pose_count_figure
from symkin.report.figures.residuals import dependence_figure, residuals_figure
from symkin.report.figures.workspace import poses_figure

__all__ = [
    "DrawnSymmetry",
    "dependence_figure",
    "error_histogram_figure",
    "error_map_figure",
    "mechanism_figure",
    "observability_figure",
    "parameter_errors_figure",
    "pose_count_figure",
    "poses_figure",
    "residuals_figure",
]
