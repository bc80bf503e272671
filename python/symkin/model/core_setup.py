# SPDX-License-Identifier: MIT
"""A mechanism and what stands around it, as the core takes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from symkin import _core
from symkin.model.mechanism import Mechanism
from symkin.model.poses import Transform, frame
from symkin.model.settings import Frames
from symkin.values import Array


class Slopes(NamedTuple):
    """What changes from row to row, by unit of its covariate.

    Of every leg, by name and whether it is of lengths, else of readings, shape (legs, k); and of
    the base, by name, a tangent of six each.
    """

    of_legs: tuple[tuple[str, bool], ...]
    legs: Array
    of_base: tuple[str, ...]
    base: Array


def core_setup(mechanism: Mechanism, slopes: Slopes | None = None) -> _core.Setup:
    """The mechanism and its frames as the core takes them."""
    count = len(mechanism.legs)
    slopes = slopes or Slopes((), np.zeros((count, 0)), (), np.zeros((0, 6)))
    frames = mechanism.frames or Frames()
    base, target = (frame(mechanism.pose_space, each) for each in (frames.base, frames.target))
    plane = np.array([0.0, 0.0, 0.0, 0.0, 1.0])  # a bow of zero, at any radius
    plane[: len(frames.plane)] = frames.plane
    return _core.Setup(
        mechanism.straight,
        np.zeros((count, 3)) if mechanism.curvature is None else mechanism.curvature,
        to_core(base),
        to_core(target),
        _in_space(frames.points),
        _in_space(frames.anchors),
        plane,
        slopes.of_legs,
        slopes.legs,
        slopes.of_base,
        slopes.base,
        np.array(frames.zeros),
    )


def setup_with(
    setup: _core.Setup,
    robot: _core.Mechanism,
    *,
    curvature: Array | None = None,
    base: _core.Frame | None = None,
    target: _core.Frame | None = None,
    points: Array | None = None,
    base_slopes: Array | None = None,
) -> _core.Setup:
    """Return a setup with this robot in it, and of the rest what is not given as it was."""
    return _core.Setup(
        robot,
        np.array(setup.curvature if curvature is None else curvature),
        base or setup.base,
        target or setup.target,
        np.array(setup.points if points is None else points),
        np.array(setup.anchors),
        np.append(setup.plane, setup.bed_radius),
        setup.leg_covariates,
        np.array(setup.leg_slopes),
        setup.base_covariates,
        np.array(setup.base_slopes if base_slopes is None else base_slopes),
        np.array(setup.zeros),
    ).drawn_as(setup)


def frames_of(mechanism: Mechanism, setup: _core.Setup) -> Frames:
    """What stands around the robot, as settings."""
    size, shown = mechanism.space.size, mechanism.space.frame_components
    base, target = (of_core(each).tangent[shown] for each in (setup.base, setup.target))
    return Frames(
        base=tuple(base.tolist()),
        target=tuple(target.tolist()),
        points=tuple(map(tuple, setup.points[:, :size].tolist())),
        anchors=tuple(map(tuple, setup.anchors[:, :size].tolist())),
        zeros=tuple(setup.zeros.tolist()) if np.any(setup.zeros) else (),
        plane=_bed_of(setup) if size == 3 else (),
    )


def scalar_names(mechanism: Mechanism, setup: _core.Setup) -> tuple[str, ...]:
    """Names of all scalars of a setup, see `scalar_values`; empty for one that is not there."""
    return tuple(_core.unknown_names(mechanism.straight, setup))


def scalar_values(setup: _core.Setup) -> Array:
    """Values of all scalars of a setup in the order of their names; of frames, as they are written.

    A frame's rotation is its rotation vector, while its column of the estimate moves it locally.
    """
    legs = np.hstack([setup.parameters, setup.curvature])
    frames = [of_core(each).tangent for each in (setup.base, setup.target)]
    parts = [legs.ravel(), *frames, setup.points.ravel(), setup.anchors.ravel(), setup.plane]
    return np.concatenate(
        [*parts, setup.zeros, setup.leg_slopes.ravel(), setup.base_slopes.ravel()]
    )


def _bed_of(setup: _core.Setup) -> tuple[float, ...]:
    """The plane, and the bow and radius of a bed that has them."""
    *plane, bow = setup.plane.tolist()
    flat = bow == 0 and setup.bed_radius == 1
    return tuple(plane) if flat else (*plane, bow, setup.bed_radius)


def of_core(found: _core.Frame) -> Transform:
    """A frame as a motion."""
    return Transform(found.rotation, found.position)


def to_core(motion: Transform) -> _core.Frame:
    """A single motion as a frame."""
    return _core.Frame(motion.translation, motion.rotation)


def _in_space(points: Sequence[Sequence[float]]) -> Array:
    made = np.zeros((len(points), 3))
    for row, point in zip(made, points, strict=True):
        row[: len(point)] = point
    return made
