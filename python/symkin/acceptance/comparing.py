# SPDX-License-Identifier: MIT
"""Two calibrations of one robot: what moved between them, and whether it is more than noise."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import Any, ClassVar

import numpy as np

from symkin import _core
from symkin.acceptance.alike import rows_alike
from symkin.acceptance.calibration import row_digests
from symkin.analysis.promises import CONFIDENCE, parameter_effects, thinned
from symkin.analysis.workspace import sample_workspace
from symkin.errors import SymkinError
from symkin.estimate.estimate import Estimate
from symkin.estimate.parameters import Unknown
from symkin.estimate.survey import adjoint, without_motions
from symkin.model.mechanism import Mechanism
from symkin.model.poses import transforms
from symkin.options import checks
from symkin.pipeline import saved_estimate
from symkin.results import Result
from symkin.values import Array, Value, field, record

_RANK = 1e-9  # of the largest eigenvalue, of unknowns in their deviations
_KNOWN = 1.0  # of its tolerance: the deviation of a difference that says something of it
_BY_TOLERANCE = 0.5  # of their tolerances, by which these differ in each leg of two robots (rms)
_SEVERAL = 6  # of these, at least
_ALARM = 0.01  # of sound pairs of calibrations are said to differ


@record
class MovedParameter(Value):
    """One unknown in two calibrations.

    Attributes
    ----------
    name, unit : str
        Such as ``leg2.distal_length``; m, rad, or empty for a number.
    first, second : float
        What it was found to be.
    deviation : float
        Standard deviation of the difference.
    moved : bool
        Whether it differs by more than noise, with 1% of false alarms over all unknowns together.
    """

    name: str
    unit: str
    first: float
    second: float
    deviation: float
    moved: bool

    @property
    def change(self) -> float:
        """Second less first."""
        return self.second - self.first

    @property
    def sigmas(self) -> float:
        """The change in its standard deviations; NaN where both only repeat the prior."""
        return self.change / self.deviation if self.deviation > 0 else float("nan")


@record
class Comparison(Result):
    """What moved between two calibrations of one robot.

    Attributes
    ----------
    name : str
        Of the robot.
    statistic, p_value : float
        Chi-square of all differences together, and how often noise alone makes a larger one.
    degrees : int
        Of it.
    shape_statistic, shape_p_value : float
        The same of what the end-effector shows of it but for constant motions of base and tool:
        of a device that was set up anew.
    shape_degrees : int
        Of it.
    parameters : tuple of MovedParameter
        The unknowns that both have.
    left_out : tuple of str
        Those that one of them has alone.
    position, orientation : float
        How far the end-effector moved: root mean square over the workspace, m and rad; what
        constant motions of base and tool take away left out.
    position_by_noise, orientation_by_noise : float
        What noise alone keeps below in 95% of pairs.
    confidence : float
        That share.
    doubts : tuple of str
        Why not to trust it: what speaks against either calibration.
    """

    name: str
    statistic: float
    degrees: int
    p_value: float
    shape_statistic: float
    shape_degrees: int
    shape_p_value: float
    parameters: tuple[MovedParameter, ...]
    left_out: tuple[str, ...]
    position: float = field(unit="rms_m")
    orientation: float = field(unit="rms_rad")
    position_by_noise: float = field(unit="rms_m")
    orientation_by_noise: float = field(unit="rms_rad")
    confidence: float = CONFIDENCE
    doubts: tuple[str, ...] = ()
    pose_space: str = field(private=True, default="spatial")

    derived: ClassVar[tuple[str, ...]] = ("moved", "shape_moved")

    @property
    def moved(self) -> bool:
        """Whether the parameters differ by more than noise."""
        return self.p_value < _ALARM

    @property
    def shape_moved(self) -> bool:
        """Whether what they differ by is more than a device that was set up anew."""
        return self.shape_p_value < _ALARM

    def columns(self) -> Mapping[str, Any]:
        """Return the unknowns, a row each."""
        names = ("name", "unit", "first", "second", "change", "deviation", "sigmas", "moved")
        return {name: [getattr(each, name) for each in self.parameters] for name in names}


@checks()
def compare(
    first: Estimate | str | os.PathLike[str], second: Estimate | str | os.PathLike[str]
) -> Comparison:
    """Compare two calibrations of one robot.

    Both rest on the same drawing: where priors hold parameters, both err alike, and the covariance
    of the difference is less than the sum of theirs.

    Parameters
    ----------
    first, second : Estimate or path
        What `identify` found, or the folders or results files that it was written to.

    Raises
    ------
    SymkinError
        If one did not converge, or they are not of one drawing.
    """
    pair = [_estimate(each) for each in (first, second)]
    one, other = pair
    for each, which in zip(pair, ("first", "second"), strict=True):
        if not each.converged:
            raise SymkinError(f"the {which} calibration did not converge: {each.failure}")
    alike = one.nominal.parameters.shape == other.nominal.parameters.shape
    if not alike or not np.allclose(one.nominal.parameters, other.nominal.parameters):
        raise SymkinError(
            f'the calibrations are of the drawings "{one.nominal.name}" and '
            f'"{other.nominal.name}", which differ; expected two that began with the same drawing'
        )
    names = [name for name in one.names if name in other.names and name.startswith("leg")]
    if not names:
        raise SymkinError("no parameter of a leg was identified in both calibrations")
    own = [[each.names.index(name) for name in names] for each in pair]
    one_model, other_model = (
        found.model_covariance[np.ix_(at, at)] for found, at in zip(pair, own, strict=True)
    )
    by_model = covariance_of_difference(one_model, other_model, _shared_prior(pair, names))
    shared = one.widened * other.widened * (one_model + other_model - by_model)
    printed = sum(found.covariance[np.ix_(at, at)] for found, at in zip(pair, own, strict=True))
    covariance = printed - shared
    firsts = [{each.name: each for each in found.first_unknowns} for found in pair]
    values = [np.array([each[name].value for name in names]) for each in firsts]
    difference = values[1] - values[0]
    statistic, degrees = statistic_of(difference, covariance)
    p_value = _core.chi_square_tail(statistic, degrees)
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    limit = _core.student_limit(_ALARM / len(names), np.inf)
    parameters = tuple(
        MovedParameter(
            name,
            firsts[0][name].unit,
            float(values[0][i]),
            float(values[1][i]),
            float(deviations[i]),
            bool(abs(difference[i]) > limit * deviations[i] > 0),
        )
        for i, name in enumerate(names)
    )
    moves, form = _end_effector(one, names, difference, covariance)
    of_shape = _shape(difference, covariance, form)
    shape_p_value = _core.chi_square_tail(*of_shape)
    robots: list[str] = []
    if shape_p_value < _ALARM:
        robots = _two_robots([firsts[0][name] for name in names], difference, deviations)
    every = {*one.names, *other.names} - set(names)
    return Comparison(
        name=one.nominal.name,
        statistic=statistic,
        degrees=degrees,
        p_value=p_value,
        shape_statistic=of_shape[0],
        shape_degrees=of_shape[1],
        shape_p_value=shape_p_value,
        parameters=parameters,
        left_out=tuple(sorted(name for name in every if name.startswith("leg"))),
        position=moves[0][0],
        orientation=moves[1][0],
        position_by_noise=moves[0][1],
        orientation_by_noise=moves[1][1],
        doubts=(
            *_same_rows(pair),
            *robots,
            *(
                f"the {which} calibration is doubtful: {doubt}"
                for found, which in zip(pair, ("first", "second"), strict=True)
                for doubt in found.doubts
            ),
        ),
        pose_space=one.nominal.pose_space,
    )


def covariance_of_difference(first: Array, second: Array, prior: Array) -> Array:
    """Covariance of the difference of two estimates that share a prior.

    With the data's information F and the prior's P: A F_A A + B F_B B + (A - B) P (A - B), which
    is A + B - A P B - B P A.
    """
    both = first @ prior @ second
    return np.asarray(first + second - both - both.T)


def statistic_of(difference: Array, covariance: Array) -> tuple[float, int]:
    """Chi-square of a difference over the directions that have a variance, and how many."""
    sizes = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sizes > 0, sizes, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > _RANK * max(float(values[-1]), 0.0)
    along = (difference / scale) @ vectors[:, kept]
    return float(np.sum(along**2 / values[kept])), int(kept.sum())


def _estimate(given: Any) -> Estimate:
    if isinstance(given, Estimate):
        return given
    found: Estimate = saved_estimate(given)
    return found


def _same_rows(pair: list[Estimate]) -> list[str]:
    """Say of what was measured once that it cannot have changed."""
    one, other = (
        [
            digest
            for digest, pose in zip(row_digests(taken), taken.poses, strict=True)
            if np.isfinite(pose).any()  # since readings may be those that were commanded
        ]
        for taken in (found.measurements for found in pair)
    )
    first, second = pair
    same = len(set(one).intersection(other)) or int(
        rows_alike(first.measurements, second.measurements, second.noise).sum()
    )
    if not same:
        return []
    return [
        f"{same} of {len(other)} rows of the second calibration are those of the first: what was "
        "measured once shows neither a change of the robot nor noise"
    ]


def _two_robots(unknowns: Sequence[Unknown], difference: Array, deviations: Array) -> list[str]:
    """Say that the calibrations may be of two robots: each leg differs by its tolerances."""
    legs: dict[str, list[float]] = {}
    for each, change, deviation in zip(unknowns, difference, deviations, strict=True):
        if deviation < _KNOWN * each.tolerance:
            square = (change**2 - deviation**2) / each.tolerance**2  # less that of noise
            legs.setdefault(each.name.partition(".")[0], []).append(square)
    count = sum(map(len, legs.values()))
    by = math.sqrt(max(min(map(fmean, legs.values()), default=0.0), 0.0))
    if len(legs) < 2 or count < _SEVERAL or by < _BY_TOLERANCE:
        return []
    return [
        f"the parameters of every leg differ by {by:.2g} of the drawing's tolerances or more "
        "(rms): these may be two robots of one drawing, whose serial numbers tell, rather than one "
        "that has changed"
    ]


def _shared_prior(pair: list[Estimate], names: list[str]) -> Array:
    """Information of the priors that both have."""
    priors = []
    for found in pair:
        known = {each.name: each.prior for each in found.first_unknowns}
        priors.append(np.array([known[name] for name in names]))
    both = np.isfinite(priors[0]) & (priors[0] == priors[1])
    return np.diag(np.where(both, np.where(both, priors[0], 1.0) ** -2.0, 0.0))


def _end_effector(
    found: Estimate, names: list[str], difference: Array, covariance: Array
) -> tuple[list[tuple[float, float]], Array]:
    """How far the end-effector moved, and what noise keeps below: position, then orientation.

    Also the quadratic form of both.
    """
    robot = found.mechanism.replace(frames=None, curvature=None)
    poses = thinned(sample_workspace(robot, None, robot.protocol.seed).poses)
    effects, good = parameter_effects(robot, poses)
    own_names = (*robot.parameter_names, "sensor_quadratic", "sensor_cosine", "sensor_sine")
    scalars = [f"leg{leg + 1}.{name}" for leg in range(len(robot.legs)) for name in own_names]
    columns = {each.name: each.column for each in found.unknowns}
    onto = np.zeros((len(scalars), len(names)))
    own = {found.names.index(name): i for i, name in enumerate(names)}
    for row, name in enumerate(scalars):
        column = columns.get(name, -1)
        if column in own:
            onto[row, own[column]] = 1.0
    by_names = effects.reshape(*effects.shape[:2], -1) @ onto
    length = robot.characteristic_length
    free = without_motions(by_names, _by_frames(robot, poses[good]), length)
    moves, forms = [], []
    for part in (free[:, :3], free[:, 3:]):
        forms.append(np.ascontiguousarray(np.einsum("nij,nik->jk", part, part) / len(part)))
        noise = _core.QuadraticForm.of(forms[-1], covariance).quantile(CONFIDENCE)
        moved = float(difference @ forms[-1] @ difference)
        moves.append((math.sqrt(max(moved, 0.0)), math.sqrt(max(noise, 0.0))))
    return moves, forms[0] + length**2 * forms[1]


def _by_frames(robot: Mechanism, poses: Array) -> Array:
    """How the platform moves with a motion of the base, and with one of the tool, (n, 6, k)."""
    platform = transforms(robot.pose_space, poses)
    still = np.broadcast_to(np.eye(3), platform.rotation.shape)
    base = adjoint(still, platform.translation)
    tool = adjoint(platform.rotation, np.zeros_like(platform.translation))
    own = robot.space.frame_components
    return np.concatenate([base[:, :, own], tool[:, :, own]] if robot.space.turns else
                          [base[:, :, own]], axis=2)  # fmt: skip


def _shape(difference: Array, covariance: Array, form: Array) -> tuple[float, int]:
    """Chi-square of what the end-effector sees of a difference."""
    sizes = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    values, vectors = np.linalg.eigh(form * np.outer(sizes, sizes))
    kept = values > _RANK * max(float(values[-1]), 0.0)
    seen = (vectors[:, kept] / np.where(sizes > 0, sizes, np.inf)[:, None]).T
    return statistic_of(seen @ difference, seen @ covariance @ seen.T)
