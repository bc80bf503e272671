# SPDX-License-Identifier: MIT
"""Where pages look for the figures of a workspace."""

from symkin.plot.former import active_joint_figure as active_joint_figure
from symkin.plot.former import constant_orientation_figure as constant_orientation_figure
