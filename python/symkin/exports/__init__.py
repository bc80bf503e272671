# SPDX-License-Identifier: MIT
"""Mechanisms in the formats of controllers and simulators, and printers read from theirs.

A format is one function that makes a text of a mechanism. What it cannot express it refuses, or it
writes the nearest that it can and says what is lost, as errors of the end-effector.
"""

from symkin.exports.common import Loss
from symkin.exports.exporting import FORMATS, Exported, Format, export, joint_values
from symkin.exports.reading import Imported, import_mechanism

__all__ = [
    "FORMATS",
    "Exported",
    "Format",
    "Imported",
    "Loss",
    "export",
    "import_mechanism",
    "joint_values",
]
