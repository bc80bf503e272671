# SPDX-License-Identifier: MIT
"""Points of legs by coordinates, as drawings give them, and by the parameters of the legs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from symkin.chains import ChainInfo
from symkin.errors import SymkinError
from symkin.mechanism import Leg, Mechanism

__all__ = [
    "axis_of_drawing",
    "cartesian",
    "centres",
    "jacobian",
    "point_parameters",
    "polar",
    "split_covariance",
    "with_correlations",
]

Array = NDArray[np.float64]

# A centre serves if no leg is much nearer to its axis than the legs are to each other, where small
# errors of a point would be large ones of its azimuth, and none is much farther away.
_NEAREST, _FARTHEST = 0.2, 4.0
_SAME = 1e-9  # of the points' spread: the same centre
_RING = 12  # centres that are tried around the centroid, at half the spread


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
    try:
        symmetric = _centres_of_symmetry(infos, legs, modes, points, found)
    except SymkinError:  # what is wrong with the legs is said where they become a mechanism
        symmetric = {}
    placed = {end: _place(points[end], symmetric.get(end)) for end in points if end not in fixed}
    return {end: fixed[end] if end in fixed else placed[end] for end in points}


def _centres_of_symmetry(
    infos: Sequence[ChainInfo],
    legs: list[dict[str, float]],
    modes: list[int],
    points: Mapping[str, Array],
    about: Mapping[str, Array],
) -> dict[str, Array]:
    """What the legs' rotations turn about, at height 0; nothing if there are none."""
    from symkin.symmetry import detect_symmetry

    made = _drawn_mechanism(infos, legs, modes, points, about)
    group = detect_symmetry(made).structure
    if group.rotations == 1:
        return {}
    centre = {"base": group.frame.base_centre, "platform": group.frame.platform_centre}
    level = {end: np.array(about[end]) for end in points}
    for end, each in level.items():
        each[:2] += centre[end]
        each[2:] = 0.0
    return level


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
            rotations[axis] = _rotations(made.replace(tolerances=mechanism.tolerances))
        except SymkinError:  # two points in one place
            rotations[axis] = 1
    return max(rotations, key=lambda axis: rotations[axis])  # of equal ones the first


def _rotations(mechanism: Mechanism) -> int:
    """How many rotations its legs have within their tolerances."""
    from symkin.symmetry.comparison import scaled_tolerance
    from symkin.symmetry.detection import detect_within

    return detect_within(mechanism, scaled_tolerance(mechanism, 1.0)).structure.rotations


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
