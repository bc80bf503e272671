# SPDX-License-Identifier: MIT
"""Groups about any axis and centre, as files declare them, and the legs that they generate."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from symkin import _core
from symkin.errors import SymkinError, SymmetryError
from symkin.model.chains import ChainInfo, chain_info, parameter_values
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.poses import POSE_SPACES
from symkin.model.settings import DeclaredSymmetry
from symkin.model.symmetry.naming import element_words
from symkin.values import Array

Vector = Array
Pair = _core.SymmetryPair

_ROUNDING = 1e-14
_SAME = 1e-6  # m and rad
_FAR = 1e-3  # of matrices' entries and of shifts in m: another element


def declared_pairs(symmetry: DeclaredSymmetry) -> dict[str, Pair]:
    """Return what each element does to base and platform, by label: r0, r1, ..., s0, s1, ...

    The platform turns as the base does, about its own origin.

    Raises
    ------
    SymkinError
        For an axis or a mirror that has no direction.
    """
    axis = _unit("axis", symmetry.direction or (0.0, 0.0, 1.0))
    centre = np.array(symmetry.centre or (0.0, 0.0, 0.0))
    order = int(symmetry.group[1:])
    pairs = {f"r{k}": _about(_turn(axis, 2 * math.pi * k / order), centre) for k in range(order)}
    if symmetry.group[0] == "D":
        across = _across(axis, symmetry)
        for k in range(order):
            normal = _turn(axis, math.pi * k / order) @ across
            pairs[f"s{k}"] = _about(np.eye(3) - 2 * np.outer(normal, normal), centre)
    return pairs


def _across(axis: Vector, symmetry: DeclaredSymmetry) -> Vector:
    """Normal of the mirror s0, which holds the axis and a direction that is not along it."""
    along = symmetry.mirror
    if along is None:
        upright = abs(axis[2]) > 1 - _SAME
        along = (math.cos(symmetry.axis), math.sin(symmetry.axis), 0) if upright else (0, 0, 1)
    normal = np.cross(axis, _unit("mirror", along))
    if np.linalg.norm(normal) < _SAME:
        raise SymkinError("mirror is along axis; expected another direction in the mirror's plane")
    return np.asarray(normal / np.linalg.norm(normal))


def _unit(name: str, given: Sequence[float]) -> Vector:
    length = math.hypot(*given)
    if not 0 < length < math.inf:
        raise SymkinError(f"{name} is {list(given)}; expected a direction that is not zero")
    return np.array(given) / length


def _turn(axis: Vector, angle: float) -> Vector:
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew)


def _about(linear: Vector, centre: Vector) -> Pair:
    base = _core.Isometry(linear, centre - linear @ centre)
    return Pair(base, _core.Isometry(linear, np.zeros(3)), False)


def filled_up(legs: Sequence[Leg], info: ChainInfo, platform: str) -> _core.Mechanism:
    """Legs of one chain and copies of the first: no mechanism has fewer legs than freedoms.

    What is compared of it are legs; it need not have a home, as one of nothing but closures
    without a reading has none.
    """
    most = POSE_SPACES[info.pose_space].dof // info.closures
    every = [*legs, *[legs[0]] * (most - len(legs))]
    values = [[leg.parameters[name] for name in info.parameter_names] for leg in every]
    modes = [leg.working_mode for leg in every]
    return _core.Mechanism("orbit", [info.name] * len(every), platform, np.array(values), modes)


def images_about_axis(
    reference: Leg, platform: str, pairs: Mapping[str, Pair], labels: Sequence[str]
) -> list[Leg]:
    """Carry a leg by some elements; the identity leaves it as it was written."""
    return [
        reference if label == "r0" else _image(reference, platform, pairs[label])
        for label in labels
    ]


def orbits_about_axis(
    references: Sequence[Leg], platform: str, pairs: Mapping[str, Pair], labels: Sequence[str]
) -> list[Leg]:
    """Carry each leg to its orbit; images that are one leg count once, of them by a turn."""
    legs: list[Leg] = []
    for reference in references:
        made = dict(zip(labels, images_about_axis(reference, platform, pairs, labels), strict=True))
        kept: list[str] = []
        for label in sorted(labels, key=lambda each: each[0] == "s"):
            if not any(_alike(made[label], made[other], platform) for other in kept):
                kept.append(label)
        legs += [made[label] for label in labels if label in kept]
    return legs


def _image(leg: Leg, platform: str, pair: Pair) -> Leg:
    info = chain_info(leg.chain, platform)
    values = {name: float(value) for name, value in parameter_values(leg, info, 1).items()}
    whole = dataclasses.replace(leg, parameters=values)
    like = dataclasses.replace(leg, parameters=values | _like(values, pair))
    found, mode = _core.carried_leg(filled_up([whole, like], info, platform), 0, pair, 1)
    own = {
        name: math.remainder(value, 2 * math.pi) if info.parameter_units[name] == "rad" else value
        for name, value in zip(info.parameter_names, found.tolist(), strict=True)
    }
    own = {name: value if abs(value) > _ROUNDING else 0.0 for name, value in own.items()}
    return dataclasses.replace(leg, parameters=own, working_mode=mode)


def _like(values: Mapping[str, float], pair: Pair) -> dict[str, float]:
    """What the image's guides and axes come nearest to: themselves."""
    return _directions(values, pair) | _axes(values, pair)


def _directions(values: Mapping[str, float], pair: Pair) -> dict[str, float]:
    """Azimuths from which the images' guides and axes are given, so that they do not swing."""
    found: dict[str, float] = {}
    for name in ("guide", "axis"):
        azimuth = values.get(f"{name}_azimuth")
        if azimuth is None:
            continue
        elevation, swing = values[f"{name}_elevation"], values[f"{name}_swing"]
        radial = np.array([math.cos(azimuth), math.sin(azimuth), 0])
        tangential = np.array([-math.sin(azimuth), math.cos(azimuth), 0])
        first, second = (radial, tangential) if name == "guide" else (tangential, radial)
        up = np.array([0, 0, 1])
        ahead = math.cos(elevation) * first + math.sin(elevation) * up
        image = pair.base.linear @ (math.cos(swing) * ahead + math.sin(swing) * second)
        if name == "axis":  # which has a sense of turning, that a mirror reverses
            image = image * np.linalg.det(pair.base.linear)
        level = math.hypot(image[0], image[1])
        turned = math.atan2(image[1], image[0]) - (math.pi / 2 if name == "axis" else 0)
        found[f"{name}_azimuth"] = math.remainder(turned, 2 * math.pi) if level > _SAME else 0.0
        found[f"{name}_elevation"] = math.atan2(image[2], level if level > _SAME else 0.0)
        found[f"{name}_swing"] = 0.0
    return found


def _axes(values: Mapping[str, float], pair: Pair) -> dict[str, float]:
    """Where the axes of a spherical leg arrive, in their own sense: -1 moves no pose."""
    found: dict[str, float] = {}
    for end in ("base", "platform"):
        polar, azimuth = values.get(f"{end}_polar_angle"), values.get(f"{end}_azimuth")
        if polar is None or azimuth is None or f"{end}_radius" in values:
            continue
        level = math.sin(polar)
        axis = [level * math.cos(azimuth), level * math.sin(azimuth), math.cos(polar)]
        linear = (pair.base if end == "base" else pair.platform).linear
        x, y, z = np.linalg.det(linear) * linear @ axis
        found[f"{end}_polar_angle"] = math.atan2(math.hypot(x, y), z)
        found[f"{end}_azimuth"] = math.atan2(y, x)
    return found


def _alike(leg: Leg, other: Leg, platform: str) -> bool:
    """Whether two legs stand at one place, working mode and sensor aside."""
    info = chain_info(leg.chain, platform)
    for name, role in info.parameter_roles.items():
        apart = leg.parameters[name] - other.parameters[name]
        if role.of_sensor:
            continue
        if name.endswith(("azimuth", "angle")):
            radius = leg.parameters.get(f"{name.partition('_')[0]}_radius", 1.0)
            apart = math.remainder(apart, 2 * math.pi) if abs(radius) > _SAME else 0.0
        if abs(apart) > _SAME:
            return False
    return True


def verify_about_axis(mechanism: Mechanism, symmetry: DeclaredSymmetry) -> None:
    """Check that every declared element carries the legs onto each other.

    Raises
    ------
    SymmetryError
        Naming the element, and the leg whose image is farthest from all legs, by which parameter.
    """
    limits = _core.SymmetryTolerance(_SAME, _SAME, _SAME)
    found = [
        each.pair for each in _core.find_pairs(mechanism.straight, mechanism.home, limits).pairs
    ]
    turns = mechanism.space.turns
    for label, pair in declared_pairs(symmetry).items():
        same = any(
            np.abs(each.base.linear - pair.base.linear).max() < _FAR
            and np.abs(each.base.shift - pair.base.shift).max() < _FAR
            and (not turns or _core.apart(each, pair, 1.0) < _FAR)
            for each in found
        )
        if not same:
            words = element_words(pair.base.linear, planar=False)
            raise SymmetryError(
                f'"{mechanism.name}" does not have the symmetry {symmetry.group} that it declares: '
                f"{label}, {words}, does not carry its legs onto each other; "
                f"{_worst(mechanism, pair)}"
            )


def _worst(mechanism: Mechanism, pair: Pair) -> str:
    """The leg whose image is farthest from the leg that it is nearest to."""
    farthest = (-1.0, "")
    for leg, chain in enumerate(mechanism.chains):
        nearest = (math.inf, "")
        for onto, other in enumerate(mechanism.chains):
            if chain != other:
                continue
            values, _ = _core.carried_leg(mechanism.straight, leg, pair, onto)
            apart = np.abs(values - mechanism.parameters[onto])
            for place, role in enumerate(mechanism.parameter_roles(onto)):
                if role.of_sensor or not np.isfinite(apart[place]):
                    apart[place] = 0.0
            place = int(np.argmax(apart))
            unit = mechanism.parameter_units(onto)[place]
            text = (
                f"the image of leg {leg + 1} is off leg {onto + 1} by {apart[place]:.3g} {unit} in "
                f"{mechanism.parameter_names[place]}"
            )
            nearest = min(nearest, (float(apart[place]), text))
        farthest = max(farthest, nearest)
    return farthest[1]
