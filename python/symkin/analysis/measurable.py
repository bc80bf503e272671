# SPDX-License-Identifier: MIT
"""The symmetry of what can be measured: of box, joint limits and noise beside the robot's own.

Where limits or a device have less symmetry than the robot, fewer poses have all their images, and a
pose that shows much of one leg may show less of another at its image.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symkin import _core
from symkin.analysis.workspace import WorkspaceSample, inside_box
from symkin.data.error_axes import directed_errors
from symkin.model.framing import framed
from symkin.model.mechanism import Mechanism
from symkin.model.poses import frame, pose_rows, transforms
from symkin.model.settings import Frames
from symkin.model.symmetry import SymmetryPair, SymmetryPairs, symmetry_pairs
from symkin.values import Array, Value, record

_SAME = 1e-6  # of deviations that are alike
_MOST = 500  # poses
_SWEEPS = 300
_RANK = 1e-9  # of the largest singular value


@record
class MeasurableElement(Value):
    """What of the measurable workspace a symmetry of the robot keeps.

    Attributes
    ----------
    label, words : str
        Of the symmetry.
    box, limits : float
        Share of the poses whose images are in the workspace's box, and within all joint limits.
    noise : float
        By which factor the noise of a closure at an image differs at most from that at the pose.
    """

    label: str
    words: str
    box: float
    limits: float
    noise: float

    @property
    def kept(self) -> bool:
        """Whether the image of whatever can be measured can be measured as well."""
        return not self.broken

    @property
    def broken(self) -> tuple[str, ...]:
        """Which of box, joint limits and noise it does not keep."""
        found = {
            "the box": self.box < 1,
            "joint limits": self.limits < 1,
            "the noise": self.noise >= 1 + _SAME,
        }
        return tuple(what for what, fails in found.items() if fails)


@record
class MeasurableSymmetry(Value):
    """The symmetry of the measurable workspace, beside that of the robot.

    Attributes
    ----------
    robot, group : str
        Names of G_M, of what keeps working modes and home, and of what keeps limits and noise too.
    elements : tuple of MeasurableElement
        All of G_M.
    poses : int
        That were looked at.
    with_images : float
        Share of them of which all images are in the box and within the joint limits.
    efficiency : float
        What the best poses of a leg, carried to another, are worth beside those that are best for
        that one: the least over the legs, of the p-th root of the determinant.
    """

    robot: str
    group: str
    elements: tuple[MeasurableElement, ...]
    poses: int
    with_images: float
    efficiency: float

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is kept, and what it means for poses."""
        size, kept = len(self.elements), sum(each.kept for each in self.elements)
        if kept == size:
            return (
                f"Box, joint limits and noise keep all {size} of G_M: what can be measured has "
                f"{self.group}, too.",
            )
        broken = dict.fromkeys(what for each in self.elements for what in each.broken)
        said = [
            f"Of the {size} symmetries of G_M {kept} {'keeps' if kept == 1 else 'keep'} "
            f"{_and(list(broken))}, too: what can be measured has {self.group or 'no group'}."
        ]
        if self.with_images < 1:
            said.append(
                f"{100 * self.with_images:.0f}% of the poses have all their images in the box and "
                "within joint limits."
            )
        if "the noise" in broken:
            said.append(self.carried)
        return tuple(said)

    @property
    def carried(self) -> str:
        """What noise makes of carried poses."""
        if not any("the noise" in each.broken for each in self.elements):
            return "The noise is the same at the images of a pose: carried poses are as good."
        return (
            "The noise is not the same at the images of a pose: the best of one leg, carried to "
            f"another, have {100 * self.efficiency:.0f}% of the efficiency of those that are best "
            "for that one."
        )


def measurable_symmetry(
    mechanism: Mechanism,
    poses: ArrayLike | WorkspaceSample,
    pairs: SymmetryPairs | None = None,
) -> MeasurableSymmetry | None:
    """Look for the symmetries that box, joint limits and noise leave.

    The noise is of poses that are measured in full: of the target, in the device's frame.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    poses : WorkspaceSample, or array_like of shape (n, coordinates)
        That can be measured; 500 of more are looked at.
    pairs : SymmetryPairs, optional
        Its symmetries, if they are known.

    Returns
    -------
    MeasurableSymmetry or None
        None for a robot without a symmetry that keeps working modes and home, or legs that bind the
        platform, and for one that can take none of the poses.
    """
    pairs = pairs or symmetry_pairs(mechanism)
    elements = pairs.keep_modes_and_home
    if len(elements) < 2 or mechanism.bound:
        return None
    rows = pose_rows(poses)
    rows = rows[:: -(-len(rows) // _MOST) or 1]
    noise = _noise_of_closures(mechanism, rows)
    known = np.isfinite(noise).all(axis=1)
    if not known.any():
        return None
    rows, noise = rows[known], noise[known]
    images = [each.map_poses(mechanism, rows) for each in elements]
    at_images = [_noise_of_closures(mechanism, each) for each in images]
    box = np.array([inside_box(mechanism, each) for each in images])
    readings = [mechanism.inverse_kinematics(each) for each in images]
    limits = np.array([mechanism.within_limits(each).all(axis=1) for each in readings])
    found = []
    for number, (element, there) in enumerate(zip(elements, at_images, strict=True)):
        ratios = np.abs(np.log(there[:, element.permutation] / noise))
        worst = float(np.exp(np.nanmax(ratios, initial=0.0)))
        shares = float(box[number].mean()), float(limits[number].mean())
        found.append(MeasurableElement(element.label, element.words, *shares, worst))
    kept = [each for each, told in zip(elements, found, strict=True) if told.kept]
    return MeasurableSymmetry(
        robot=pairs.name(elements),
        group=pairs.group_of(kept),
        elements=tuple(found),
        poses=len(rows),
        with_images=float((box & limits).all(axis=0).mean()),
        efficiency=_efficiency(mechanism, elements, rows, noise, at_images),
    )


def _noise_of_closures(mechanism: Mechanism, poses: Array) -> Array:
    """Standard deviation of each leg's closure, as the joint that it says, shape (n, legs)."""
    count = len(mechanism.legs)
    by_pose = _core.pose_jacobian(mechanism.straight, poses).reshape(len(poses), count, -1)
    errors = _pose_errors(mechanism, poses)[:, :, mechanism.space.components]
    of_poses = np.square(np.einsum("nlc,nec->nle", by_pose, errors)).sum(axis=2)
    return np.asarray(np.sqrt(of_poses + (mechanism.sensor_gains * mechanism.noise.reading) ** 2))


def _pose_errors(mechanism: Mechanism, poses: Array) -> Array:
    """Independent errors of measured poses, a tangent in the base's frame each, (n, errors, 6)."""
    space, frames, noise = mechanism.space, mechanism.frames or Frames(), mechanism.noise
    errors = np.zeros((len(poses), 6, 6))
    if space.moves:
        places = framed(mechanism, poses)[:, : space.size]
        seen = directed_errors(noise, places[:, None])
        rows = seen.deviations[:, 0, :, None] * seen.axes[:, 0]
        turn = frame(mechanism.pose_space, frames.base).rotation[: space.size, : space.size]
        errors[:, : space.size, : space.size] = rows @ turn  # from the device's axes to the base's
    if space.turns:
        target = frame(mechanism.pose_space, frames.target).translation
        lever = transforms(mechanism.pose_space, poses).rotation @ target
        turned = [each for each in space.components if each > 2]
        for each in turned:
            axis = np.eye(3)[each - 3]
            errors[:, each, :3] = noise.orientation * np.cross(lever, axis)
            errors[:, each, 3:] = noise.orientation * axis
    return errors


def _efficiency(
    mechanism: Mechanism,
    elements: Sequence[SymmetryPair],
    poses: Array,
    noise: Array,
    at_images: Sequence[Array],
) -> float:
    """The least of what the best weights of poses for one leg are worth for another of its orbit.

    In coordinates that are carried along, another leg shows at images what this one shows at the
    poses (Eq. 10), but for the noise there.
    """
    least = 1.0
    references = {min(each.permutation[leg] for each in elements) for leg in range(noise.shape[1])}
    for leg in references:
        noises = [
            there[:, element.permutation[leg]]
            for element, there in zip(elements, at_images, strict=True)
        ]
        others = [each for each in noises if not _in_proportion(each, noise[:, leg])]
        if not others:
            continue
        rows = _core.parameter_jacobian(mechanism.straight, leg, poses)[:, mechanism.estimated[leg]]
        best = _Information.of(rows, noise[:, leg]).best_weights()
        for each in others:
            least = min(least, _Information.of(rows, each).efficiency(best))
    return least


def _in_proportion(noise: Array, other: Array) -> bool:
    """Whether one noise is the other, or as many times that everywhere."""
    ratios = noise / other
    return bool(np.ptp(ratios) <= _SAME * ratios.min())


class _Information(NamedTuple):
    """Whitened rows of a leg's parameters, made orthonormal."""

    rows: Array

    @classmethod
    def of(cls, rows: Array, noise: Array) -> _Information:
        """Of derivatives that have this noise."""
        sizes = np.linalg.norm(rows, axis=0)  # zero of an angle about a point on the axis
        scaled = rows / np.where(sizes > 0, sizes, 1.0) / noise[:, None]
        u, values, _ = np.linalg.svd(scaled, full_matrices=False)
        return cls(u[:, values > _RANK * values[0]])

    def best_weights(self) -> Array:
        """D-optimal weights of the poses, by multiplication with what each is worth."""
        count, size = self.rows.shape
        weights = np.full(count, 1 / count)
        for _ in range(_SWEEPS):
            information = self.rows.T @ (weights[:, None] * self.rows)
            worth = np.einsum("ni,ni->n", self.rows, np.linalg.solve(information, self.rows.T).T)
            weights = weights * worth / size
        return weights

    def efficiency(self, weights: Array) -> float:
        """What weights are worth beside the best, by the p-th root of the determinant."""
        ours, best = (
            np.linalg.slogdet(self.rows.T @ (each[:, None] * self.rows))[1]
            for each in (weights, self.best_weights())
        )
        return float(np.exp((ours - best) / self.rows.shape[1]))


def _and(words: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]]))
