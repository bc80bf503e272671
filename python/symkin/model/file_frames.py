# SPDX-License-Identifier: MIT
"""Where a mechanism's frames and points stand: in its file, and once they are identified."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from symkin.errors import SymkinError
from symkin.model.chains import ChainInfo
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.poses import (
    POSE_SPACES,
    STAYS,
    Transform,
    coordinates_of,
    in_plane,
    nearest_rotation,
    pose_rows,
    rotations_from_vectors,
    transforms,
)
from symkin.model.settings import DrawnPoints, Frames, WorkspaceSettings
from symkin.model.symmetry import detect_symmetry
from symkin.model.symmetry.comparison import scaled_tolerance
from symkin.model.symmetry.groups import detect_within
from symkin.values import Array

# A centre serves if no leg is much nearer to its axis than the legs are to each other, where small
# errors of a point would be large ones of its azimuth, and none is much farther away.
_NEAREST, _FARTHEST = 0.2, 4.0
_SAME = 1e-9  # of the points' spread: the same centre
_RING = 12  # centres that are tried around the centroid, at half the spread
_TURN = 2 * np.pi
_MOVED = 5.0  # expected displacements of a frame, beyond which it is another one


def _motions(points: DrawnPoints) -> tuple[Transform, Transform]:
    """From the mechanism's frames of base and platform to those of its file."""
    moves = np.zeros((2, 3))
    for move, centre in zip(moves, (points.base, points.platform), strict=True):
        move[: len(centre or ())] = centre or ()
    return Transform(np.eye(3), moves[0]), Transform(np.eye(3), moves[1])


def as_drawn(mechanism: Mechanism, poses: ArrayLike) -> Array:
    """Return poses in a mechanism's own frames as the frames of its file have them.

    Parameters
    ----------
    mechanism : Mechanism
        Whose `points` say where the frames are.
    poses : array_like, shape (N, coordinates)
        m and rad (spatial: position and quaternion).

    Returns
    -------
    ndarray, shape (N, coordinates)
    """
    return _carried(mechanism, poses, inverse=False)


def from_drawing(mechanism: Mechanism, poses: ArrayLike) -> Array:
    """Return poses in the frames of a mechanism's file in its own: `as_drawn` back.

    Parameters
    ----------
    mechanism : Mechanism
    poses : array_like, shape (N, coordinates)

    Returns
    -------
    ndarray, shape (N, coordinates)
    """
    return _carried(mechanism, poses, inverse=True)


def _carried(mechanism: Mechanism, given: ArrayLike, *, inverse: bool) -> Array:
    poses, points = pose_rows(given), mechanism.points
    if poses.ndim != 2 or poses.shape[1] != mechanism.space.coordinates:
        raise SymkinError(
            f"poses have the shape {poses.shape}; expected N rows of {mechanism.space.coordinates}"
        )
    if points is None or not points.moved:
        return poses
    base, platform = _motions(points)
    if inverse:
        base, platform = base.inverse, platform.inverse
    # The frames' axes are parallel, so that orientations stay as they are.
    size = mechanism.space.size
    if not (mechanism.space.turns and platform.translation.any()):
        shift = np.zeros(poses.shape[1])
        shift[:size] = (base.translation - platform.translation)[:size]
        return np.asarray(poses + shift)  # each coordinate by itself: some may not be known
    carried = base @ transforms(mechanism.pose_space, poses) @ platform.inverse
    made = np.array(poses, dtype=float)
    made[:, :size] = carried.translation[:, :size]
    return made


def own_workspace(
    pose_space: str, settings: WorkspaceSettings | None, points: DrawnPoints
) -> WorkspaceSettings | None:
    """Home and box of a file in the mechanism's frames; the box is the one around its image."""
    if settings is None or not points.moved:
        return settings
    base, platform = _motions(points)
    return _workspace_in(pose_space, settings, base.inverse, platform.inverse)


def drawn_workspace(mechanism: Mechanism) -> WorkspaceSettings | None:
    """Home and box as the file of a mechanism has them, or would have them."""
    points, settings = mechanism.points, mechanism.workspace
    if points is None or settings is None or not points.moved:
        return settings
    carried = _workspace_in(mechanism.pose_space, settings, *_motions(points))
    given, before = points.workspace, own_workspace(mechanism.pose_space, points.workspace, points)
    if given is None or before is None:
        return carried
    # What has not changed stays as the file has it: a box that is carried to and fro grows.
    if (before.lower, before.upper) == (settings.lower, settings.upper):
        carried = dataclasses.replace(carried, lower=given.lower, upper=given.upper)
    if before.home == settings.home:
        carried = dataclasses.replace(carried, home=given.home)
    return carried


def _workspace_in(
    pose_space: str, settings: WorkspaceSettings, base: Transform, platform: Transform
) -> WorkspaceSettings:
    if platform.translation.any() and POSE_SPACES[pose_space].turns:
        return moved_workspace(pose_space, settings, base, platform)
    size = POSE_SPACES[pose_space].size
    shift = np.zeros(len(settings.lower))
    shift[:size] = (base.translation - platform.translation)[:size]
    lower, upper, home = (
        tuple((np.array(each) + shift).tolist())
        for each in (settings.lower, settings.upper, settings.home_or_origin)
    )
    return dataclasses.replace(settings, lower=lower, upper=upper, home=home)


def own_frames(pose_space: str, frames: Frames, points: DrawnPoints) -> Frames | None:
    """What a file says of frames, for the mechanism's own; None if nothing."""
    base, platform = _motions(points)
    return _frames_in(pose_space, frames, base, platform) if points.moved else _or_none(frames)


def drawn_frames(mechanism: Mechanism) -> Frames | None:
    """The frames of a mechanism as its file has them, or would have them."""
    points = mechanism.points
    if points is None or mechanism.frames is None or not points.moved:
        return mechanism.frames
    base, platform = _motions(points)
    return _frames_in(mechanism.pose_space, mechanism.frames, base.inverse, platform.inverse)


def _frames_in(
    pose_space: str, frames: Frames, base: Transform, platform: Transform
) -> Frames | None:
    """Frames for base and platform frames that stand elsewhere, by translations, than before."""
    space = POSE_SPACES[pose_space]
    count, size = len(space.frame_components), space.size
    outer, inner = (np.array(each or (0.0,) * count) for each in (frames.base, frames.target))
    turn = np.zeros((1, 3))
    turn[0, 3 - (count - size) :] = outer[size:]
    turned = transforms("spatial", np.hstack([np.zeros((1, 3)), turn])).rotation[0]
    outer[:size] += (turned @ base.translation)[:size]
    inner[:size] -= platform.translation[:size]
    plane: tuple[float, ...] = ()
    if space.in_space:  # z = 0 if nobody says so, in these frames or in those
        c0, c1, c2, *bowed = frames.plane or (0.0, 0.0, 0.0)
        x, y, z = base.translation.tolist()
        bend = bowed[0] / bowed[1] ** 2 if bowed else 0.0
        c0 += (c1 + bend * x) * x + (c2 + bend * y) * y - z
        plane = (c0, c1 + 2 * bend * x, c2 + 2 * bend * y, *bowed)
    points = tuple(
        tuple((np.array(each) - platform.translation[:size]).tolist()) if len(each) else ()
        for each in frames.points
    )
    made = dataclasses.replace(
        frames,
        base=tuple(outer.tolist()) if outer.any() else (),
        target=tuple(inner.tolist()) if inner.any() else (),
        points=points,
        plane=plane if any(plane) else (),
    )
    return _or_none(made)


def _or_none(frames: Frames) -> Frames | None:
    return frames if any(vars(frames).values()) else None


def point_parameters(info: ChainInfo, end: str) -> dict[str, str]:
    """Names of the parameters of an end's point by their kind; empty if it has no point."""
    kinds = ("radius", "azimuth", "polar_angle", "height")
    roles = info.parameter_roles.items()
    found = {role.kind: name for name, role in roles if role.end == end and role.kind in kinds}
    return found if "radius" in found else {}


def cartesian(values: Mapping[str, Array]) -> Array:
    """Coordinates (..., 2 or 3) of points by their radius, azimuth, and polar angle or height."""
    radius, azimuth = values["radius"], values["azimuth"]
    level = radius * np.sin(values["polar_angle"]) if "polar_angle" in values else radius
    flat = [level * np.cos(azimuth), level * np.sin(azimuth)]
    if "polar_angle" in values:
        flat.append(radius * np.cos(values["polar_angle"]))
    elif "height" in values:
        flat.append(values["height"])
    return np.stack(flat, axis=-1)


def polar(points: Array, kinds: Mapping[str, str]) -> dict[str, Array]:
    """The same back, radii not negative, azimuths within half a turn."""
    level = np.hypot(points[..., 0], points[..., 1])
    values = {"radius": level, "azimuth": np.arctan2(points[..., 1], points[..., 0])}
    if "polar_angle" in kinds:
        values["radius"] = np.hypot(level, points[..., 2])
        values["polar_angle"] = np.arctan2(level, points[..., 2])
    elif "height" in kinds:
        values["height"] = points[..., 2]
    return {kind: values[kind] for kind in kinds}


def jacobian(values: Mapping[str, float]) -> Array:
    """Derivative of a point's coordinates (rows) by its parameters, in the order of the mapping."""
    azimuth = values["azimuth"]
    outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    along = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    tilt = values.get("polar_angle", np.pi / 2)
    columns = {
        "radius": np.sin(tilt) * outward + np.cos(tilt) * up,
        "azimuth": values["radius"] * np.sin(tilt) * along,
        "polar_angle": values["radius"] * (np.cos(tilt) * outward - np.sin(tilt) * up),
        "height": up,
    }
    size = len(values)  # as many coordinates as parameters
    return np.column_stack([columns[kind][:size] for kind in values])


def split_covariance(covariance: Array) -> tuple[Array, Array]:
    """Standard deviations, NaN for what has no variance, and the correlation matrix."""
    variances = np.diag(covariance)
    # What is held comes back from other coordinates but for rounding.
    known = variances > 1e-24 * variances.max(initial=0.0)
    sigma = np.sqrt(np.where(known, variances, np.nan))
    with np.errstate(invalid="ignore"):
        matrix = np.clip(np.nan_to_num(covariance / np.outer(sigma, sigma)), -1, 1)
    np.fill_diagonal(matrix, 1.0)
    return sigma, matrix


def with_correlations(mechanism: Mechanism, covariance: Array | None) -> Mechanism:
    """Keep how the errors of each point's parameters go together; None: nobody knows.

    The covariance is that of all parameters, shape (legs p, legs p).
    """
    points = mechanism.points
    if points is None:
        return mechanism
    found: dict[str, tuple[tuple[tuple[float, ...], ...], ...]] = {}
    if covariance is not None:
        count = len(mechanism.parameter_names)
        for end in points.ends:
            matrices = []
            for leg in range(len(mechanism.legs)):
                names = point_parameters(mechanism.leg_info(leg), end).values()
                own = [leg * count + mechanism.parameter_names.index(name) for name in names]
                matrix = split_covariance(covariance[np.ix_(own, own)])[1].tolist()
                matrices.append(tuple(map(tuple, matrix)))
            found[end] = tuple(matrices)
    return mechanism.replace(points=dataclasses.replace(points, correlations=found))


def centres(
    infos: Sequence[ChainInfo],
    legs: list[dict[str, float]],
    modes: list[int],
    points: Mapping[str, Array],
    fixed: Mapping[str, Array],
) -> dict[str, Array]:
    """Find for each end the centre about which its points (legs, size) become parameters.

    The origin if it serves and is the centre of the legs' symmetry, if they have one; else that
    centre; else the centroid, or a place near it that is above or below no leg. Centres that are
    `fixed` stay there, and the points of such an end may be NaN, of a leg without.
    """
    found = dict(fixed)
    found |= {end: _place(each) for end, each in points.items() if end not in fixed}
    symmetric = {}
    try:
        group = detect_symmetry(_drawn_mechanism(infos, legs, modes, points, found)).structure
    except SymkinError:  # what is wrong with the legs is said where they become a mechanism
        group = None
    if group is not None and group.rotations > 1:  # its centres are at height 0
        centre = {"base": group.frame.base_centre, "platform": group.frame.platform_centre}
        for end in points:
            symmetric[end] = np.zeros(len(found[end]))
            symmetric[end][:2] = found[end][:2] + centre[end]
    placed = {end: _place(points[end], symmetric.get(end)) for end in points if end not in fixed}
    return {end: fixed[end] if end in fixed else placed[end] for end in points}


def axis_of_drawing(mechanism: Mechanism) -> str:
    """Return "x" or "y" if drawn points have more rotations about that axis than about z, else "".

    Symmetries are about Z. Within the tolerances; only for legs that are known by their points.
    """
    info = mechanism.leg_info(0)
    kinds = {end: point_parameters(info, end) for end in ("base", "platform")}
    kinds = {end: names for end, names in kinds.items() if names}
    of_points = {name for names in kinds.values() for name in names.values()}
    own = {name for name, role in info.parameter_roles.items() if not role.of_sensor}
    drawn = mechanism.points
    if drawn is None or not mechanism.space.in_space or own != of_points or mechanism.mixed:
        return ""
    legs = [dict(leg.parameters) for leg in mechanism.legs]
    points = {}
    for end, names in kinds.items():
        values = {kind: np.array([leg[name] for leg in legs]) for kind, name in names.items()}
        points[end] = cartesian(values) + np.array(getattr(drawn, end) or np.zeros(3))
    rotations = {}
    for axis, order in (("", [0, 1, 2]), ("x", [1, 2, 0]), ("y", [2, 0, 1])):
        turned = {end: each[:, order] for end, each in points.items()}
        about = {end: _place(each) for end, each in turned.items()}
        try:
            infos = [info] * len(legs)
            made = _drawn_mechanism(infos, legs, list(mechanism.working_modes), turned, about)
            made = made.replace(tolerances=mechanism.tolerances)
            found = detect_within(made, scaled_tolerance(made, 1.0))
            rotations[axis] = found.structure.rotations
        except SymkinError:  # two points in one place
            rotations[axis] = 1
    return max(rotations, key=lambda axis: rotations[axis])  # of equal ones the first


def _drawn_mechanism(
    infos: Sequence[ChainInfo],
    legs: list[dict[str, float]],
    modes: list[int],
    points: Mapping[str, Array],
    about: Mapping[str, Array],
) -> Mechanism:
    """The legs with points by parameters about these places."""
    parameters = [dict(leg) for leg in legs]
    for end, drawn in points.items():
        for leg, info, point in zip(parameters, infos, drawn, strict=True):
            kinds = point_parameters(info, end)
            for kind, value in polar(point - about[end], kinds).items() if kinds else ():
                leg[kinds[kind]] = float(value)
    made = zip(infos, parameters, modes, strict=True)
    return Mechanism(
        "drawn",
        [Leg(info.name, each, mode) for info, each, mode in made],
        platform=infos[0].platform,
        reading_unit=infos[0].reading_unit,  # which symmetry does not ask for
    )


def _place(points: Array, symmetric: Array | None = None) -> Array:
    """The first of the centres that serves."""
    centroid = points.mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((points - centroid) ** 2, axis=1))))
    origin = np.zeros(points.shape[1])
    if spread <= _SAME * np.abs(points).max(initial=0.0):
        return origin  # all in one place, which no centre makes better
    tried = [centroid]
    for turn in (np.arange(_RING) + 0.5) * (2 * np.pi / _RING):
        aside = centroid.copy()
        aside[:2] += 0.5 * spread * np.array([np.cos(turn), np.sin(turn)])
        tried.append(aside)
    if symmetric is not None:
        at_height = symmetric.copy()
        at_height[2:] = centroid[2:]
        tried = [symmetric, at_height, *tried]
    if symmetric is None or np.abs(symmetric).max() <= _SAME * spread:
        tried = [origin, *tried]
    axes = [float(np.hypot(*(points - each).T[:2]).min()) for each in tried]
    reach = [float(np.linalg.norm(points - each, axis=1).max()) for each in tried]
    for centre, nearest, farthest in zip(tried, axes, reach, strict=True):
        if nearest >= _NEAREST * spread and farthest <= _FARTHEST * spread:
            return np.asarray(centre)
    return np.asarray(tried[int(np.argmax(axes))])


def anchor(info: ChainInfo, end: str) -> str:
    """Whether an end of a chain is a "point", a guide's "line" or its "direction" alone.

    Or an "axis" through the centre. A declared end is none of these.
    """
    if info.declared:
        return "none"
    kinds = {role.kind for role in info.parameter_roles.values() if role.end == end}
    if "radius" in kinds:
        return "point"
    if "direction_distance" in kinds:
        return "line"
    if "polar_angle" in kinds:
        return "axis"
    return "direction" if kinds else "none"


def with_moved_workspace(nominal: Mechanism, made: Mechanism) -> Mechanism:
    """Carry home and box along with frames that are others than the nominal ones."""
    if nominal.workspace is None:
        return made
    base, tool = (_frame_motion(nominal, made, end) for end in ("base", "platform"))
    if base is STAYS and tool is STAYS:
        return made
    moved = moved_workspace(nominal.pose_space, nominal.workspace, base, tool)
    return made.replace(workspace=moved)


def moved_workspace(
    pose_space: str, settings: WorkspaceSettings, base: Transform, tool: Transform
) -> WorkspaceSettings:
    """Home, and the box around the image of the box, for frames that these motions carry."""
    # The same place of the platform's points over the base's points, in other frames.
    home = np.array(settings.home_or_origin)
    sides = [(a, (a + b) / 2, b) for a, b in zip(settings.lower, settings.upper, strict=True)]
    box = np.array(list(itertools.product(*sides)))
    moved_home = _moved(pose_space, base, tool, home[None])[0]
    moved = _moved(pose_space, base, tool, box, near=moved_home)
    return dataclasses.replace(
        settings,
        lower=tuple(moved.min(axis=0).tolist()),
        upper=tuple(moved.max(axis=0).tolist()),
        home=tuple(moved_home.tolist()),
    )


def _moved(
    pose_space: str,
    base: Transform,
    tool: Transform,
    coordinates: Array,
    near: Array | None = None,
) -> Array:
    """Coordinates (N, dof) of ``base @ pose @ tool^-1``."""
    found = base @ transforms(pose_space, coordinates) @ tool.inverse
    there = coordinates_of(pose_space, found)
    if pose_space == "planar":
        there[:, 2] = coordinates[:, 2] + base.turn - tool.turn
    elif near is not None and POSE_SPACES[pose_space].has_quaternion:
        there[:, -3:] = _on_the_branch_of(near[-3:], there[:, -3:])
    return there


def _frame_motion(nominal: Mechanism, made: Mechanism, end: str) -> Transform:
    """The motion of base or platform frame that best explains the parameters of that end.

    None at all, as long as the tolerances may do the same. Of mixed legs those tell whose end is of
    the kind that most legs have, if they are enough.
    """
    kinds = [anchor(nominal.leg_info(leg), end) for leg in range(len(nominal.legs))]
    kind = max(dict.fromkeys(kinds), key=kinds.count)
    legs = [leg for leg, each in enumerate(kinds) if each == kind]
    if kind == "none" or (nominal.mixed and len(legs) < (3 if nominal.space.in_space else 2)):
        return STAYS
    before, after = (
        np.array([_anchor_point(each, end, leg) for leg in legs]) for each in (nominal, made)
    )
    if kind == "point":
        motion = _best_motion(before, after, flat=not nominal.space.in_space)
    elif kind == "axis":
        motion = Transform(nearest_rotation(after.T @ before), np.zeros(3))
    else:
        motion = _motion_of_lines(nominal, made, end, legs, has_distance=kind == "line")
    displaced = before @ motion.rotation.T + motion.translation - before
    tolerances = nominal.tolerances
    expected = np.hypot(tolerances.length, tolerances.angle * np.linalg.norm(before, axis=1))
    return motion if _rms(displaced) > _MOVED * _rms(expected) else STAYS


def _anchor_point(mechanism: Mechanism, end: str, leg: int) -> Array:
    """The point of a leg, the foot of its guide or, of a mere direction, where that points."""
    roles, row = mechanism.parameter_roles(leg), mechanism.parameters[leg]
    values = {role.kind: value for role, value in zip(roles, row, strict=True) if role.end == end}
    azimuth = values["azimuth"] if "azimuth" in values else values["direction_azimuth"]
    length = mechanism.characteristic_length
    radius = values.get("radius", values.get("direction_distance", length))
    tilt: dict[str, Array] = {
        kind: values[kind] for kind in ("polar_angle", "height") if kind in values
    }
    known = cartesian({"radius": radius, "azimuth": azimuth, **tilt})
    point = np.zeros(3)
    point[: len(known)] = known
    offset = mechanism.legs[leg].parameters["sensor_offset"]
    if "guide_elevation" in values:
        # Where the slider reads zero: the point itself is held along the guide.
        point += offset * _guide(values)
    elif end == "base" and "base_height" in mechanism.held[leg]:
        # Read as shorter than it is from the point that is held, a leg stands on a higher one.
        point[2] += offset * (1 if mechanism.home[2] >= 0 else -1)
    return point


def _guide(values: Mapping[str, Array]) -> Array:
    """Direction of a guide in space, shape (3,)."""
    azimuth, swing = values["guide_azimuth"], values["guide_swing"]
    outward = np.cos(swing) * np.cos(values["guide_elevation"])
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    return np.stack(
        [
            outward * cosine - np.sin(swing) * sine,
            outward * sine + np.sin(swing) * cosine,
            np.cos(swing) * np.sin(values["guide_elevation"]),
        ]
    )


def _best_motion(before: Array, after: Array, *, flat: bool) -> Transform:
    """Least squares (Kabsch)."""
    centres = before.mean(axis=0), after.mean(axis=0)
    product = (after - centres[1]).T @ (before - centres[0])
    rotation = nearest_rotation(in_plane(product) if flat else product)
    return Transform(rotation, centres[1] - rotation @ centres[0])


def _motion_of_lines(
    nominal: Mechanism, made: Mechanism, end: str, legs: Sequence[int], *, has_distance: bool
) -> Transform:
    """The turn that all directions share, and the translation that the distances show."""
    angle = nominal.parameter_names.index(f"{end}_angle")
    # The distance of a guide that has none of its own is part of the sensor's offset.
    distance = f"{end}_radius" if has_distance else "sensor_offset"
    column = nominal.parameter_names.index(distance)
    before, after = nominal.parameters[list(legs)], made.parameters[list(legs)]
    turn = np.angle(np.exp(1j * (after[:, angle] - before[:, angle])).sum())
    normals = np.stack([np.cos(after[:, angle]), np.sin(after[:, angle])], axis=1)
    shift = np.linalg.lstsq(normals, after[:, column] - before[:, column], rcond=1e-9)[0]
    return Transform(rotations_from_vectors(np.array([[0, 0, turn]]))[0], np.array([*shift, 0.0]))


def _rms(values: Array) -> float:
    """Root mean square over rows."""
    return float(np.sqrt(np.sum(values**2) / len(values)))


def _on_the_branch_of(near: Array, vectors: Array) -> Array:
    """Rotation vectors of the same rotations that are nearest to another one."""
    angles = np.linalg.norm(vectors, axis=1, keepdims=True)
    around = vectors * (1 - _TURN / np.where(angles > 0, angles, 1))
    nearer = np.linalg.norm(around - near, axis=1) < np.linalg.norm(vectors - near, axis=1)
    return np.where(nearer[:, None] & (angles > 0), around, vectors)
