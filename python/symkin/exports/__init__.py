# SPDX-License-Identifier: MIT
"""Mechanisms in the formats of controllers and simulators, and printers read from theirs.

A format is one function that makes a text of a mechanism. What it cannot express it refuses, or it
writes the nearest that it can and says what is lost, as errors of the end-effector.
"""

from __future__ import annotations

import importlib
import itertools
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import MechanismError, SymkinError, one_of
from symkin.evaluation import Evaluation, evaluate
from symkin.io.output_files import OutputFiles
from symkin.mechanism import Mechanism
from symkin.result import Value, field, record
from symkin.workspace import inside_workspace, sample_workspace

__all__ = ["FORMATS", "Exported", "Format", "Loss", "export", "joint_values"]


Array = NDArray[np.float64]

_POSES = 2000
_STEPS = 30
_STILL = 1e-11  # m, of the root mean square of what a step changes at the end-effector


# Begins the comment of a model that says what bodies and joints cannot.
MARK = "symkin:"


@dataclass(frozen=True)
class ExportOptions:
    """What some formats need besides the mechanism, as `export` takes it."""

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

    @classmethod
    def of(cls, errors: Evaluation, means: str) -> Loss:
        """The figures of errors at poses that can all be taken by these means."""
        if errors.failed:
            raise SymkinError(
                f"{errors.failed} of {errors.failed + errors.evaluated} poses of the workspace "
                f"cannot be taken {means}; make the workspace smaller"
            )
        names = ("position_max", "position_rms", "orientation_max", "orientation_rms", "evaluated")
        return cls(*(getattr(errors, name) for name in names))

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


class Format(NamedTuple):
    """Where a format is written, and what it is.

    Attributes
    ----------
    module, function : str
        In `symkin.exports`; imported when it is used.
    description : str
        For a list.
    """

    module: str
    function: str
    description: str


FORMATS = {
    "klipper": Format("firmware", "write_klipper", "sections of printer.cfg; deltas"),
    "marlin": Format("firmware", "write_marlin", "M665, M666; linear deltas"),
    "reprapfirmware": Format("firmware", "write_reprapfirmware", "M665, M666; linear deltas"),
    "linuxcnc": Format("firmware", "write_linuxcnc", "hexapods and linear deltas"),
    "mjcf": Format("models", "write_mjcf", "MuJoCo, loops closed by constraints"),
    "urdf": Format("models", "write_urdf", "a tree, loops cut"),
    "sdf": Format("models", "write_sdf", "Gazebo, loops closed by ball joints"),
    "json": Format("parameters", "write_json", "parameters, units, deviations"),
    "yaml": Format("parameters", "write_yaml", "the same"),
    "c-header": Format("parameters", "write_c_header", "constants of C and C++"),
    "table": Format("parameters", "write_table", "pose wanted, pose to command"),
}
# Which formats use what else may be said; others refuse it.
_TAKEN_BY = {
    "endstops": ("klipper", "marlin", "reprapfirmware", "linuxcnc"),
    "nominal": ("table",),
    "grid": ("table",),
}


def export(
    mechanism: Mechanism,
    to: str,
    path: str | os.PathLike[str] | None = None,
    *,
    endstops: float | Sequence[float] = (),
    nominal: Mechanism | None = None,
    grid: int = 0,
    overwrite: bool = False,
) -> Exported:
    """Write a mechanism in the format of a controller or a simulator.

    Parameters
    ----------
    mechanism : Mechanism
        Usually a calibrated one.
    to : str
        One of `symkin.exports.FORMATS`.
    path : str or path, optional
        The file to write; without it there is only the text.
    endstops : float or sequence of float
        What the sensors read at their endstops, m or rad: one number, or one for each leg. By
        default the joint limit: of linear deltas the upper, of rotary deltas the lower one. For
        "klipper", "marlin", "reprapfirmware" and "linuxcnc" of deltas.
    nominal : Mechanism, optional
        What the controller computes with; for "table".
    grid : int
        Poses along each coordinate of a table; 0 for 21, and 5 of six coordinates.
    overwrite : bool
        Whether `path` may exist.

    Returns
    -------
    Exported
        The text, what else to know, and what was lost.

    Raises
    ------
    SymkinError
        For an unknown format, or a robot that the format cannot express, with the reason.
    """
    chosen: Format = one_of("to", to, FORMATS)
    stops = tuple(np.atleast_1d(np.asarray(endstops, dtype=np.float64)).tolist())
    options = ExportOptions(stops, nominal, grid)
    for name, formats in _TAKEN_BY.items():
        if getattr(options, name) and to not in formats:
            raise SymkinError(
                f'the format "{to}" has no use for {name}; expected only with {", ".join(formats)}'
            )
    if mechanism.sensor_table is not None:
        raise MechanismError(
            f'the sensors of "{mechanism.name}" are made straight by a table, which no format has; '
            "take [sensor_table] out of its file if the controller itself makes them straight"
        )
    module = importlib.import_module(f"symkin.exports.{chosen.module}")
    if path is None:
        written: Written = getattr(module, chosen.function)(mechanism, options)
    else:
        inputs = [*mechanism.files, *(nominal.files if nominal else ())]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.file(Path(path))
            written = getattr(module, chosen.function)(mechanism, options)
            target.write_text(written.text, encoding="utf-8", newline="")
    return Exported(to, written.text, written.notes, written.loss)


def joint_values(mechanism: Mechanism, poses: ArrayLike) -> dict[str, np.ndarray]:
    """Values of all joints of an exported model at poses, passive ones too.

    Parameters
    ----------
    mechanism : Mechanism
        As it was exported.
    poses : array_like, shape (N, coordinates)
        In reach; where it is not, values are NaN.

    Returns
    -------
    dict of str to ndarray, shape (N,) or (N, 7)
        By the names of the joints in the MJCF and URDF files, m and rad: put into them, they close
        the loops. The joint ``platform`` of a spatial robot has position and quaternion, scalar
        first. In an SDF file joints count from home: subtract the values there.

    Raises
    ------
    SymkinError
        As `export` to a model does.
    """
    from symkin.exports.models import structure_of

    return dict(structure_of(mechanism, poses).values)


def workspace_poses(mechanism: Mechanism) -> Array:
    """Poses all over the workspace and in those corners of its box that belong to it."""
    poses = sample_workspace(mechanism, _POSES, seed=1).poses
    assert mechanism.workspace is not None  # or it could not be sampled
    bounds = zip(mechanism.workspace.lower, mechanism.workspace.upper, strict=True)
    corners = mechanism.poses_at(list(itertools.product(*bounds)))
    return np.vstack([poses, corners[inside_workspace(mechanism, corners)]])


def nearest(
    actual: Mechanism, start: Mechanism, unknowns: Sequence[Iterable[tuple[int, str]]], poses: Array
) -> Mechanism:
    """Fit a mechanism so that a robot that it commands errs least at the poses.

    Gauss-Newton on what `evaluate` shows: the robot's pose moves by (dg/dpose)^-1 of the robot
    times dg/dparam of the model. A rotation counts as the way of a point at the characteristic
    length. The robot has as many legs as degrees of freedom; `start` is as the format can express
    it, and each of the unknowns is the parameters (leg from 0, name) that change alike.

    Raises
    ------
    SymkinError
        If the legs bind the platform, the fit does not come to rest, or a pose cannot be taken.
    """
    if actual.bound:
        raise SymkinError(
            f'the legs of "{actual.name}" bind its platform; expected one whose coordinates can '
            "all be commanded"
        )
    names = start.parameter_names
    scale = np.ones(actual.space.dof)
    scale[actual.space.size :] = actual.characteristic_length
    forward = np.linalg.inv(actual.pose_jacobian(poses)) * scale[:, None]
    model = start
    for _ in range(_STEPS):
        errors = evaluate(model, actual=actual, poses=poses).differences * scale
        columns = [np.zeros(errors.shape) for _ in unknowns]
        for leg in range(len(actual.legs)):
            slopes = model.parameter_jacobian(leg, poses)
            for column, members in zip(columns, unknowns, strict=True):
                for name in (name for owner, name in members if owner == leg):
                    column += forward[:, :, leg] * slopes[:, names.index(name), None]
        matrix = np.column_stack([column.ravel() for column in columns])
        if not (np.isfinite(matrix).all() and np.isfinite(errors).all()):
            raise SymkinError(
                f'the nearest "{actual.name}" that the format can express does not reach all of '
                "the workspace; make the workspace smaller"
            )
        weights = np.linalg.norm(matrix, axis=0)
        scaled = matrix / weights
        # Normal equations: steps that they leave inexact are repeated, and rows are thousands.
        step = -np.linalg.lstsq(scaled.T @ scaled, scaled.T @ errors.ravel())[0] / weights
        values = model.parameters.copy()
        for change, members in zip(step, unknowns, strict=True):
            for leg, name in members:
                values[leg, names.index(name)] += change
        model = model.with_parameters(values)
        if np.linalg.norm(matrix @ step) / np.sqrt(len(poses)) < _STILL:
            return model
    raise SymkinError(
        f'no mechanism that the format can express is near "{actual.name}": the fit did not come '
        f"to rest in {_STEPS} steps"
    )


def named_columns(mechanism: Mechanism) -> dict[str, Array]:
    """Each parameter of all legs, shape (legs,), by its name."""
    return dict(zip(mechanism.parameter_names, mechanism.parameters.T, strict=True))


def loss_of(actual: Mechanism, model: Mechanism, poses: Array) -> Loss:
    """Errors of a robot that is commanded by what a format says of it."""
    errors = evaluate(model, actual=actual, poses=poses)
    return Loss.of(errors, "with what the format can express")
