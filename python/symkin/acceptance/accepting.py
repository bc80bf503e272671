# SPDX-License-Identifier: MIT
"""Acceptance of a calibrated robot by measurements that its calibration has not seen."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from symkin.acceptance.alike import rows_alike
from symkin.acceptance.calibration import Again, calibrated_of, rows_seen
from symkin.acceptance.certificate import ABOUT, Acceptance, Judged, Kind, TestedPose
from symkin.acceptance.doubts import (
    likely_cause,
    rows_left_out,
    why_it_failed,
)
from symkin.acceptance.limits import (
    CONTRADICTED,
    RISK,
    RmsLimits,
    Verdict,
    decide,
    limits_of_rms,
    poses_for_share,
)
from symkin.acceptance.repeatability import pose_accuracy, visits_of
from symkin.acceptance.tested import Tested, positions_of_points
from symkin.analysis.evaluation import AlignedErrors, Evaluation, evaluate
from symkin.analysis.seen import Seen
from symkin.data.measurements import Measurements
from symkin.data.reading import Measured, as_measurements
from symkin.errors import SymkinError, did_you_mean, few
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.computed import rows_not_measured
from symkin.estimate.evidence.standing import what_stands_still
from symkin.estimate.survey import coordinates_of
from symkin.model.given import MechanismGiven
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.options import Coordinates, Frame, Judge, checks
from symkin.present import asker
from symkin.values import Array

_FEWEST, _MANY = 5, 30  # poses, that may stand for all others, and that do so well
_SHARE = 0.95
_NAMED = 5
_ASIDE = 0.25  # of the workspace along an axis, of which poses that span less say little


@checks()
def accept(
    calibrated: Estimate | MechanismGiven,
    measurements: Measured,
    tolerance: float | None = None,
    orientation_tolerance: float | None = None,
    *,
    judge: Judge = "rms",
    uncertainty: float | None = None,
    orientation_uncertainty: float | None = None,
    frames: Sequence[Frame] | None = None,
    of: Coordinates | None = None,
    about: Mapping[str, str] | None = None,
) -> Acceptance:
    """Decide whether a calibrated robot keeps a tolerance, by measurements it has not seen.

    The commanded pose is the model's at the readings: the controller is to have this model. An
    error is the measured pose less that one. Rows whose commanded poses are nearer than the
    tolerance are visits of one pose.

    Parameters
    ----------
    calibrated : Estimate, Mechanism, path or name
        What `identify` found or the folder that it was written to, with which the rows are proved
        to be held out; or a mechanism.
    measurements : Measurements, Simulation, or what `read_measurements` reads
        Poses in full or in part, with readings of all legs.
    tolerance, orientation_tolerance : float, optional
        What the error must not exceed, m and rad; one of them at least.
    judge : {"rms", "largest"}
        What that is: the root mean square over the poses, or the accuracy at every one of them.
    uncertainty, orientation_uncertainty : float, optional
        Standard uncertainty of each coordinate that the device measures, m and rad; by default
        what the table or the noise settings say, with that of the readings.
    frames : sequence of str, optional
        ``["base"]`` if the device was set up anew since the calibration: its frame is fitted to
        this table, and costs as many coordinates.
    of : str, optional
        Coordinates that the error of the position is of, in the device's frame: "x", "y", "z", two
        of them ("xy"), or "height", that above the bed. By default those of the calibration.
    about : mapping, optional
        What else the certificate states: serial numbers, device, person, ...; see `ABOUT`.

    Returns
    -------
    Acceptance

    Raises
    ------
    SymkinError
        If nothing can be tested, or rows are those of the calibration or of a plan.
    """
    wanted: dict[Kind, float | None] = {
        "position": tolerance,
        "orientation": orientation_tolerance,
    }
    found, model, paths = calibrated_of(calibrated)
    if tolerance is not None:
        of = of or _coordinates_of(found, model)
    _check_asked(model, wanted, frames, about, of)
    table = as_measurements(measurements, model)
    given: dict[Kind, float | None] = {
        "position": uncertainty,
        "orientation": orientation_uncertainty,
    }
    exact = _deviations(model, given)
    held_out = _held_out(found, table, exact)
    _require_measured(found, model, table)
    noise = found.noise if found is not None else model.noise
    moved, fitted = tuple(frames or ()), 0
    tested = _tested(found, model, table, noise, of)
    if moved:
        tested, fitted = tested.with_own_base()
        if found is not None:
            fit = found.measurements
            places = positions_of_points(model, fit)[0] if Seen.of(fit).tracked else fit
            alike = rows_alike(places, tested.moved_back, noise, exact)
            _refuse(tested.table, Again(alike, altered=True))
    before = _before(found, table, of)
    length = model.characteristic_length
    apart = tolerance if tolerance is not None else length * (orientation_tolerance or 0.0)
    visits = visits_of(tested.distances(length), apart)
    # Points of one pose share what the robot is off by there, and stand for no others.
    commanded = len(visits_of(tested.distances(length, of_points=False), apart))
    judged: list[Judged] = []
    counts: list[int] = []
    limits: dict[str, list[RmsLimits | None]] = {}
    for kind, limit in wanted.items():
        if limit is None:
            continue
        over_all, means, limits[kind] = _limits_of(
            tested, kind, limit, given[kind], visits, fitted if kind == "position" else 0
        )
        of_poses = [
            (*mean, own_limits)
            for mean, own_limits in zip(means, limits[kind], strict=True)
            if mean and own_limits
        ]
        count = min(commanded, len(of_poses))
        counts.append(count)
        made = _judged(kind, over_all, of_poses, before[kind], judge, tested.failed, count)
        judged.append(made)
    poses = tuple(
        TestedPose(
            tuple(tested.numbers[rows].tolist()),
            pose_accuracy(tested.errors[rows], model.space.size),
            *(limits[kind][index] if kind in limits else None for kind in wanted),
        )
        for index, rows in enumerate(visits)
    )
    still = [each.cause for each in what_stands_still(model, table)]
    doubts = [*rows_left_out(table), *still]
    if failed := next((each for each in judged if each.verdict == "fail"), None):
        doubts = doubts or why_it_failed(found, model, table, tested, failed, moved, of)
    return Acceptance(
        name=model.name,
        judge=judge,
        judged=tuple(judged),
        verdict=_worst([each.verdict for each in judged]),
        poses=poses,
        commanded=commanded,
        held_out=held_out,
        pose_space=model.pose_space,
        failed=tested.failed,
        unread=tested.unread,
        unmeasured=tested.unmeasured,
        fitted=moved,
        of=of,
        tested=_range(tested.coordinates),
        workspace=_box(model),
        about=dict(about or {}),
        digests=_digests([*paths, table.source]),
        notes=(*table.notes, *_aside(judged, tested, model), *_beyond(judge, judged, min(counts))),
        doubts=tuple(doubts),
    )


def _tested(
    found: Estimate | None,
    model: Mechanism,
    table: Measurements,
    noise: NoiseSettings,
    of: Coordinates | None,
) -> Tested:
    """Compare rows with the model; where it can take none, with the mistake in them, if plain."""
    try:
        return Tested(model, table, noise, of)
    except SymkinError as error:
        still = [each.cause for each in what_stands_still(model, table)]
        cause = still or likely_cause(found, model, table)
        if not cause:
            raise
        raise SymkinError(f"{error}; {'; '.join(cause)}") from error


def _limits_of(
    tested: Tested,
    kind: Kind,
    limit: float,
    stated: float | None,
    visits: Sequence[NDArray[np.intp]],
    fitted: int,
) -> tuple[RmsLimits, list[tuple[Array, Array] | None], list[RmsLimits | None]]:
    """Limits of the error over all rows; mean errors of each pose's visits, and their limits.

    The instrument's uncertainty is what is `stated`, or else the rows' own.
    """
    measured = tested.errors_of(kind)
    errors, own = tested.part(kind), tested.uncertainty(kind)
    if stated is not None:
        own = np.where(np.isnan(own), np.nan, stated)
    _require_uncertainty(kind, own)
    known = measured, own[np.isfinite(own).all(axis=1)]
    over_all = limits_of_rms(*known, limit, fitted=fitted)
    means = [_mean_of(errors[rows], own[rows]) for rows in visits]
    return over_all, means, [each and limits_of_rms(*each, limit) for each in means]


def _check_asked(
    model: Mechanism,
    wanted: Mapping[Kind, float | None],
    frames: Sequence[str] | None,
    about: Mapping[str, str] | None,
    of: Coordinates | None,
) -> None:
    if of is not None and wanted["position"] is None:
        raise SymkinError(f'no tolerance of the position is given; expected one of "{of}"')
    if all(each is None for each in wanted.values()):
        raise SymkinError("a tolerance is missing; expected one of the position or orientation")
    kinds = {kind for kind, _ in model.space.errors}
    for kind, value in wanted.items():
        if value is not None and kind not in kinds:
            raise SymkinError(
                f"a tolerance of the {kind} is given; the platform has {' and '.join(kinds)} alone"
            )
        if value is not None and not 0 < value < math.inf:
            raise SymkinError(f"the tolerance is {value:g}; expected more than 0")
    if frames is not None and [*frames] != ["base"]:
        raise SymkinError(
            f"frames are {', '.join(frames) or 'none'}; expected base, where the device was set "
            "up anew, or nothing"
        )
    for name in about or {}:
        if name not in ABOUT:
            raise SymkinError(
                f'about has "{name}"{did_you_mean(name, [*ABOUT])}; expected {", ".join(ABOUT)}'
            )


def _require_measured(found: Estimate | None, model: Mechanism, table: Measurements) -> None:
    """Refuse rows of a plan that nobody measured: they would pass whatever the robot does."""
    computed = [*rows_not_measured(model, table, "the calibrated robot")]
    if found is not None:
        computed += rows_not_measured(found.nominal, table)
    if computed:
        raise SymkinError(str(computed[0]))


def _deviations(model: Mechanism, given: Mapping[Kind, float | None]) -> Array:
    """Standard deviations that are given of the coordinates; NaN of others."""
    known = [math.nan if each is None else each for each in given.values()]
    space = model.space
    return np.repeat(known, [space.size, len(space.rotation)])


def _held_out(found: Estimate | None, table: Measurements, stated: Array) -> bool | None:
    """Refuse rows of the calibration; None if they are not known."""
    if found is None:
        return None
    _refuse(table, rows_seen(found, table, stated))
    return True


def _refuse(table: Measurements, again: Again) -> None:
    """Refuse them, if there are any."""
    if not again.rows.any():
        return
    which = (
        f"{again.rows.sum()} of {len(table.poses)} rows "
        f"({few(table.row_numbers[again.rows].tolist(), _NAMED)})"
    )
    if not again.altered:
        raise SymkinError(
            f"{which} are of the calibration itself; expected measurements that it has not seen"
        )
    option = "uncertainty=" if asker() == "python" else "--uncertainty"
    raise SymkinError(
        f"{which} differ from rows of the calibration by far less than two measurements of one "
        "pose would by the declared noise: they are of the calibration itself, altered; expected "
        "measurements that it has not seen, or, of a device that is that much more exact, its "
        f"uncertainty ({option})"
    )


def _coordinates_of(found: Estimate | None, model: Mechanism) -> Coordinates | None:
    """Of which errors are by the calibration, or by the model's file."""
    return coordinates_of(model) if found is None else found.options.of


def _before(
    found: Estimate | None, table: Measurements, of: Coordinates | None
) -> dict[str, float]:
    """Errors of the drawing at the same rows, in the frames that were found; NaN if unknown."""
    errors: Evaluation | AlignedErrors | None = None
    if found is not None:
        with suppress(SymkinError):
            drawn = found.nominal.replace(frames=found.mechanism.frames)
            errors = evaluate(drawn, measurements=table)
            if found.floats and errors.aligned is not None:
                errors = errors.aligned
    kinds = ("position", "orientation")
    figures = {kind: getattr(errors, f"{kind}_rms", math.nan) for kind in kinds}
    if of is not None and found is not None:
        figures["position"] = math.nan
        with suppress(SymkinError):
            drawn = found.nominal.replace(frames=found.mechanism.frames)
            off = Tested(drawn, table, found.noise, of).errors_of("position")
            figures["position"] = float(np.sqrt((off**2).sum(axis=1).mean()))
    return figures


def _mean_of(errors: Array, uncertainty: Array) -> tuple[Array, Array] | None:
    """The mean error of the visits of a pose, and its uncertainty; None if it was not measured.

    The device may be off by the same at all visits, but not what scatters between them.
    """
    measured = np.isfinite(errors).all(axis=1)
    known = errors[measured]
    if not len(known):
        return None
    scatter = known.var(axis=0, ddof=1).mean() if len(known) > 1 else 0.0
    squares = np.sort(uncertainty[measured] ** 2, axis=1).mean(axis=0, keepdims=True)
    return known.mean(axis=0, keepdims=True), np.sqrt(scatter / len(known) + squares)


def _judged(
    kind: Kind,
    over_all: RmsLimits,
    of_poses: Sequence[tuple[Array, Array, RmsLimits]],
    before: float,
    judge: Judge,
    failed: Sequence[int],
    commanded: int,
) -> Judged:
    tolerance = over_all.tolerance
    verdict: Verdict = over_all.verdict
    reason = ""
    if judge == "largest":
        verdict = _of_every_pose(of_poses, tolerance)
    if over_all.contradicted:
        verdict = "undecided"
        reason = (
            "the errors are smaller than the device's declared uncertainty alone would make them "
            f"in all but {100 * CONTRADICTED:g} % of tables: state the uncertainty that it has"
        )
    elif verdict == "undecided":
        reason = "the tolerance lies between the limits: more poses, or a better device, decide"
    if verdict == "pass" and commanded < _FEWEST:
        verdict = "undecided"
        poses = "one pose" if commanded == 1 else f"{commanded} poses"
        reason = (
            f"{poses} cannot stand for all others: measure {_FEWEST} at least, as ISO 9283 does, "
            f"or {_MANY} that are drawn at random"
        )
    if failed and verdict == "pass":
        verdict = "undecided"
        reason = f"the model cannot take {len(failed)} of the rows, so nothing is known of them"
    error, uncertainty, _ = max(of_poses, key=lambda each: float(np.linalg.norm(each[0])))
    by_band = decide(float(np.linalg.norm(error)), float(uncertainty.max()), tolerance)
    return Judged(kind, over_all, before, by_band, verdict, reason)


def _of_every_pose(poses: Sequence[tuple[Array, Array, RmsLimits]], tolerance: float) -> Verdict:
    """A pass if every pose passes; a failure if one fails, of which there are many to do so."""
    if all(each.upper <= tolerance for _, _, each in poses):
        return "pass"
    risk = RISK / len(poses)
    again = (
        limits_of_rms(error, uncertainty, tolerance, risk=risk)
        for error, uncertainty, each in poses
        if each.lower >= tolerance
    )
    return "fail" if any(each.lower >= tolerance for each in again) else "undecided"


def _worst(verdicts: Sequence[Verdict]) -> Verdict:
    order: tuple[Verdict, ...] = ("fail", "undecided")
    return next((each for each in order if each in verdicts), "pass")


def _require_uncertainty(kind: Kind, values: Array) -> None:
    if np.isnan(values).all() or not np.nanmin(values) > 0:
        raise SymkinError(
            f"the device's uncertainty of the {kind} is not known: expected it in [noise] of the "
            "mechanism's file, or said here (--uncertainty)"
        )


def _box(model: Mechanism) -> Array:
    """Least and largest coordinate of the workspace; none without one."""
    box = model.workspace
    return np.zeros((0, 2)) if box is None else np.column_stack([[*box.lower], [*box.upper]])


def _range(coordinates: Array) -> Array:
    return np.column_stack([coordinates.min(axis=0), coordinates.max(axis=0)])


def _digests(paths: Sequence[Path | None]) -> tuple[tuple[str, str], ...]:
    files = [path for path in paths if path is not None and path.is_file()]
    return tuple((path.name, hashlib.sha256(path.read_bytes()).hexdigest()) for path in files)


def _beyond(judge: Judge, judged: Sequence[Judged], poses: int) -> list[str]:
    """What is said of poses that were not tested."""
    if any(each.verdict != "pass" for each in judged):
        return []
    if judge != "largest":
        words = (
            f"The root mean square is that of {poses} poses; of others they say the more the more "
            f"of them there are, drawn at random: {_MANY} or more."
        )
        return [words] if poses < _MANY else []
    share = RISK ** (1 / poses)
    words = (
        f"If these {poses} poses were drawn at random, at least {100 * share:.3g} % of all poses "
        "are within the tolerance, with 95 % confidence"
    )
    needed = poses_for_share(_SHARE, 1 - RISK)
    return [words + (f"; for 95 % of them test {needed}." if poses < needed else ".")]


def _aside(judged: Sequence[Judged], tested: Tested, model: Mechanism) -> list[str]:
    """Where in the workspace a robot that passes was not tested."""
    box, spans = _box(model), np.ptp(tested.coordinates, axis=0)
    if not len(box) or any(each.verdict != "pass" for each in judged):
        return []
    told = [
        f"{100 * share:.2g} % of {name}"
        for name, share in zip(model.space.units, spans / np.ptp(box, axis=1), strict=False)
        if share < _ASIDE
    ]
    words = "the poses span {} of the workspace: of the rest this says nothing"
    return [words.format(" and ".join(told))] * bool(told)
