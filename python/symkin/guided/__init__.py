# SPDX-License-Identifier: MIT
"""Guided measuring: what to measure next, whether a row is right, and when it is enough."""

from symkin.guided.beginning import measure
from symkin.guided.checks import Verdict
from symkin.guided.session import Ask, Progress, Session
from symkin.guided.simulated import SimulatedDevice

__all__ = ["Ask", "Progress", "Session", "SimulatedDevice", "Verdict", "measure"]
