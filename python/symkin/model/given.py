# SPDX-License-Identifier: MIT
"""What people give for a mechanism: one, its file, or the name of one that comes with symkin."""

from __future__ import annotations

import importlib
import os
from typing import Any

from typing_extensions import TypeVar

from symkin.errors import MechanismError, shown
from symkin.model.mechanism import Mechanism

# What a mechanism is given as; of whatever class it is, what is made of it has that class too.
Given = TypeVar("Given", bound=Mechanism, default=Mechanism)
MechanismGiven = Mechanism | str | os.PathLike[str]


def as_mechanism(given: Given | str | os.PathLike[str], name: str = "mechanism") -> Given:
    """Return a mechanism, read from its file if that is what was given.

    Raises
    ------
    MechanismError
        For anything else, naming it.
    MechanismFileError
        For a file that cannot be read.
    """
    if isinstance(given, Mechanism):
        return given
    if not isinstance(given, str | os.PathLike):
        raise MechanismError(
            f"{shown(given)} is given as the {name}; expected a Mechanism, the path of its file, "
            'or a name such as "3RRR"'
        )
    # A robot has the verbs of all rooms above; this is where one is asked for from below.
    robot: Any = importlib.import_module("symkin.robot")
    read: Given = robot.load_mechanism(given)
    return read
