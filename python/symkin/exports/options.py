# SPDX-License-Identifier: MIT
"""What the formats are told, and what they hand back."""

from __future__ import annotations

from dataclasses import dataclass

from symkin.mechanism import Mechanism
from symkin.result import Value, field, record

__all__ = ["MARK", "ExportOptions", "Exported", "Loss", "Written"]

# Begins the comment of a model that says what bodies and joints cannot.
MARK = "symkin:"


@dataclass(frozen=True)
class ExportOptions:
    """What some formats need besides the mechanism.

    Attributes
    ----------
    endstops : tuple of float
        Readings of the sensors at their endstops: one for all legs, or one a leg. Empty for the
        upper joint limit of the mechanism.
    nominal : Mechanism or None
        What a controller computes with that knows no better.
    grid : int
        Poses of a correction table along each coordinate; 0 for what suits the coordinates.
    """

    endstops: tuple[float, ...] = ()
    nominal: Mechanism | None = None
    grid: int = 0


@record
class Loss(Value):
    """What a format cannot express, as errors of the end-effector in the workspace.

    Attributes
    ----------
    position_max, position_rms : float
        m, of the distance.
    orientation_max, orientation_rms : float
        rad; zero for a platform that does not turn.
    poses : int
        Of the workspace, drawn at random, of which these are the figures.
    """

    position_max: float = field(unit="m")
    position_rms: float = field(unit="m")
    orientation_max: float = field(unit="rad")
    orientation_rms: float = field(unit="rad")
    poses: int

    def __str__(self) -> str:
        """Say the largest."""
        turned = f" and {self.orientation_max:.3g} rad" if self.orientation_max > 0 else ""
        way = "less than 0.0001" if self.position_max < 1e-7 else f"{self.position_max * 1e3:.3g}"
        return f"{way} mm{turned}, the largest of {self.poses} poses"


@dataclass(frozen=True)
class Written:
    """What a format made of a mechanism: its text, what to know, and what was lost."""

    text: str
    notes: tuple[str, ...] = ()
    loss: Loss | None = None


@record
class Exported(Value):
    """A mechanism in another format.

    Attributes
    ----------
    format : str
        One of `symkin.exports.FORMATS`.
    text : str
        What the file holds.
    notes : tuple of str
        What a person must know or do besides.
    loss : Loss or None
        The errors that remain when a controller uses the file; None for a format that holds
        everything.
    """

    format: str
    text: str = field(private=True)
    notes: tuple[str, ...]
    loss: Loss | None
