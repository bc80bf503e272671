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
from symkin.model.symmetry import SymmetryPair, symmetry_pairs
from symkin.model.tolerances import parameter_tolerances
from symkin.results import Result
from symkin.values import Value, plain, record

__all__ = ["ElementTest", "ErrorKind", "RobotSymmetry", "robot_symmetry"]

Array = NDArray[np.float64]

_POSES = 60
_STEP = 1e-3  # tolerances, of parameters; a thousandth of which moves frames, m and rad
_SMALL = 1e-9  # of the largest eigenvalue: what is zero in a covariance of tolerances
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

    Parameters
    ----------
    estimate : ndarray, shape (n,)
        And its
    covariance : ndarray, shape (n, n)
        both in comparable units.
    contrasts : ndarray, shape (k, n)
        K: zero of K x is tested.
    free : ndarray, shape (n, m)
        Directions that are no matter: what they do to the contrasts is projected out.
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
        If the drawing has no symmetry that keeps working modes and home, or legs that bind the
        platform; or if the estimate rests on priors, or not all parameters were estimated.
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
    if nominal.bound:
        raise SymkinError(f'the legs of "{nominal.name}" bind its platform: not tested')
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
    """Derivatives of all legs' readings by their estimated parameters, in tolerances."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        count = len(mechanism.parameter_names)
        self.estimated = mechanism.core.estimated_parameters
        self.columns = np.array(
            [leg * count + place for leg, own in enumerate(self.estimated) for place in own]
        )
        all_tolerances = np.asarray(parameter_tolerances(mechanism))
        self.tolerances = all_tolerances.ravel()[self.columns]
        self.table = all_tolerances
        self.poses = sample_workspace(mechanism, _POSES).poses
        self.rows = self.derivatives(self.poses)

    def derivatives(self, poses: Array) -> list[Array]:
        """Of each leg, shape (poses, p of the leg); readings times gains, that is of joints."""
        mechanism = self.mechanism
        rows = [np.zeros((len(poses), len(own))) for own in self.estimated]
        for place in range(len(mechanism.parameter_names)):
            moved = []
            for way in (1, -1):
                parameters = mechanism.parameters.copy()
                parameters[:, place] += way * _STEP * self.table[:, place]
                moved.append(mechanism.with_parameters(parameters).inverse_kinematics(poses))
            slopes = (moved[0] - moved[1]) / (2 * _STEP)
            for leg, own in enumerate(self.estimated):
                if place in own:
                    rows[leg][:, own.index(place)] = slopes[:, leg]
        return rows

    def action(self, element: SymmetryPair) -> Array:
        """What the element does to the errors of all legs: C_j(image) D = s C_i(pose)."""
        images = self.derivatives(element.map_poses(self.mechanism, self.poses))
        sizes = [len(own) for own in self.estimated]
        starts = np.cumsum([0, *sizes])
        result = np.zeros((starts[-1], starts[-1]))
        gains = self.mechanism.sensor_gains
        for leg, onto in enumerate(element.permutation):
            sign = element.joints[leg].sign * gains[leg] / gains[onto]
            block, _ = _explained(images[onto], sign * self.rows[leg])
            rows, columns = (slice(starts[each], starts[each + 1]) for each in (onto, leg))
            result[rows, columns] = block
        return result

    def frames(self) -> Array:
        """Errors of all legs that only move base or platform, one a column."""
        mechanism, columns = self.mechanism, []
        for motion in _small_motions(mechanism):
            readings = [
                mechanism.inverse_kinematics(way.transform_poses(mechanism.core, self.poses))
                for way in (motion, motion.inverse())
            ]
            change = readings[0] - readings[1]
            parts = [
                _explained(rows, change[:, leg : leg + 1]) for leg, rows in enumerate(self.rows)
            ]
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


def _explained(rows: Array, change: Array) -> tuple[Array, float]:
    """Errors that change readings so, and what of the change they leave; out of reach aside."""
    reached = np.isfinite(rows).all(axis=1) & np.isfinite(change).all(axis=1)
    rows, change = rows[reached], change[reached]
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0] = 1
    found = np.linalg.lstsq(rows / scale, change, rcond=1e-9)[0] / scale[:, None]
    size = np.abs(change).max(initial=0)
    return found, float(np.abs(rows @ found - change).max() / size) if size > 0 else 0.0


def _small_motions(mechanism: Mechanism) -> list[_core.SymmetryPair]:
    """A small shift or turn of the base, or of the platform, along each axis that there is."""
    space, still = mechanism.space, _core.Isometry(np.eye(3), np.zeros(3))
    planar = mechanism.pose_space in ("planar", "point")
    motions = []
    for axis in range(3):
        shift, turn = np.zeros(3), np.eye(3)
        shift[axis] = 1e-5
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        cosine, sine = np.cos(1e-5), np.sin(1e-5)
        turn[np.ix_([a, b], [a, b])] = [[cosine, -sine], [sine, cosine]]
        if space.moves and not (planar and axis == 2):
            motions.append(_core.Isometry(np.eye(3), shift))
        if not planar or axis == 2:
            motions.append(_core.Isometry(turn, np.zeros(3)))
    ends = [_core.SymmetryPair(each, still, False) for each in motions]
    if space.turns:
        ends += [_core.SymmetryPair(still, each, False) for each in motions]
    return ends


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
        for place in range(len(sizes)):
            tried = [np.where(np.arange(len(sizes)) == place, size, sizes) for size in _SIZES]
            sizes = min(tried, key=misfit)
    return sizes
