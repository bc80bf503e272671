# SPDX-License-Identifier: MIT
"""The options of Python, of files and of the command line: each is defined here, once.

An option has one name, written with hyphens on the command line, one type, one default, one check
and one help. Signatures repeat name, type and default, for editors to complete; a test compares.
"""

from symkin.options.arguments import checks
from symkin.options.option import Option
from symkin.options.table import OPTIONS, checked, flags_of
from symkin.options.words import (
    Coordinates,
    Criterion,
    Design,
    Estimator,
    Format,
    Frame,
    Gauge,
    Judge,
    Loss,
    LossPer,
    Moving,
    Observable,
    Platform,
    PoseUse,
    Prior,
    RowKind,
    SelectionMethod,
    Sensor,
    SessionsOwn,
    Visit,
)

__all__ = [
    "OPTIONS",
    "Coordinates",
    "Criterion",
    "Design",
    "Estimator",
    "Format",
    "Frame",
    "Gauge",
    "Judge",
    "Loss",
    "LossPer",
    "Moving",
    "Observable",
    "Option",
    "Platform",
    "PoseUse",
    "Prior",
    "RowKind",
    "SelectionMethod",
    "Sensor",
    "SessionsOwn",
    "Visit",
    "checked",
    "checks",
    "flags_of",
]
