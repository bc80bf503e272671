# SPDX-License-Identifier: MIT
"""What a robot's readings show of its parameters by themselves, without any measuring device."""

from __future__ import annotations

import numpy as np

from symkin.model.mechanism import Mechanism
from symkin.model.poses import transforms
from symkin.model.tolerances import parameter_tolerances
from symkin.values import Array, Value, record

_RANK = 1e-9  # of the largest singular value, with the parameters in their tolerances


@record
class ReadingsAlone(Value):
    """What readings alone show, where there are more of them than degrees of freedom.

    Attributes
    ----------
    parameters : int
        Of all legs that are identified; those that readings of one leg share count once.
    shown : int
        Combinations of them that the readings show.
    frames : int
        Combinations that only say where base and platform frames are, and
    size : int
        how large the robot is, one or none: neither changes what it can know of itself.
    """

    parameters: int
    shown: int
    frames: int
    size: int

    @property
    def others(self) -> int:
        """Combinations that are not shown although they matter."""
        return self.parameters - self.shown - self.frames - self.size

    @property
    def datum(self) -> str:
        """What must be stated or measured otherwise, in words."""
        frames = f"where base and platform frames are ({self.frames})"
        parts = [frames] * bool(self.frames) + [f"the size ({self.size})"] * bool(self.size)
        parts += [f"{self.others} more"] * bool(self.others)
        return " and ".join(parts) or "nothing"


def readings_alone(mechanism: Mechanism, poses: Array) -> ReadingsAlone | None:
    """Count what readings alone show at poses; None where they do not contradict each other.

    Each pose is unknown and takes as many closures as it has degrees of freedom. What moves all
    poses alike, a motion of the base or platform frame or a factor of all lengths, is a datum.
    """
    if not mechanism.straight.redundant:
        return None
    readings = mechanism.inverse_kinematics(poses)
    by_unknowns, by_pose = _derivatives(mechanism, poses, readings)
    # Of the closures of a pose, what is left beside any step of the pose.
    basis, sizes, _ = np.linalg.svd(by_pose, full_matrices=True)
    free = basis[:, :, sizes.shape[1] :].transpose(0, 2, 1)
    shown = _rank((free @ by_unknowns).reshape(-1, by_unknowns.shape[2]))
    unknowns = int(by_unknowns.shape[2])
    frames, scaled = _motions(mechanism, poses)

    def explained(motions: Array) -> int:
        """Combinations of parameters that do the same as some of these motions of all poses."""
        if not motions.shape[2]:
            return 0
        moved = (by_pose @ motions).reshape(-1, motions.shape[2])
        rows = by_unknowns.reshape(-1, unknowns)
        return unknowns + int(motions.shape[2]) - _rank(np.hstack([rows, moved]))

    of_frames = explained(frames)
    of_size = explained(np.concatenate([frames, scaled], axis=2)) - of_frames
    return ReadingsAlone(unknowns, shown, of_frames, of_size)


def _derivatives(mechanism: Mechanism, poses: Array, readings: Array) -> tuple[Array, Array]:
    """Of all closures of a pose: by the unknowns in tolerances, (n, closures, u), and the pose."""
    owner = {leg: legs[0] for legs in mechanism.leg_readings for leg in legs}
    tolerances = parameter_tolerances(mechanism)
    columns: dict[tuple[int, int], int] = {}
    parts, steps = [], []
    for leg, estimated in enumerate(mechanism.estimated):
        rows = mechanism.linearised(leg, poses, readings[:, leg])
        roles = mechanism.parameter_roles(leg)
        own = [(leg if roles[each].of_sensor else owner[leg], int(each)) for each in estimated]
        places = [columns.setdefault(each, len(columns)) for each in own]
        parts.append((places, rows.by_parameters[:, estimated] * tolerances[leg][estimated]))
        steps.append(rows.by_pose)
    shape = (len(poses), mechanism.closures)
    by_unknowns = np.zeros((len(poses), mechanism.closures * len(parts), len(columns)))
    for leg, (places, slopes) in enumerate(parts):
        of_leg = slice(leg * shape[1], (leg + 1) * shape[1])
        by_unknowns[:, of_leg, places] = slopes.reshape(*shape, -1)
    return by_unknowns, np.concatenate([each.reshape(*shape, -1) for each in steps], axis=1)


def _motions(mechanism: Mechanism, poses: Array) -> tuple[Array, Array]:
    """Independent steps of all poses by motions of the frames, (n, dof, m), and by a factor."""
    space = mechanism.space
    at = transforms(mechanism.pose_space, poses)
    moved = np.zeros((len(poses), 6, 12))
    moved[:, :3, :3] = moved[:, 3:, 3:6] = np.eye(3)
    moved[:, :3, 3:6] = -np.cross(np.eye(3), at.translation[:, None]).transpose(0, 2, 1)
    moved[:, :3, 6:9] = moved[:, 3:, 9:] = at.rotation
    kept = space.components
    lost = np.delete(moved, kept, axis=1).reshape(-1, 12)
    allowed = _silent(lost) if len(lost) else np.eye(12)
    frames = moved[:, kept] @ allowed
    _, sizes, vectors = np.linalg.svd(frames.reshape(-1, frames.shape[2]), full_matrices=False)
    frames = frames @ vectors[sizes > _RANK * sizes.max(initial=0.0)].T
    scaled = np.zeros((len(poses), 6, 1))
    scaled[:, :3, 0] = at.translation
    return frames, scaled[:, kept] if space.moves else scaled[:, kept, :0]


def _silent(rows: Array) -> Array:
    """Directions that rows do not see."""
    _, sizes, vectors = np.linalg.svd(rows, full_matrices=True)
    rank = int(np.sum(sizes > _RANK * sizes.max(initial=0.0)))
    return np.asarray(vectors[rank:].T)


def _rank(rows: Array) -> int:
    triangle = np.linalg.qr(rows, mode="r")  # has the same singular values
    sizes = np.asarray(np.linalg.svd(triangle, compute_uv=False))
    return int(np.sum(sizes > _RANK * sizes.max(initial=0.0)))
