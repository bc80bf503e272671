# SPDX-License-Identifier: MIT
"""What formats have in common: their options, what they write, and what they cannot express."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from symkin.analysis.evaluation import Evaluation, evaluate
from symkin.analysis.workspace import inside_workspace, sample_workspace
from symkin.errors import SymkinError
from symkin.model.mechanism import Mechanism
from symkin.values import Array, Value, field, record

_POSES = 2000
_STEPS = 30
_STILL = 1e-11  # m, of the root mean square of what a step changes at the end-effector


# Begins the comment of a model that says what bodies and joints cannot.
MARK = "symkin:"


@record
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


@record
class Written:
    """What a format made of a mechanism: its text, what to know, and what was lost."""

    text: str
    notes: tuple[str, ...] = ()
    loss: Loss | None = None


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
