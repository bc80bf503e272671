# SPDX-License-Identifier: MIT
"""What changes while a robot is measured, put into what is measured, and taken out of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from symkin.analysis.conventions import rotations_from_angles
from symkin.analysis.promises import parameter_effects
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.covariates import Covariate, slopes_of
from symkin.estimate.found import Found
from symkin.model.core_setup import Slopes
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    Transform,
    frame,
    poses_of,
    roll_pitch_yaw,
    rotations_from_vectors,
    stepped,
    tangents_of,
    transforms,
)
from symkin.values import Array, record

# What is seen from where the device stands and does not say where the target is, nor, as a part of
# an attitude, how it is turned.
_OF_THE_DEVICE = ("attitudes", "distances", "turns", "offsets")


@record
class Changes:
    """Covariates of the rows, and by how much they change what."""

    covariates: tuple[Covariate, ...]
    slopes: Slopes
    noise: Array | float = 1.0  # of every row, as so many times the declared one

    @property
    def of_legs(self) -> list[Covariate]:
        """Those that the slopes of the legs belong to, in their order."""
        return [each for each in self.covariates if each.of != "base"]

    @property
    def of_base(self) -> list[Covariate]:
        """Those of the base."""
        return [each for each in self.covariates if each.of == "base"]


def slopes_found(found: Found, covariates: tuple[Covariate, ...]) -> Slopes:
    """The slopes of an estimate along such covariates; zero where it has none."""
    legs, zero = len(found.nominal.legs), slopes_of(covariates, len(found.nominal.legs))
    values = {each.name: each.value for each in found.unknowns}
    space = found.nominal.space
    components = ("x", "y", "z", "rx", "ry", "rz" if space.in_space else "phi")
    slopes = zero._replace(legs=zero.legs.copy(), base=zero.base.copy())
    for k, (name, _) in enumerate(zero.of_legs):
        slopes.legs[:, k] = [values.get(f"leg{leg + 1}.{name}", 0.0) for leg in range(legs)]
    for k, name in enumerate(zero.of_base):
        slopes.base[k] = [values.get(f"{name}.{each}", 0.0) for each in components]
    return slopes


def in_last_session(found: Found, measured: Measurements) -> Measurements:
    """What would have been measured in the last session, of other rows of the same sessions."""
    every = found.options.covariates(found.nominal, measured)
    covariates = tuple(each for each in every if each.name.startswith("session"))
    return _taken_back(found, measured, covariates)[0] if covariates else measured


def _taken_back(
    found: Found, measured: Measurements, covariates: tuple[Covariate, ...]
) -> tuple[Measurements, Changes]:
    """What would have been measured had these not changed, but for growth; how they change back."""
    slopes = slopes_found(found, covariates)
    back = Changes(covariates, slopes._replace(legs=-slopes.legs))
    base = found.mechanism.frames.base if found.mechanism.frames else ()
    return changed_observations(measured, base, back, back=True), back


def at_rest(found: Found) -> Measurements:
    """What would have been measured had nothing changed, to first order in the changes."""
    measured = found.measurements
    covariates = found.options.covariates(found.nominal, measured)
    if not covariates:
        return measured
    robot = found.mechanism
    measured, back = _taken_back(found, measured, covariates)
    growths = _growths(back)
    if growths is None:
        return measured
    # A leg of other lengths is at the same pose where it is with these and another reading.
    readings, poses = measured.readings.copy(), np.ascontiguousarray(found.latent_poses)
    for leg, psi in enumerate(measured.readings.T):
        rows = robot.linearised(leg, poses, np.nan_to_num(psi))
        along = rows.by_parameters[:: robot.closures] @ _lengths(robot)[leg]
        shift = -along / rows.by_reading[:: robot.closures] * growths[:, leg]
        readings[:, leg] += np.nan_to_num(shift, posinf=0.0, neginf=0.0)
    return replace(measured, readings=readings)


def _growths(changes: Changes) -> Array | None:
    """By how much the lengths of every leg are larger, over themselves, shape (N, legs)."""
    growths = [
        changes.slopes.legs[:, k] * each.values
        for k, each in enumerate(changes.of_legs)
        if each.of == "lengths"
    ]
    return np.asarray(sum(growths)) if growths else None


def _lengths(mechanism: Mechanism) -> Array:
    """Parameters that go with the size of a robot, else zero, shape (legs, p)."""
    lengths = np.zeros(mechanism.parameters.shape)
    for leg, growing in enumerate(mechanism.straight.growing_parameters):
        lengths[leg, growing] = mechanism.parameters[leg, growing]
    return lengths


def changed_poses(actual: Mechanism, taken: Measurements, changes: Changes) -> Measurements:
    """Poses that a growing robot takes at its readings, to first order in its growth."""
    growths = _growths(changes)
    if growths is None:
        return taken
    effects, good = parameter_effects(actual, taken.poses)
    if not good.all():
        raise SymkinError("a simulated robot grows at a singular pose; leave growth out")
    lengths = _lengths(actual)
    tangents = np.einsum("ndlp,lp,nl->nd", effects[..., : lengths.shape[1]], lengths, growths)
    # Only in the coordinates that a pose has.
    tangents = tangents_of(actual.space, tangents[:, actual.space.components])
    grown = stepped(transforms(taken.pose_space, taken.poses), tangents)
    return replace(taken, poses=poses_of(taken.pose_space, grown))


def changed_observations(
    measured: Measurements, base: tuple[float, ...], changes: Changes, *, back: bool = False
) -> Measurements:
    """What sensors and the device show that have changed; `base` is where it was at first.

    With `back`, what a device would have shown that had not moved so.
    """
    readings = measured.readings.copy()
    for k, each in enumerate(changes.of_legs):
        if each.of == "reading":
            readings = readings + changes.slopes.legs[:, k] * each.values
        if each.name == "backlash":  # readings that hardly move no longer tell the side
            measured = replace(measured, approaches=2 * each.values)
    measured = replace(measured, readings=readings)
    if not changes.of_base:
        return measured
    moves = np.einsum("nk,kd->nd", np.column_stack([each.values for each in changes.of_base]),
                      changes.slopes.base)  # fmt: skip
    size = measured.space.size
    centre = frame(measured.pose_space, base).translation
    if back:
        moves[:, 3:] *= -1
    turns = rotations_from_vectors(moves[:, 3:])
    before, after = (moves[:, :3], 0.0) if back else (0.0, moves[:, :3])

    def moved(places: Array) -> Array:
        arms = np.zeros((len(places), 3))
        arms[:, :size] = places - centre[:size]
        turned = np.einsum("nij,nj->ni", turns, arms - before) + centre + after
        return np.asarray(turned[:, :size])

    poses = measured.poses.copy()
    full = np.isfinite(poses[:, size:]).all(axis=1)
    turned = transforms(measured.pose_space, poses[full])
    turned = Transform(turns[full] @ turned.rotation, turned.translation)
    poses[full] = poses_of(measured.pose_space, turned)
    poses[:, :size] = moved(measured.poses[:, :size])
    points = measured.points
    if points is not None:
        points = np.stack([moved(each) for each in points.transpose(1, 0, 2)], axis=1)
    measured = replace(measured, poses=poses, points=points)
    left = {name: getattr(measured, name) for name in _OF_THE_DEVICE}
    if (attitudes := left["attitudes"]) is not None and np.isfinite(attitudes).all():
        rolled = turns @ rotations_from_angles(attitudes, "xyz")
        measured = replace(measured, attitudes=roll_pitch_yaw(rolled))
        del left["attitudes"]
    left = {name: values for name, values in left.items() if values is not None}
    if not (left and moves.any()):
        return measured
    if back:
        return replace(
            measured, **{name: np.full_like(each, np.nan) for name, each in left.items()}
        )
    raise SymkinError(
        f"{' and '.join(left)} are seen from where the device stands; let a step or a drift move "
        "legs, or observe something else"
    )
