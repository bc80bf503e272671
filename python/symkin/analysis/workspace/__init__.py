# SPDX-License-Identifier: MIT
"""The workspace without singularities: samples of it, and what is inside."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.data.columns import pose_column_names, reading_column_names
from symkin.data.sensor_tables import shown_readings
from symkin.errors import MechanismError, MechanismFileError, SymkinError, named_legs
from symkin.model.file_frames import as_drawn
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows, vectors_from_quaternions
from symkin.model.tolerances import parameter_tolerances
from symkin.options import checks
from symkin.results import Result
from symkin.storage.toml_file import read_toml
from symkin.values import Array, field, record

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

_CAUSES = "reach", "limits", "aspect", "conditioning"
_MARGIN_SIGMAS = 3.0  # as `make_plan` keeps by default
_SINGULAR = 1e8  # condition number that rounding cannot tell from infinity
_TRIED = 2000  # poses of the box, for one that home could be


@record
class WorkspaceSample(Result):
    """Poses drawn from the workspace.

    Whatever takes an array of poses takes a sample, too.

    Attributes
    ----------
    poses : ndarray, shape (N, coordinates)
        Uniform in the workspace's box, less what was rejected.
    readings : ndarray, shape (N, legs)
        The sensor readings at the poses.
    conditions : ndarray, shape (N,)
        Condition number of dq/dpose at each pose, see `Mechanism.singularity_measures`.
    drawn : int
        How many poses were drawn from the box for them.
    rejected : dict of str to int
        How many were rejected: "reach", "limits", "aspect", "conditioning".
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        Kind of the poses.
    reading_unit : {"rad", "m"}
        Of the readings.
    shown : ndarray, shape (N, legs), or None
        What the sensors show, of a mechanism with a `SensorTable`: files have it.
    as_drawn : ndarray, shape (N, coordinates), or None
        The poses in the frames of the mechanism's file: tables have them.
    """

    poses: Array = field(private=True)
    readings: Array = field(private=True)
    conditions: Array = field(private=True)
    drawn: int
    rejected: Mapping[str, int]
    pose_space: str = field(private=True)
    reading_unit: str = field(private=True)
    shown: Array | None = field(private=True, default=None)
    as_drawn: Array | None = field(private=True, default=None)
    derived = ("share",)

    @property
    def share(self) -> float:
        """Share of the box that the workspace takes."""
        return 1 - sum(self.rejected.values()) / self.drawn

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return poses, readings and condition numbers as symkin's files have them."""
        poses = pose_column_names(self.pose_space)
        shown = self.readings if self.shown is None else self.shown
        readings = reading_column_names(shown.shape[1], self.reading_unit)
        drawn = self.poses if self.as_drawn is None else self.as_drawn
        table = np.hstack([drawn, shown, self.conditions[:, np.newaxis]])
        return dict(zip([*poses, *readings, "condition"], table.T, strict=True))

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.poses)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return the poses."""
        values = self.poses if dtype is None else self.poses.astype(dtype, copy=False)
        return values.copy() if copy else values


@checks()
def sample_workspace(
    mechanism: MechanismGiven, candidates: int | None = None, seed: int | None = None
) -> WorkspaceSample:
    """Draw poses that every leg reaches, in the aspect of home and away from singularities.

    Parameters
    ----------
    mechanism : Mechanism
        With its workspace settings.
    candidates : int, optional
        Number of poses, by default the protocol's.
    seed : int, optional
        By default the protocol's. The same seed gives the same poses.

    Raises
    ------
    SymkinError
        If the mechanism has no workspace, its home is not in it, or hardly any pose of its box is.
    """
    mechanism = as_mechanism(mechanism)
    options = workspace_options(mechanism)
    _require_usable_home(mechanism, options.reach_margin)
    sample = _core.sample_workspace(
        mechanism.straight,
        options,
        mechanism.protocol.candidates if candidates is None else candidates,
        mechanism.protocol.seed if seed is None else seed,
    )
    readings = mechanism.curved(sample.readings)
    lost = int(np.isnan(readings).any(axis=1).sum())
    if lost:
        raise SymkinError(
            f'the sensors of "{mechanism.name}" show nothing at {lost} of {len(readings)} poses of '
            "the workspace: they are so curved that they turn back before; expected terms that are "
            "small beside the gain"
        )
    return WorkspaceSample(
        poses=sample.poses,
        readings=readings,
        conditions=sample.conditions,
        drawn=sample.drawn,
        rejected={cause: getattr(sample.rejections, cause) for cause in _CAUSES},
        pose_space=mechanism.pose_space,
        reading_unit=mechanism.reading_unit,
        shown=None
        if mechanism.sensor_table is None and mechanism.is_read.all()
        else shown_readings(mechanism, readings)[:, mechanism.is_read],
        as_drawn=as_drawn(mechanism, sample.poses),
    )


def inside_workspace(mechanism: Mechanism, poses: ArrayLike) -> NDArray[np.bool_]:
    """Whether each pose meets the workspace's demands, shape (N,); its box is not asked."""
    options = workspace_options(mechanism)
    return np.array(_core.inside_workspace(mechanism.straight, options, pose_rows(poses)))


def _rows(mechanism: Mechanism, poses: ArrayLike) -> Array:
    """Poses as rows of as many columns as the mechanism's have."""
    rows = pose_rows(poses)
    if rows.ndim != 2 or rows.shape[1] != len(mechanism.home):
        raise MechanismError(
            f"poses have shape {rows.shape}; expected (N, {len(mechanism.home)}) of "
            f'"{mechanism.name}"'
        )
    return rows


def coordinate_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of a workspace's coordinates: position, then angle or rotation vector."""
    return tuple(mechanism.space.units)


def workspace_coordinates(mechanism: Mechanism, poses: ArrayLike) -> Array:
    """Poses in a workspace's coordinates, shape (N, dof): m, and rad in (-pi, pi]."""
    rows = _rows(mechanism, poses)
    if not mechanism.space.turns:
        return rows
    if mechanism.space.has_angle:
        turned = np.pi - np.remainder(np.pi - rows[:, -1:], 2 * np.pi)
        return np.hstack([rows[:, :-1], turned])
    return np.hstack([rows[:, :-4], vectors_from_quaternions(rows[:, -4:])])


def inside_box(mechanism: Mechanism, poses: ArrayLike) -> NDArray[np.bool_]:
    """Whether each pose lies in the workspace's box, shape (N,); always without a workspace."""
    rows = _rows(mechanism, poses)
    workspace = mechanism.workspace
    inside = np.ones(len(rows), dtype=np.bool_)
    if workspace is None:
        return inside
    angle = mechanism.space.has_angle
    columns = (rows if angle else workspace_coordinates(mechanism, rows)).T.copy()
    if angle:
        # A box may reach beyond half a turn.
        centre = (workspace.lower[-1] + workspace.upper[-1]) / 2
        columns[-1] -= 2 * np.pi * np.rint((columns[-1] - centre) / (2 * np.pi))
    slack = 1e-9  # of an image that rounding has put on the other side
    for free in mechanism.free:
        lower, upper = workspace.lower[free], workspace.upper[free]
        inside &= (columns[free] >= lower - slack) & (columns[free] <= upper + slack)
    return inside


def interpolated(axes: Sequence[Array], values: Array, points: Array) -> Array:
    """Multilinear interpolation on a grid, shape (N, k); NaN beside a node that is NaN."""
    lower, share = [], []
    for axis, column in zip(axes, points.T, strict=True):
        last = max(len(axis) - 2, 0)
        cell = np.clip(np.searchsorted(axis, column, side="right") - 1, 0, last)
        width = axis[cell + 1] - axis[cell] if len(axis) > 1 else np.ones(len(column))
        lower.append(cell)
        share.append((column - axis[cell]) / width)
    found = np.zeros((len(points), values.shape[-1]))
    for corner in itertools.product(*([(0, 1) if len(axis) > 1 else (0,) for axis in axes])):
        weight = np.ones(len(points))
        for up, part in zip(corner, share, strict=True):
            weight *= part if up else 1 - part
        index = tuple(cell + up for cell, up in zip(lower, corner, strict=True))
        found += weight[:, None] * values[index]
    return found


def closure_deviation(mechanism: Mechanism, poses: Array) -> float:
    """Standard deviation of the closures of legs as the workshop makes them, m or rad.

    The largest of all legs and poses; zero where no leg can reach.
    """
    poses = _rows(mechanism, poses)
    readings = mechanism.inverse_kinematics(poses)
    largest = 0.0
    for leg, tolerances in enumerate(parameter_tolerances(mechanism)):
        rows = mechanism.linearised(leg, poses, readings[:, leg]).by_parameters
        rows = rows[:: mechanism.closures]  # those of which the reach has an end
        deviations = np.linalg.norm(rows * tolerances, axis=1)
        largest = max(largest, float(np.nanmax(deviations, initial=0.0)))
    return largest


def least_reach_margin(mechanism: Mechanism) -> float:
    """Distance (m, spherical: rad) that every leg keeps from its limits of reach in the workspace.

    Where the workspace does not say, a robot within its tolerances should follow; but never so far
    that home would be out of reach.
    """
    settings = mechanism.workspace
    if settings is not None and settings.reach_margin is not None:
        return settings.reach_margin
    home = np.atleast_2d(mechanism.home)
    kept_at_home = float(_core.reach_margin(mechanism.straight, home).min())
    return min(_MARGIN_SIGMAS * closure_deviation(mechanism, home), max(0.0, kept_at_home / 2))


def workspace_options(mechanism: Mechanism) -> _core.WorkspaceOptions:
    """Workspace settings and joint limits as the core takes them."""
    settings = mechanism.workspace
    if settings is None:
        raise SymkinError(
            f'mechanism "{mechanism.name}" has no workspace; give it WorkspaceSettings, or a '
            "[workspace] table in its file"
        )
    options = _core.WorkspaceOptions()
    options.lower = np.array(settings.lower, dtype=float)
    options.upper = np.array(settings.upper, dtype=float)
    options.reach_margin = least_reach_margin(mechanism)
    options.conditioning_limit = settings.conditioning_limit
    options.characteristic_length = mechanism.characteristic_length
    options.home = mechanism.home
    limits = np.array(mechanism.reading_limits)
    straight = mechanism.straightened(np.where(np.isfinite(limits), limits, 0.0))
    options.reading_lower, options.reading_upper = np.where(np.isfinite(limits), straight, limits)
    return options


def _require_usable_home(mechanism: Mechanism, reach_margin: float) -> None:
    """Refuse a home pose that is not in the workspace whose aspect it defines.

    With the figure, the limit that it misses and what to try; of a mechanism that was read from a
    file with the line.
    """
    settings = mechanism.workspace
    assert settings is not None
    home = f"the home pose {_listed(mechanism, settings.home_or_origin)}"
    unit = mechanism.space.closure_unit
    margins = _core.reach_margin(mechanism.straight, mechanism.home[None])[0]
    if not (margins >= reach_margin).all():
        leg = int(np.argmin(margins))
        inside = f"{margins[leg]:.3g} {unit} within the reach of"
        what = inside if margins[leg] >= 0 else "out of reach of"
        raise _refusal(
            mechanism,
            f"{home} is {what} {named_legs([leg])}, and reach_margin is "
            f"{reach_margin:g} {unit}; {_another(mechanism)}, or lower reach_margin",
        )
    condition = float(mechanism.singularity_measures(mechanism.home)[2][0])
    if not condition <= settings.conditioning_limit:
        singular = not condition < _SINGULAR
        what = "is singular (condition number infinite)"
        if not singular:
            what = f"has the condition number {condition:.3g}"
        limit = f"conditioning_limit is {settings.conditioning_limit:g}"
        raise _refusal(
            mechanism,
            f"{home} {what}, and {limit}; {_another(mechanism)}"
            + ("" if singular else ", or raise conditioning_limit"),
        )


def best_homes(mechanism: Mechanism) -> list[tuple[list[float], float]]:
    """Well-conditioned poses of the box, the best on each side of the parallel singularities.

    Coordinates, as `WorkspaceSettings.home` has them, and the condition number; best first. None if
    none of many poses would do.
    """
    settings = mechanism.workspace
    assert settings is not None
    random = np.random.default_rng(0)
    values = random.uniform(settings.lower, settings.upper, (_TRIED, mechanism.straight.dof)).round(
        3
    )
    poses = mechanism.poses_at(values)
    readings = mechanism.inverse_kinematics(poses)
    usable = mechanism.within_limits(readings).all(axis=1)
    margins = _core.reach_margin(mechanism.straight, poses)
    usable &= (margins >= least_reach_margin(mechanism)).all(axis=1)
    _, sides, conditions = mechanism.singularity_measures(poses)
    usable &= conditions <= settings.conditioning_limit
    found = []
    for side in (sides > 0, sides < 0):
        if (usable & side).any():
            best = int(np.argmin(np.where(usable & side, conditions, np.inf)))
            found.append((values[best].tolist(), float(conditions[best])))
    return sorted(found, key=lambda each: each[1])


def _another(mechanism: Mechanism) -> str:
    """What to try: a well-conditioned pose of the box, if it has one."""
    homes = best_homes(mechanism)
    if not homes:
        return (
            f"none of {_TRIED} poses of the workspace box would do either: change the box, or the "
            "geometry"
        )
    values, condition = homes[0]
    return (
        f"try another home, such as {_listed(mechanism, values)} (m, rad), whose condition number "
        f"is {condition:.3g}"
    )


def _listed(mechanism: Mechanism, values: tuple[float, ...] | list[float]) -> str:
    return "(" + ", ".join(f"{values[each]:g}" for each in mechanism.free) + ")"


def _refusal(mechanism: Mechanism, message: str) -> SymkinError:
    """At its line, if the file from which the mechanism was read is still there."""
    if mechanism.source is not None:
        try:
            return read_toml(mechanism.source).error(("workspace", "home"), message)
        except MechanismFileError:
            pass
    return SymkinError(f'mechanism "{mechanism.name}": {message}')
