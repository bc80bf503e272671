# SPDX-License-Identifier: MIT
"""The words that options may be."""

from __future__ import annotations

from typing import Literal

Coordinates = Literal["x", "y", "z", "xy", "xz", "yz", "height"]
Criterion = Literal["O1", "O2", "O3", "O4", "O5", "expected_error"]
Design = Literal["legs", "orbits", "mechanism"]
Estimator = Literal["paper", "inverse", "implicit", "joint"]
Format = Literal["csv", "parquet"]
Frame = Literal["base", "target", "points", "anchors", "plane"]
Gauge = Literal["prior", "nominal", "datum"]
Judge = Literal["rms", "largest"]
Loss = Literal["none", "robust", "huber", "cauchy", "tukey"]
LossPer = Literal["pose", "reading"]
Moving = Literal["leg", "frame"]
Observable = Literal[
    "pose",
    "position",
    "orientation",
    "straightness",
    "points",
    "distance",
    "height",
    "attitude",
    "tilt",
    "separation",
    "rise",
    "offset",
    "reported",
    "readings",
]
Platform = Literal["rigid", "point", "translating", "spherical", "schoenflies"]
PoseUse = Literal["all", "own"]
Prior = Literal["tolerances", "fitted"]
RowKind = Literal["paper", "noise_aware"]
SelectionMethod = Literal["exchange", "sun_hollerbach", "exhaustive", "random", "all"]
Sensor = Literal["linear", "quadratic", "eccentric"]
SessionsOwn = Literal["offsets", "frames", "noise"]
Visit = Literal["there_and_back", "travel", "sets"]
