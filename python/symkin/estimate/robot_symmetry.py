# SPDX-License-Identifier: MIT
"""How symmetric a robot is, as it was identified.

Its errors are split into what all legs have in common, as far as a symmetry carries it from leg to
leg, and what differs; each symmetry of the drawing is tested for whether the robot has it still.
Errors that only move the frames of base or platform count for nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.workspace import sample_workspace
from symkin.errors import SymkinError
from symkin.estimate.found import Found
from symkin.model.mechanism import Mechanism
from symkin.model.poses import transforms
from symkin.model.symmetry import SymmetryPair, symmetry_pairs
from symkin.model.tolerances import parameter_tolerances
from symkin.results import Result
from symkin.values import Array, Value, plain, record

_POSES = 60
_SMALL = 1e-9  # of the largest eigenvalue, or of a closure: what is zero but for rounding
_SIZES = (0.0, *np.geomspace(0.01, 10, 25).tolist())  # tolerances
_SWEEPS = 3
_FITS = 1e-5  # of readings that a change of parameters has to explain


@record
class ElementTest(Value):
    """Whether the robot still has a symmetry of the drawing.

    Attributes
    ----------
    label, words : str
        Of the element.
    chi_square : float
        Of what the element changes in the errors, frames free.
    degrees_of_freedom : int
        Of it.
    p_value : float
        How often a robot that has the symmetry would be off by as much.
    """

    label: str
    words: str
    chi_square: float
    degrees_of_freedom: int
    p_value: float


@record
class ErrorKind(Value):
    """Errors of one kind, in tolerances: frames free, and without what noise adds.

    Attributes
    ----------
    kind : {"all", "length", "angle", "sensor"}
        Of which parameters.
    common, different : float
        The likeliest standard deviation of what the legs have in common, and of what differs from
        leg to leg.
    """

    kind: str
    common: float
    different: float

    @property
    def share(self) -> float:
        """Of the variance, what is common; NaN without errors."""
        total = self.common**2 + self.different**2
        return self.common**2 / total if total > 0 else float("nan")


@record
class RobotSymmetry(Result):
    """How symmetric a robot is.

    Attributes
    ----------
    group : str
        Of the drawing's symmetries that keep working modes and home.
    tests : tuple of ElementTest
        One for each of them but the identity.
    kinds : tuple of ErrorKind
        Of all parameters together; then of lengths, angles and sensors, which a single robot shows
        roughly at best, since one may stand for another.
    """

    group: str
    tests: tuple[ElementTest, ...]
    kinds: tuple[ErrorKind, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as plain values."""
        shares = [plain(each) | {"share": each.share} for each in self.kinds]
        return {"group": self.group, "tests": plain(self.tests), "kinds": shares}

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return a row a test."""
        names = "label", "words", "chi_square", "degrees_of_freedom", "p_value"
        return {name: [getattr(each, name) for each in self.tests] for name in names}


def _contrast_test(
    estimate: Array, covariance: Array, contrasts: Array, free: Array
) -> tuple[float, int]:
    """Chi-square of contrasts of an estimate, and its degrees of freedom.

    It is zero of K x that is tested, K of shape (k, n), x and its covariance in comparable units;
    directions that are no matter, `free`, (n, m), are projected out of the contrasts.
    """
    moved = contrasts @ free
    u, values, _ = np.linalg.svd(moved, full_matrices=True)
    rank = int((values > 1e-6 * max(values.max(initial=0), 1e-300)).sum()) if moved.size else 0
    kept = u[:, rank:].T @ contrasts
    spread = kept @ covariance @ kept.T
    scale, vectors = np.linalg.eigh((spread + spread.T) / 2)
    good = scale > _SMALL * scale.max(initial=0)
    along = vectors[:, good].T @ (kept @ estimate)
    return float((along**2 / scale[good]).sum()), int(good.sum())


def robot_symmetry(found: Found[Mechanism]) -> RobotSymmetry:
    """Judge how symmetric an identified robot is.

    Parameters
    ----------
    found : Estimate
        Without priors, which would pull the robot to the drawing and its symmetry.

    Raises
    ------
    SymkinError
        If the drawing has no symmetry that keeps working modes and home, or legs with several
        readings, or closures without any, which share their numbers; or if the estimate rests on
        priors, or not all parameters were estimated.
    """
    try:
        return _judged(found)
    except np.linalg.LinAlgError as error:
        raise SymkinError(
            f"the errors are not known well enough to be compared ({error})"
        ) from error


def _judged(found: Found[Mechanism]) -> RobotSymmetry:
    nominal = found.nominal
    pairs = symmetry_pairs(nominal)
    elements = pairs.keep_modes_and_home
    _require(found, len(elements))
    legs = _Legs(nominal)
    chosen, tolerances = legs.columns, legs.tolerances
    errors = found.changes.ravel()[chosen] / tolerances
    covariance = found.parameter_covariance[np.ix_(chosen, chosen)] / np.outer(
        tolerances, tolerances
    )
    frames = legs.frames()
    actions = [legs.action(element) for element in elements]
    tests = []
    for element, action in zip(elements[1:], actions[1:], strict=True):
        contrasts = action - np.eye(len(action))
        value, freedom = _contrast_test(errors, covariance, contrasts, frames)
        tail = _core.chi_square_tail(value, freedom)
        tests.append(ElementTest(element.label, element.words, value, freedom, tail))
    common = np.mean(actions, axis=0)
    kinds = _kinds(legs, errors, covariance, common, frames)
    return RobotSymmetry(pairs.name(elements), tuple(tests), kinds)


def _require(found: Found[Mechanism], symmetries: int) -> None:
    nominal, wanted = found.nominal, sum(found.nominal.estimated_counts)
    deviations = np.isfinite(found.deviations) & (found.deviations > 0)
    if symmetries < 2:
        raise SymkinError(f'"{nominal.name}" has no symmetry that keeps its modes and home')
    in_common = nominal.replace(curvature=None).not_leg_by_leg
    if in_common:
        raise SymkinError(
            f"{in_common}, so that it has numbers in common with others of them: not tested"
        )
    if found.options.prior is not None or found.rank > found.data_rank:
        raise SymkinError(
            "the estimate rests on priors, which pull it to the drawing's symmetry: identify "
            "without them to test it"
        )
    if not found.converged or found.unseen:
        raise SymkinError("the measurements do not show every parameter of the legs")
    if int(deviations.sum()) != wanted or found.options.shared:
        raise SymkinError("not every parameter was estimated by itself: the test needs them all")


class _Legs:
    """Derivatives of all legs' closures by their estimated parameters, in tolerances."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        count = len(mechanism.parameter_names)
        self.estimated = mechanism.straight.estimated_parameters
        self.columns = np.array(
            [leg * count + place for leg, own in enumerate(self.estimated) for place in own]
        )
        self.table = np.asarray(parameter_tolerances(mechanism))
        self.tolerances = self.table.ravel()[self.columns]
        self.poses = sample_workspace(mechanism, _POSES).poses
        self.rows = self.derivatives(self.poses)

    def derivatives(self, poses: Array) -> list[_Closures]:
        """Of each leg; not numbers where it does not reach."""
        mechanism = self.mechanism
        readings = mechanism.straightened(mechanism.inverse_kinematics(poses))
        of_legs = []
        for leg, own in enumerate(self.estimated):
            rows = _core.linearise(mechanism.straight, leg, poses, readings[:, leg].copy())
            by_joint = rows.by_reading[:, None] / mechanism.sensor_gains[leg]
            moves = np.hstack([rows.by_pose, by_joint])
            errors = rows.by_parameters[:, own] * self.table[leg, own]
            shape = (len(poses), len(moves) // len(poses), -1)
            moves[np.isnan(readings[:, leg]).repeat(shape[1])] = np.nan
            of_legs.append(_Closures(moves.reshape(shape), errors.reshape(shape)))
        return of_legs

    def action(self, element: SymmetryPair) -> Array:
        """What the element does to the errors of all legs.

        The closures of a leg at a pose and those of its image say the same of moves of the pose,
        which the element carries, and of the joint: C_j(image) D = M C_i(pose), where M is how the
        ones are combined from the others.
        """
        images = self.derivatives(element.map_poses(self.mechanism, self.poses))
        carried = _carried_moves(self.mechanism, element, self.poses)
        sizes = [len(own) for own in self.estimated]
        starts = np.cumsum([0, *sizes])
        result = np.zeros((starts[-1], starts[-1]))
        for leg, onto in enumerate(element.permutation):
            here, there = self.rows[leg], images[onto]
            reached = here.reached & there.reached
            moves = there.moves[reached]
            by_pose = moves[..., :-1] @ carried[reached]
            same = np.concatenate([by_pose, element.joints[leg].sign * moves[..., -1:]], axis=-1)
            change = same @ np.linalg.pinv(here.moves[reached]) @ here.errors[reached]
            block, _ = _explained(there.errors[reached], change)
            rows, columns = (slice(starts[each], starts[each + 1]) for each in (onto, leg))
            result[rows, columns] = block
        return result

    def frames(self) -> Array:
        """Errors of all legs that only move base or platform, one a column."""
        columns = []
        for motion in _small_motions(self.mechanism, self.poses):
            parts = []
            for rows in self.rows:
                by_pose, reached = rows.moves[..., :-1], rows.reached
                change = (by_pose @ motion[..., None])[reached]
                parts.append(_explained(rows.errors[reached], change))
            if all(left <= _FITS for _, left in parts):
                columns.append(np.concatenate([part for part, _ in parts])[:, 0])
        found = np.array(columns).T.reshape(len(self.columns), len(columns))
        lengths = np.linalg.norm(found, axis=0)
        result: Array = found[:, lengths > 0] / lengths[lengths > 0]
        return result

    @property
    def kinds(self) -> NDArray[np.str_]:
        """Of each estimated parameter: "length", "angle" or "sensor"."""
        mechanism, kinds = self.mechanism, []
        for leg, own in enumerate(self.estimated):
            roles, units = mechanism.parameter_roles(leg), mechanism.parameter_units(leg)
            for place in own:
                kind = "angle" if units[place] == "rad" else "length"
                kinds.append("sensor" if roles[place].of_sensor else kind)
        return np.array(kinds)


@record
class _Closures:
    """The k closures of a leg at N poses."""

    moves: Array  # (N, k, dof + 1): their derivatives by the pose and by the joint
    errors: Array  # (N, k, p): by the leg's parameters

    @property
    def reached(self) -> NDArray[np.bool_]:
        """At which poses they are numbers."""
        found = np.isfinite(self.moves).all(axis=(1, 2)) & np.isfinite(self.errors).all(axis=(1, 2))
        return np.asarray(found)


def _explained(errors: Array, change: Array) -> tuple[Array, float]:
    """Errors that change closures so, shapes (N, k, any), and what of the change they leave."""
    rows, wanted = (each.reshape(-1, each.shape[-1]) for each in (errors, change))
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0] = 1
    found = np.linalg.lstsq(rows / scale, wanted, rcond=1e-9)[0] / scale[:, None]
    size = np.abs(wanted).max(initial=0)
    return found, float(np.abs(rows @ found - wanted).max() / max(size, _SMALL))


def _carried_moves(mechanism: Mechanism, element: SymmetryPair, poses: Array) -> Array:
    """What a small move of each pose becomes at its image, shape (N, dof, dof)."""
    base, platform = element.core.base, element.core.platform
    own = platform.linear.T @ -platform.shift  # the platform's point that becomes its origin
    rotations = transforms(mechanism.pose_space, poses).rotation
    maps = np.zeros((len(poses), 6, 6))
    maps[:, :3, :3] = base.linear
    maps[:, :3, 3:] = -base.linear @ _crosses(rotations @ own)
    maps[:, 3:, 3:] = np.linalg.det(base.linear) * base.linear
    components = mechanism.space.components
    return maps[:, components][..., components]


def _crosses(points: Array) -> Array:
    """Matrices of cross products, shape (N, 3, 3)."""
    return np.cross(points[:, None], np.eye(3)).swapaxes(1, 2)


def _small_motions(mechanism: Mechanism, poses: Array) -> list[Array]:
    """How a shift or turn of the base, or of the platform, along each axis moves poses."""
    space, motions = mechanism.space, transforms(mechanism.pose_space, poses)
    still = np.zeros_like(motions.translation)
    found = []
    for axis in np.eye(3):
        along = still + axis
        turned = (np.cross(along, motions.translation), along)
        found += [(along, still), turned]
        if space.turns:
            own = motions.rotation @ axis
            found += [(own, still), (still, own)]
    moves = [np.hstack(each)[:, space.components] for each in found]
    return [each for each in moves if each.any()]


def _kinds(
    legs: _Legs, errors: Array, covariance: Array, common: Array, frames: Array
) -> tuple[ErrorKind, ...]:
    """Standard deviations under which the errors are likeliest, frames free.

    The common part and the differences are normal, each with its own: first one pair for all
    parameters, then one for each kind.
    """
    names = legs.kinds
    kinds = [kind for kind in ("length", "angle", "sensor") if (names == kind).any()]
    # What all legs have in common, with a variance of one; of what a mirror turns round where the
    # leg stands there is nothing.
    own = np.diag(common)
    sizes = np.where(own > _FITS, np.sqrt(own.clip(0)), np.inf)
    alike = (common + common.T) / 2 / np.outer(sizes, sizes)
    u, values, _ = np.linalg.svd(frames, full_matrices=True)
    kept = u[:, int((values > 1e-6 * values.max(initial=0)).sum()) :].T
    seen, noise = kept @ errors, kept @ covariance @ kept.T
    found: list[ErrorKind] = []
    for together in ([np.full(len(errors), fill_value=True)], [names == kind for kind in kinds]):
        blocks = [
            kept @ np.where(np.outer(mine, mine), part, 0.0) @ kept.T
            for mine in together
            for part in (alike, np.eye(len(errors)))
        ]
        sizes = _likeliest(seen, noise, blocks)
        pairs = zip(sizes[::2].tolist(), sizes[1::2].tolist(), strict=True)
        labels = kinds if found else ["all"]
        found += [ErrorKind(kind, *each) for kind, each in zip(labels, pairs, strict=True)]
    return tuple(found)


def _likeliest(seen: Array, noise: Array, blocks: Sequence[Array]) -> Array:
    """Standard deviations, a block each, under which normal errors are likeliest."""
    sizes = np.ones(len(blocks))

    def misfit(sizes: Array) -> float:
        spread = noise + sum(size**2 * block for size, block in zip(sizes, blocks, strict=True))
        factor = np.linalg.cholesky(spread)
        whitened = np.linalg.solve(factor, seen)
        return float(whitened @ whitened + 2 * np.log(np.diag(factor)).sum())

    for _ in range(_SWEEPS):
        before = sizes
        for place in range(len(sizes)):
            tried = [np.where(np.arange(len(sizes)) == place, size, sizes) for size in _SIZES]
            sizes = min(tried, key=misfit)
        if np.array_equal(sizes, before):
            break
    return sizes
