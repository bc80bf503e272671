# SPDX-License-Identifier: MIT
"""What a joint estimate knows: its best and worst combinations, what each pose and heights tell."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from symkin import _core
from symkin.analysis.observability import name_combination
from symkin.analysis.observed import Observable, Observed
from symkin.analysis.probing import CALIPER
from symkin.analysis.promises import anywhere, promised
from symkin.analysis.seen import Seen
from symkin.analysis.workspace import sample_workspace
from symkin.errors import SymkinError
from symkin.estimate.assumed import with_assumed
from symkin.estimate.blunders import without_rejected
from symkin.estimate.found import Found
from symkin.estimate.problem import KINDS, Problem
from symkin.estimate.survey import HeldByPriors, Survey, form_of
from symkin.estimate.whitened import information_of, typical_sizes, whitened_rows
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Frames, height_of_bed
from symkin.options import Coordinates
from symkin.values import Array, Value, field, record

_SAMPLES = 4000  # poses of the workspace over which accuracy is expected
_CORRELATED = 10
_NEARLY_ALL = 0.9  # of the square of a direction
_INDISPENSABLE = 1e-9  # of the share of a condition that the other poses leave open
_HELD = 1e-4  # deviations within which one pose alone is let move the estimate
_STEPS = 50
_DIRECTIONS = 12  # in the plane, over which printed sizes are averaged
_LEAST_SPARE = 3  # heights more than they show combinations, to judge by
_SHOWN, _SILENT = 0.5, 0.9  # of the deviation before
_PLAIN = {
    "distal_length": "length of the rods",
    "proximal_length": "length of the cranks",
    "base_radius": "distance of towers or shafts from the centre",
    "base_azimuth": "where they stand around it",
    "base_height": "how high they are",
    "guide_elevation": "towers leaning in or out",
    "guide_swing": "towers leaning sideways",
    "axis_elevation": "shafts that are not level",
    "axis_swing": "shafts turned sideways",
    "sensor_gain": "travel a step",
    "sensor_offset": "end stops",
}


@record
class Direction(Value):
    """A combination of unknowns, and how well it is known.

    Attributes
    ----------
    deviation : float
        Its standard deviation, in tolerances.
    combination : str
        In tolerances.
    unknowns : tuple of str
        Those that make nearly all of it, the most first.
    """

    deviation: float = field(unit="in_tolerances")
    combination: str
    unknowns: tuple[str, ...] = ()


@record
class Correlation(Value):
    """Two unknowns that the observations hardly tell apart.

    Attributes
    ----------
    unknowns : tuple of str
        Their names.
    correlation : float
        From -1 to 1.
    """

    unknowns: tuple[str, str]
    correlation: float


@record
class BudgetLine(Value):
    """A part of the errors to expect, by where it comes from.

    Attributes
    ----------
    source : str
        ``observations`` for noise, priors and what was not shown; or what was assumed.
    unit : str
        Of what was assumed; empty for a ratio.
    deviation : float
        As it was declared; NaN of the observations.
    position, orientation : float
        The root mean square over the workspace that it leads to by itself, m and rad.
    share : float
        Of the mean square of the position error, or of the orientation's if nothing moves.
    """

    source: str
    unit: str
    deviation: float
    position: float = field(unit="rms_m")
    orientation: float = field(unit="rms_rad")
    share: float


@record
class Expected(Value):
    """Errors of the target that the uncertain unknowns lead to expect at given readings.

    To first order, in the device's frame if there are frames: what frames and geometry explain
    alike does not matter. With what was assumed and declared (`identify`'s `assume`), which is
    taken as normal; without what the model lacks.

    Attributes
    ----------
    position, orientation : float
        The mean of such robots: root mean square over the workspace and over robots, m and rad.
    confidence : float
        Share of such robots of which the root mean square over the workspace is within
    position_bound, orientation_bound : float
        these, and of which the error at every pose of the workspace is within
    position_anywhere, orientation_anywhere : float
        these, m and rad.
    worst : float
        Position at the pose of the workspace where it is largest, root mean square, m.
    where : ndarray
        That pose: coordinates as in the measurements.
    poses : int
        Poses of the workspace in the figures.
    held : HeldByPriors or None
        The part that priors leave, since the observations say next to nothing of it, if any.
    up_to_frames : bool
        Whether errors are those that no other base and platform frame would take away, since no
        observation shows where the platform's frame is: points at unknown places were measured, or
        nothing but readings.
    up_to_turn : bool
        Whether those of the orientation are what no other turn of the platform's frame would take
        away, since of an unknown target only the place was measured.
    budget : tuple of BudgetLine
        Where the mean comes from, the observations first; empty if nothing was assumed.
    of : str or None
        The coordinates that errors of the position are of, such as "z" or "height"; None: of all.
    """

    position: float = field(unit="rms_m")
    orientation: float = field(unit="rms_rad")
    confidence: float
    position_bound: float = field(unit="rms_m")
    orientation_bound: float = field(unit="rms_rad")
    position_anywhere: float = field(unit="m")
    orientation_anywhere: float = field(unit="rad")
    worst: float = field(unit="rms_m")
    where: Array
    poses: int
    held: HeldByPriors | None = None
    up_to_frames: bool = False
    up_to_turn: bool = False
    budget: tuple[BudgetLine, ...] = ()
    of: str | None = None

    @classmethod
    def by(cls, found: Found) -> Expected | None:
        """Over the calibrated mechanism's workspace; None without one."""
        robot, of = found.mechanism, found.options.of
        try:
            poses = expected_over(robot, of)
            survey, known = promising(found, robot)
            effects, good = survey.effects(poses)
            effects = survey.alone(effects, poses[good], of)
        except SymkinError:
            return None
        if not len(effects):
            return None
        variances = ((effects @ known) * effects).sum(axis=2)
        position, orientation = variances[:, :3].sum(axis=1), variances[:, 3:].sum(axis=1)
        parts = (effects[:, :3], effects[:, 3:])
        forms = tuple(form_of(part) / len(part) for part in parts)
        asked = (found.options.confidence, found.noise_degrees)
        counts = (len(effects), len(poses) - len(effects))
        bounds = promised((forms[0], forms[1]), known, counts, *asked)
        largest = anywhere(effects, known, *asked)
        worst = int(np.argmax(position))
        budget = _budget(found, effects, known)
        held, survey = None, dataclasses.replace(survey, assumed=())
        if found.gauge and found.options.gauge == "prior":
            layout = survey.layout.with_prior("tolerances")
            survey = dataclasses.replace(survey, layout=layout, priors=layout.prior)
        if np.isfinite(survey.priors).any():
            factors = found.noise_factor, found.conflict_factor
            held = survey.held(poses, found.model_covariance, *factors, of)
        return cls(
            position=float(np.sqrt(position.mean())),
            orientation=float(np.sqrt(orientation.mean())),
            confidence=bounds.confidence,
            position_bound=bounds.position_bound,
            orientation_bound=bounds.orientation_bound,
            position_anywhere=largest[0],
            orientation_anywhere=largest[1],
            worst=float(np.sqrt(position[worst])),
            where=poses[good][worst],
            poses=len(effects),
            held=held if held and held.combinations else None,
            up_to_frames=survey.floating,
            up_to_turn=survey.turned_anyhow,
            budget=budget,
            of=of,
        )


def expected_over(robot: Mechanism, of: Coordinates | None = None) -> Array:
    """The poses of a robot's workspace over which the errors to expect of it are averaged."""
    poses = sample_workspace(robot, _SAMPLES, robot.protocol.seed).poses
    return over_bed(robot, poses, of)


def over_bed(robot: Mechanism, poses: Array, of: Coordinates | None) -> Array:
    """The same poses; of the height above the bed of a platform that never turns, on the bed."""
    if of != "height" or robot.pose_space != "translating":
        return poses
    plane = (robot.frames or Frames()).plane or (0.0, 0.0, 0.0)
    return np.column_stack([poses[:, :2], height_of_bed(plane, poses)])


def _budget(found: Found, effects: Array, known: Array) -> tuple[BudgetLine, ...]:
    """Where the expected error comes from; nothing if all of it is of the observations."""
    if not found.assumed:
        return ()
    columns = len(found.names)
    parts = [slice(columns), *(slice(i, i + 1) for i in range(columns, len(known)))]
    squares = np.zeros((len(parts), 6))
    for of_part, own in zip(squares, parts, strict=True):
        moved = effects[:, :, own]
        of_part[:] = np.einsum("nik,kl,nil->i", moved, known[own, own], moved) / len(effects)
    position, orientation = squares[:, :3].sum(axis=1), squares[:, 3:].sum(axis=1)
    judged = position if found.nominal.space.moves else orientation
    named = [("observations", "", math.nan)]
    named += [(each.name, each.unit, each.deviation) for each in found.assumed]
    roots = np.sqrt(position).tolist(), np.sqrt(orientation).tolist()
    figures = zip(*roots, (judged / judged.sum()).tolist(), strict=True)
    return tuple(BudgetLine(*of, *own) for of, own in zip(named, figures, strict=True))


def promising(found: Found, robot: Mechanism) -> tuple[Survey, Array]:
    """What the errors to expect follow from: effects, and the covariance of their columns."""
    survey = dataclasses.replace(survey_of(found, robot), assumed=found.assumed)
    return survey, with_assumed(found.observed_covariance, found.assumed)


def survey_of(found: Found, robot: Mechanism, observed: Observable = "pose") -> Survey:
    """What may be observed of a robot whose unknowns are the columns of an estimate.

    Points, if they are all that was measured of positions; readings, if they are all there is; the
    position, if nothing showed how the target is turned.
    """
    layout = Problem.of(found.nominal, found.measurements, found.options).layout
    # Some may have been held to settle the gauge.
    held = [i for i, name in enumerate(layout.names) if name not in found.names]
    layout = layout.without(held) if held else layout
    if found.fitted_prior is not None:
        layout = found.fitted_prior.on(layout)
    seen, taken = Observed((observed,)), Seen.of(found.measurements)
    if observed != "pose":
        pass
    elif taken.tracked:
        seen = Observed(("points",), points=robot.frames.points if robot.frames else ())
    elif taken.between_rows and taken.further == {"separations"}:
        seen = Observed(("separation",))
    elif taken.nothing:
        seen = Observed(("readings",))
    elif taken.placed and not taken.turned:
        seen = Observed(("position",))
    return Survey(seen, layout.names, layout.prior, robot, layout, found.options)


def directions_of(found: Found, tolerances: Array) -> tuple[Direction, ...]:
    """The combinations that are known worst and best, over what was known before.

    `tolerances` are those of the columns, NaN without; columns without one are left out, and what
    a fit without an end says nothing of.
    """
    kept = np.isfinite(tolerances) & np.isfinite(np.diag(found.covariance))
    if not kept.any():
        return ()
    scale = tolerances[kept]
    inner = np.asarray(found.covariance)[np.ix_(kept, kept)] / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(inner)
    names = tuple(np.array(found.names)[kept])
    both = []
    for value, vector in ((values[-1], vectors[:, -1]), (values[0], vectors[:, 0])):
        order = np.argsort(-np.abs(vector), kind="stable")
        count = int(np.searchsorted(np.cumsum(vector[order] ** 2), _NEARLY_ALL)) + 1
        most = tuple(names[i] for i in order[:count].tolist())
        deviation = float(np.sqrt(max(value, 0.0)))
        both.append(Direction(deviation, name_combination(vector, names), most))
    return tuple(both)


def correlations_of(covariance: Array, names: Sequence[str]) -> tuple[Correlation, ...]:
    """Those that are told apart worst, the worst first."""
    deviations = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = np.nan_to_num(covariance / np.outer(deviations, deviations))
    lower = np.tril(correlation, -1)
    order = np.argsort(-np.abs(lower), axis=None)[:_CORRELATED]
    return tuple(
        Correlation((names[j], names[i]), float(lower[i, j]))
        for i, j in zip(*np.unravel_index(order, lower.shape), strict=True)
        if lower[i, j]
    )


@record
class Influence(Value):
    """Every pose against all others, to first order.

    Attributes
    ----------
    residual : ndarray, shape (N,)
        Root mean square of what its observations differ by from what the estimate without them
        predicts, in standard deviations: about 1 for a sound pose. NaN for a pose that brings no
        equation, or without which something could not be estimated.
    moves : ndarray, shape (N,)
        How far the estimate moves without the pose: the largest change of any combination of
        unknowns, in its standard deviation.
    unknown : tuple of str
        The single unknown that moves furthest; empty where nothing is known, and where single
        unknowns depend on a gauge.
    by : ndarray, shape (N,)
        How far that one moves, in its standard deviations.
    """

    residual: Array
    moves: Array
    unknown: tuple[str, ...]
    by: Array

    @classmethod
    def of(cls, found: Found) -> Influence | None:
        """Of an estimate; None if a loss has weighed its poses."""
        options = dataclasses.replace(found.options, noise=found.noise)
        if options.loss_per == "reading":
            options = dataclasses.replace(options, loss="none", loss_per="pose")
        if options.loss != "none":
            return None
        nominal = found.nominal.replace(frames=None) if found.legs else found.nominal
        problem, fit, _ = Problem.of(nominal, without_rejected(found), options).resolved()
        rows = whitened_rows(problem, fit)
        information, covariance = information_of(problem.layout, rows)
        deviations = np.sqrt(np.diag(covariance))
        names = problem.layout.names
        count = len(found.measurements.poses)
        residual, moves, by = (np.full(count, np.nan) for _ in range(3))
        unknown = [""] * count
        for pose in np.flatnonzero(np.array(fit.conditions) > 0).tolist():
            gradient = _gradient(problem, fit, pose, deviations)
            own = rows[pose, : fit.conditions[pose]]
            open_to = np.eye(len(own)) - own @ covariance @ own.T
            if np.linalg.eigvalsh(open_to)[0] < _INDISPENSABLE or pose in fit.aside:
                continue
            along = covariance @ gradient
            change = along + covariance @ own.T @ np.linalg.solve(open_to, own @ along)
            squares = fit.chi_squares[pose] + gradient @ change
            residual[pose] = np.sqrt(max(squares, 0.0) / len(own))
            moves[pose] = np.sqrt(max(float(change @ information @ change), 0.0))
            if fit.gauge_directions == 0:
                single = np.abs(change) / deviations
                unknown[pose], by[pose] = names[int(np.argmax(single))], single.max()
        return cls(residual, moves, tuple(unknown), by)


def _gradient(problem: Problem, fit: _core.JointFit, pose: int, deviations: Array) -> Array:
    """Half the derivative of a pose's chi-square by the unknowns, its latent pose moving along.

    With everything else held by priors, the estimate from this pose alone moves by their variance
    times it: the estimator's own elimination of the pose tells, whatever was observed.
    """
    layout = problem.layout
    held = _HELD * np.where(deviations > 0, deviations, typical_sizes(problem.layout))
    alone = _core.fit_jointly(
        problem.mechanism.straight,
        fit.setup,
        problem.observed_in(problem.measurements.subset(np.array([pose])), np.array([pose])),
        layout.column.tolist(),
        held,
        "none",
        0.0,
        0.0,
        _STEPS,
        False,
        layout.column_tolerances,
        fit.poses[pose : pose + 1],
        rows=False,
        ties=list(layout.ties),
    )
    return np.asarray(-alone.change / held**2)


@record
class Shown(Value):
    """How far a kind of parameter is known, over what the tolerances say of it: 1 is no better.

    Attributes
    ----------
    parameter : str
        Such as ``base_radius``.
    common : float
        Of the mean of all legs.
    between : float
        Of what differs from leg to leg; NaN if it is shared, or of one leg alone.
    """

    parameter: str
    common: float
    between: float

    @property
    def plainly(self) -> str:
        """What the parameter is on a printer; its name where nobody said."""
        return _PLAIN.get(self.parameter, self.parameter)

    @property
    def is_shown(self) -> bool:
        """Whether the heights show what all legs have alike, or what differs between them."""
        return "shown" in (in_words(self.common), in_words(self.between))


@record
class Heights(Value):
    """What heights above a plane show.

    Attributes
    ----------
    before : float
        Heights as the nominal robot would have them less those measured, about the plane that fits
        best, root mean square, m.
    fitted : float
        The same of the calibrated robot, m.
    after : float
        Heights less what all other points lead to expect, each left out by itself (to first order),
        root mean square, m. NaN where so few points say nothing of each other.
    size_before, size_after, size_with_length : float
        Standard deviation of the size of what it makes, of a length in the plane over that length:
        by the tolerances alone, as identified, and if one more length was measured along x to
        `CALIPER`.
    span : float
        That length, m: twice the root mean square distance of the points from their centre.
    shown : tuple of Shown
        The parameters that were unknown.
    """

    before: float = field(unit="rms_m")
    fitted: float = field(unit="rms_m")
    after: float = field(unit="rms_m")
    size_before: float
    size_after: float
    size_with_length: float
    span: float = field(unit="m")
    shown: tuple[Shown, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of the parameters and of the size of prints, in sentences."""
        sizes = (self.size_before, self.size_after, self.size_with_length)
        before, after, with_length = (f"{100 * each:.2g} mm" for each in sizes)
        size = (
            "Longer rods on a wider robot touch a bed at much the same heights and print "
            f"everything larger: 100 mm are known to {after} (standard deviation; {before} by the "
            f"tolerances alone); one more length of {1e3 * self.span:.0f} mm along x, printed and "
            f"measured to {1e3 * CALIPER:.2g} mm, would make it {with_length}."
        )
        hidden = [f"{each.plainly} ({each.parameter})" for each in self.shown if not each.is_shown]
        if not hidden:
            return (size,)
        return (
            f"The heights do not show {', '.join(hidden)}: their numbers are the drawing's within "
            "its tolerances, or go with others.",
            size,
        )


def heights_of(found: Found) -> Heights | None:
    """What the heights show; None if a robot that never turns was not probed, or not identified."""
    nominal, measurements, heights = found.nominal, found.measurements, found.measurements.heights
    if (
        heights is None
        or not found.converged
        or nominal.pose_space != "translating"
        or not Seen.of(measurements).probed
        or not np.isfinite(measurements.readings).all()
    ):
        return None
    try:
        places = nominal.forward_kinematics(measurements.readings)[0]
        fitted = found.mechanism.forward_kinematics(measurements.readings)[0]
    except SymkinError:
        return None
    touched = np.isfinite(places + fitted).all(axis=1) & np.isfinite(heights)
    if touched.sum() <= 3:  # as many as a plane has coefficients
        return None
    sizes = _size_effects(found, places[touched])
    if sizes is None:
        return None
    effects, untouched, span = sizes
    before, after = _prior_covariance(found), np.asarray(found.covariance)
    known = with_assumed(found.observed_covariance, found.assumed)
    along_x = effects[0]
    gain = known @ along_x / (along_x @ known @ along_x + (CALIPER / span) ** 2)
    with_length = known - np.outer(gain, along_x @ known)
    return Heights(
        before=_off_the_plane(places[touched], heights[touched]),
        fitted=_off_the_plane(fitted[touched], heights[touched]),
        after=_predicted(found),
        size_before=_rms(untouched, with_assumed(before, found.assumed)),
        size_after=_rms(effects, known),
        size_with_length=_rms(effects, with_length),
        span=span,
        shown=tuple(_shown(found, before, after)),
    )


def _predicted(found: Found) -> float:
    """How well each height is predicted by the other points, root mean square; NaN of too few.

    What it would be off by if it alone were wrong is its distance from what all others say.
    """
    rows = found.rows
    off = rows.blunder[(rows.kind == KINDS.index("heights")) & np.isfinite(rows.blunder)]
    if len(off) - found.data_rank < _LEAST_SPARE:
        return math.nan
    return float(np.sqrt(np.mean(off**2)))


def _rms(effects: Array, covariance: Array) -> float:
    return float(np.sqrt(np.mean(((effects @ covariance) * effects).sum(axis=1))))


def _off_the_plane(places: Array, heights: Array) -> float:
    """Root mean square of what a plane leaves of the heights."""
    columns = np.column_stack([np.ones(len(places)), places[:, :2]])
    wanted = places[:, 2] - heights
    left = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)))


def _prior_covariance(found: Found) -> Array:
    """What the tolerances and priors say of the unknowns; nothing of the frames."""
    own = found.own_priors
    tolerances = np.array([each.tolerance for each in found.first_unknowns])
    diagonal = np.diag(np.nan_to_num(np.where(np.isfinite(own), own, tolerances)) ** 2)
    if not len(found.relations):
        return diagonal
    # As if each of them were measured beside these, one by one.
    rows = found.relations
    across = diagonal @ rows.T
    return np.asarray(
        diagonal - across @ np.linalg.solve(rows @ across + np.eye(len(rows)), across.T)
    )


def _size_effects(found: Found, places: Array) -> tuple[Array, Array, float] | None:
    """How lengths in the plane grow with the unknowns and with what was assumed, relative to them.

    A row a direction; as estimated, where what was assumed moves the unknowns, and before. They are
    centred among the points, as long as these are wide, or as far as the robot reaches; None where
    it reaches nothing of them, as one that was identified from wrong readings.
    """
    centre = places.mean(axis=0)
    half = float(np.sqrt(np.mean(np.sum((places - centre)[:, :2] ** 2, axis=1))))
    angles = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    along = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)])
    robot = found.mechanism.replace(frames=None, curvature=None)
    alone = survey_of(found, robot, "height")
    unmoved = tuple(dataclasses.replace(each, moves=0 * each.moves) for each in found.assumed)
    surveys = [dataclasses.replace(alone, assumed=each) for each in (found.assumed, unmoved)]
    for reach in half / 2.0 ** np.arange(4):
        both = []
        for survey in surveys:
            ends = [survey.effects(centre + sign * reach * along)[0][:, :3] for sign in (-1, 1)]
            if all(len(end) == _DIRECTIONS for end in ends):
                both.append(np.einsum("nd,ndi->ni", along, ends[1] - ends[0]) / (2 * reach))
        if len(both) == len(surveys):
            return both[0], both[1], float(2 * reach)
    return None


def _shown(found: Found, before: Array, after: Array) -> list[Shown]:
    groups: dict[str, list[int]] = {}
    for column, unknown in enumerate(found.first_unknowns):
        block, _, parameter = unknown.name.partition(".")
        if block.startswith("leg") and before[column, column] > 0:
            groups.setdefault(parameter, []).append(column)
    told = []
    for parameter, columns in groups.items():
        own = [each[np.ix_(columns, columns)] for each in (after, before)]
        count = len(columns)
        common, total = (float(each.sum()) for each in own)
        apart = np.eye(count) - 1 / count
        spread, much = (float(np.trace(apart @ each)) for each in own)
        between = float(np.sqrt(spread / much)) if count > 1 else float("nan")
        told.append(Shown(parameter, float(np.sqrt(common / total)), between))
    return told


def in_words(known: float) -> str:
    """Whether something is shown, by its deviation over that of the tolerances."""
    if np.isnan(known):
        return "-"
    if known <= _SHOWN:
        return "shown"
    return "partly" if known <= _SILENT else "not shown"
