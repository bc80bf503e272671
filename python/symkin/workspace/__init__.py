# SPDX-License-Identifier: MIT
"""The workspace: samples of it, slices through it."""

from symkin.workspace.sample import (
    WorkspaceSample,
    closure_deviation,
    coordinate_names,
    inside_box,
    inside_workspace,
    least_reach_margin,
    sample_workspace,
    workspace_coordinates,
    workspace_options,
)

__all__ = [
    "WorkspaceSample",
    "closure_deviation",
    "coordinate_names",
    "inside_box",
    "inside_workspace",
    "least_reach_margin",
    "sample_workspace",
    "workspace_coordinates",
    "workspace_options",
]
