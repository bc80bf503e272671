# SPDX-License-Identifier: MIT
"""Figures: each function takes data and returns a `matplotlib.figure.Figure`."""

from symkin.plot.errors import error_histogram_figure, error_map_figure
from symkin.plot.mechanism import mechanism_figure
from symkin.plot.mirrors import DrawnSymmetry
from symkin.plot.observability import observability_figure
from symkin.plot.parameters import parameter_errors_figure
from symkin.plot.pose_count import pose_count_figure
from symkin.plot.residuals import dependence_figure, residuals_figure
from symkin.plot.workspace import poses_figure

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
