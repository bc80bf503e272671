# SPDX-License-Identifier: MIT
"""Every public callable that takes arrays, with arguments that it accepts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import symkin
import symkin.exports
import symkin.model.file_frames
from symkin import _core, acceptance
from symkin.analysis.measurable import measurable_symmetry
from symkin.analysis.observability import error_weight, expected_accuracy, mechanism_rows
from symkin.analysis.observed import Observed
from symkin.errors import NotIdentifiableError
from symkin.model.declared import declared_chain
from symkin.model.sensor_table import SensorTable
from symkin.model.settings import DrawnPoints, NoiseSettings
from symkin.model.symmetry import map_poses
from symkin.planning import travel_length
from symkin.planning.selection import LegRows

MECHANISMS = ("3RRR", "5bar", "hexapod_jugglebot")
DECLARED = Path(__file__).parents[3] / "mechanisms" / "declared" / "3RRR_four_bar.toml"


@dataclass(frozen=True)
class Call:
    """A callable, the arguments that are arrays, and how to call it with them."""

    name: str
    arrays: dict[str, np.ndarray]
    run: Callable[..., Any]
    numbers: dict[str, int] = field(default_factory=dict)  # leg indices, counts

    def __call__(self, **changes: Any) -> Any:
        return self.run(**(self.arrays | self.numbers | changes))


def calls() -> Iterator[Call]:
    """All of them, in a fixed order."""
    for name in MECHANISMS:
        mechanism = symkin.load_mechanism(name)
        poses = symkin.sample_workspace(mechanism, 24, seed=1).poses
        for call in (*_of_core(mechanism, poses), *_of_package(mechanism, poses)):
            yield Call(f"{name}: {call.name}", call.arrays, call.run, call.numbers)
    yield from _of_selection()
    yield from _of_statistics()
    yield from _of_declared_legs()


def _of_core(mechanism: symkin.Mechanism, poses: np.ndarray) -> Iterator[Call]:
    core, legs = mechanism.core, len(mechanism.legs)
    readings = mechanism.inverse_kinematics(poses)
    noise = _core.MeasurementNoise(1e-4, 1e-4, 1e-4)
    group = symkin.model.symmetry.symmetry_group(mechanism).core
    element = group.elements[-1]
    pair = _core.pair_of(group, element)
    kind = _core.RowKind.noise_aware
    leg = {"leg": 0}

    yield Call(
        "_core.Mechanism",
        {"parameters": core.parameters, "working_modes": np.array(mechanism.working_modes)},
        lambda parameters, working_modes: _core.Mechanism(
            "m",
            [mechanism.chain] * len(mechanism.legs),
            mechanism.platform,
            parameters,
            working_modes,
        ),
    )
    yield Call(
        "_core.Mechanism.with_parameters",
        {"parameters": core.parameters},
        lambda parameters: core.with_parameters(parameters).parameters,
    )
    yield Call(
        "_core.Mechanism.counted_from",
        {"home": mechanism.home},
        lambda home: core.counted_from(home).parameters,
    )
    yield Call(
        "_core.Mechanism.joint_centres",
        {"pose": poses[0]},
        lambda leg, pose: core.joint_centres(leg, pose, 0.1),
        leg,
    )
    for name in ("inverse_kinematics", "reach_margin", "pose_jacobian"):
        function = getattr(_core, name)
        yield Call(
            f"_core.{name}",
            {"poses": poses},
            lambda poses, function=function: function(core, poses),
        )
    bound = symkin.load("3RPS")
    coordinates = np.random.default_rng(5).normal((0, 0, 1.75, 0, 0, 0), 0.1, (20, 6))
    yield Call(
        "_core.on_constraint",
        {"poses": symkin.model.poses.poses_from_bounds("spatial", coordinates)},
        lambda poses: _core.on_constraint(bound.core, poses),
    )
    yield Call("Mechanism.poses_at", {"coordinates": coordinates}, bound.poses_at)
    for name in ("closure", "linearise"):
        function = getattr(_core, name)
        yield Call(
            f"_core.{name}",
            {"poses": poses, "readings": readings[:, 0]},
            lambda leg, poses, readings, function=function: function(core, leg, poses, readings),
            leg,
        )
    yield Call(
        "_core.parameter_jacobian",
        {"poses": poses},
        lambda leg, poses: _core.parameter_jacobian(core, leg, poses),
        leg,
    )
    yield Call(
        "_core.singularity_measures",
        {"poses": poses},
        lambda poses: _core.singularity_measures(core, poses, 1.0),
    )
    yield Call(
        "_core.forward_kinematics",
        {"readings": readings, "start": poses},
        lambda readings, start: _core.forward_kinematics(core, readings, start),
    )
    yield Call(
        "_core.open_coordinates",
        {"pose": mechanism.home},
        lambda pose: _core.open_coordinates(core, pose),
    )
    yield Call(
        "_core.continued",
        {"readings": readings, "home": mechanism.home, "known": poses},
        lambda readings, home, known: _core.continued(core, readings, home, known),
    )
    yield Call(
        "_core.observability_rows",
        {"poses": poses},
        lambda leg, poses: _core.observability_rows(core, leg, poses, kind, noise),
        leg,
    )
    yield Call(
        "_core.mechanism_rows",
        {"poses": poses},
        lambda poses: _core.mechanism_rows(core, poses, kind, noise),
    )
    rows = _core.observability_rows(core, 0, poses, kind, noise)
    tolerances = symkin.model.tolerances.tolerances_of(mechanism.tolerances)
    yield Call(
        "_core.analyse_observability",
        {"rows": rows, "scale": tolerances.deviations(core, 0)},
        _core.analyse_observability,
    )
    yield Call("_core.Tolerances.deviations", {}, lambda leg: tolerances.deviations(core, leg), leg)
    yield Call(
        "_core.accuracy_weights",
        {"poses": poses},
        lambda poses: _core.accuracy_weights(core, poses),
    )
    weights = _core.accuracy_weights(core, poses)
    yield Call(
        "_core.expected_accuracy",
        {"covariance": np.eye(len(weights.position))},
        lambda covariance: _core.expected_accuracy(weights, covariance),
    )
    yield Call(
        "_core.command_errors",
        {"commanded": poses},
        lambda commanded: _core.command_errors(core, core, commanded),
    )
    yield Call(
        "_core.measurement_errors",
        {"measured": poses, "readings": readings},
        lambda measured, readings: _core.measurement_errors(core, measured, readings),
    )
    yield Call(
        "_core.transform_poses",
        {"poses": poses},
        lambda poses: _core.transform_poses(group, element, core, poses),
    )
    yield Call(
        "_core.SymmetryPair.transform_poses",
        {"poses": poses},
        lambda poses: pair.transform_poses(core, poses),
    )
    yield Call(
        "_core.Isometry",
        {"linear": np.eye(3), "shift": np.zeros(3)},
        lambda linear, shift: (
            _core.SymmetryPair(_core.Isometry(linear, shift), _core.Isometry(linear, shift), False)
            .transform_poses(core, poses)
            .shape
        ),
    )
    yield Call(
        "_core.find_pairs",
        {"home": mechanism.home},
        lambda home: _core.find_pairs(core, home).continuous_base,
    )
    yield Call(
        "_core.generate_legs",
        {"parameters": core.parameters[0]},
        lambda parameters: _core.generate_legs(
            group, mechanism.chain, mechanism.platform, parameters, 1, group.elements
        ),
    )
    yield Call(
        "_core.inside_workspace",
        {"poses": poses},
        lambda poses: _core.inside_workspace(core, _options(mechanism), poses),
    )
    settings = mechanism.workspace
    assert settings is not None
    for name in ("sample_workspace", "verify_workspace_symmetry"):
        yield Call(
            f"_core.{name}",
            {
                "lower": np.array(settings.lower),
                "upper": np.array(settings.upper),
                "home": mechanism.home,
            },
            lambda name=name, count=0, **box: _in_box(name, mechanism, box, count),
            {"count": 5},
        )
    yield Call(
        "_core.simulate",
        {"poses": poses},
        lambda leg, poses, wanted: _core.simulate(
            core, core, [_core.PoseSet(leg, poses, wanted)], noise, 1
        ),
        {"leg": 0, "wanted": 12},
    )
    yield Call(
        "_core.identify",
        {"poses": poses, "readings": readings, "leg_sets": np.arange(len(poses)) % legs},
        lambda poses, readings, leg_sets: _core.identify(
            core,
            _core.MeasurementSet(poses, readings, leg_sets),
            _core.Estimator.implicit,
            _core.PoseUse.all,
            noise,
            "none",
            0.0,
            20,
        ),
    )
    yield Call(
        "_core.identify_many",
        {"poses": poses, "readings": readings, "leg_sets": np.arange(len(poses)) % legs},
        lambda poses, readings, leg_sets: _core.identify_many(
            core,
            [poses],
            [readings],
            [leg_sets],
            _core.Estimator.implicit,
            _core.PoseUse.all,
            noise,
            "none",
            0.0,
            20,
            1,
        ),
    )
    problem = _whatever_is_observed(mechanism, poses, readings)
    yield Call("_core.fit_jointly", problem, lambda **given: _fit_jointly(mechanism, given))
    around = {key: problem[key] for key in problem if key not in _OF_LAYOUT}
    yield Call(
        "_core.left_unexplained",
        around,
        lambda pose, start, **given: _core.left_unexplained(
            core, *_observed(mechanism, given), start, pose
        ),
        {"pose": 0},
    )
    for name, part in (("_core.Setup", 0), ("_core.Observations", 1)):
        yield Call(
            name,
            {key: around[key] for key in around if key != "start"},
            lambda part=part, **given: _observed(mechanism, given)[part],
        )
    yield Call(
        "_core.observed_rows",
        {key: problem[key] for key in problem if key not in ("tolerances", "relations")},
        lambda column, prior, start, **given: _core.observed_rows(
            core, *_observed(mechanism, given), column, prior, start
        ),
    )
    around["home"] = np.ravel(mechanism.home)
    yield Call(
        "_core.starting_poses",
        around,
        lambda home, **given: _core.starting_poses(core, *_observed(mechanism, given), home),
    )
    yield Call(
        "_core.with_starting_frames",
        around,
        lambda home, **given: _core.with_starting_frames(
            core, *_observed(mechanism, given), home, True, True
        ),
    )
    yield Call(
        "_core.LegRows",
        {"poses": poses},
        lambda leg, poses: _core.select_poses(
            _core.LegRows(core, leg, poses, kind, noise, [pair]), _select_ten()
        ),
        leg,
    )
    yield Call(
        "_core.LegRows of a pose that is gone",
        {"poses": poses},
        lambda leg, poses: _kept_alone(mechanism, leg, poses),
        leg,
    )


_OF_LAYOUT = ("column", "prior", "tolerances", "relations")


def _whatever_is_observed(
    mechanism: symkin.Mechanism, poses: np.ndarray, readings: np.ndarray
) -> dict[str, np.ndarray]:
    """A problem with full poses, two points and an anchor, all parameters free with priors."""
    size = mechanism.space.size
    count, dof = len(poses), mechanism.core.dof
    around = {
        "curvature": np.zeros((len(mechanism.legs), 3)),
        "base": np.zeros(3),
        "rotation": np.eye(3),
        "points": np.zeros((2, 3)),
        "anchors": np.ones((1, 3)),
        "plane": np.zeros(3),
        "readings": readings,
        "poses": poses,
        "pose_deviations": np.full((count, dof), 1e-4),
        "point_values": np.tile(poses[:, :size], 2),
        "distances": np.full((count, 1), 1.0),
        "leg_slopes": np.zeros((len(mechanism.legs), 1)),
        "base_slopes": np.zeros((1, 6)),
        "leg_covariates": np.linspace(-0.5, 0.5, count)[:, None] * np.ones(len(mechanism.legs)),
        "base_covariates": np.linspace(-0.5, 0.5, count)[:, None],
        "start": poses,
    }
    setup, _ = _observed(mechanism, around)
    names = _core.unknown_names(mechanism.core, setup)
    estimated = {
        f"leg{leg + 1}.{name}"
        for leg in range(len(mechanism.legs))
        for name in mechanism.estimated_names(leg)
    }
    free = [name in estimated for name in names]
    column = np.where(free, np.cumsum(free) - 1, -1)
    return around | {
        "column": column,
        "prior": np.full(sum(free), 1e-3),
        "tolerances": np.full(sum(free), 1e-3),
        "relations": np.full((1, sum(free)), 1e2),
    }


def _observed(
    mechanism: symkin.Mechanism, given: dict[str, Any]
) -> tuple[_core.Setup, _core.Observations]:
    def everywhere(values: Any, deviation: float = 1e-4) -> _core.Observed:
        return _core.Observed(values, np.full(np.shape(values), deviation))

    nothing = _core.Observed(np.zeros((0, 0)), np.zeros((0, 0)))
    frame = _core.Frame(given["base"], given["rotation"])
    setup = _core.Setup(
        mechanism.core,
        given["curvature"],
        frame,
        _core.Frame(np.zeros(3), np.eye(3)),
        given["points"],
        given["anchors"],
        given["plane"],
        [("drift", False)],
        given["leg_slopes"],
        ["drift"],
        given["base_slopes"],
    )
    observations = _core.Observations(
        everywhere(given["readings"]),
        _core.Observed(given["poses"], given["pose_deviations"]),
        nothing,
        everywhere(given["point_values"]),
        everywhere(given["distances"]),
        nothing,
        leg_covariates=given["leg_covariates"],
        base_covariates=given["base_covariates"],
    )
    return setup, observations


def _fit_jointly(mechanism: symkin.Mechanism, given: dict[str, Any]) -> _core.JointFit:
    return _core.fit_jointly(
        mechanism.core,
        *_observed(mechanism, given),
        given["column"],
        given["prior"],
        "none",
        0.0,
        0.0,
        20,
        False,
        given["tolerances"],
        given["start"],
        relations=given["relations"],
    )


def _options(mechanism: symkin.Mechanism) -> _core.WorkspaceOptions:
    return symkin.analysis.workspace.workspace_options(mechanism)


def _in_box(name: str, mechanism: symkin.Mechanism, box: dict[str, Any], count: int) -> Any:
    options = _options(mechanism)
    for key, value in box.items():
        setattr(options, key, value)
    if name == "sample_workspace":
        return _core.sample_workspace(mechanism.core, options, count, 1)
    group = symkin.model.symmetry.symmetry_group(mechanism).core
    elements = group.elements[-1:]
    return _core.verify_workspace_symmetry(mechanism.core, options, group, elements, count, 1)


def _select_ten() -> _core.SelectionOptions:
    options = _core.SelectionOptions()
    options.count, options.kicks, options.threads = 10, 2, 1
    return options


def _kept_alone(mechanism: symkin.Mechanism, leg: int, poses: Any) -> Any:
    """Rows that outlive the names of all that they were made of."""
    rows = LegRows(mechanism.replace(), leg, poses + 0)
    rows.core.size  # noqa: B018
    spoilt = [np.full_like(poses, 7) for _ in range(4)]
    del spoilt
    return symkin.select_poses(rows, 10, threads=1)


def _of_package(mechanism: symkin.Mechanism, poses: np.ndarray) -> Iterator[Call]:
    readings = mechanism.inverse_kinematics(poses)
    legs, p = mechanism.parameters.shape
    leg = {"leg": 0}
    yield Call(
        "Mechanism",
        {"deviations": np.ones((legs, p))},
        lambda deviations: mechanism.replace(deviations=deviations).deviations,
    )
    yield Call(
        "Mechanism.with_parameters",
        {"parameters": mechanism.parameters, "deviations": np.ones((legs, p))},
        lambda parameters, deviations: mechanism.with_parameters(parameters, deviations).parameters,
    )
    for name in ("inverse_kinematics", "pose_jacobian", "singularity_measures"):
        yield Call(f"Mechanism.{name}", {"poses": poses}, getattr(mechanism, name))
    points = DrawnPoints(base=(0.1, -0.2, 0.3)[: max(mechanism.space.size, 2)])
    drawn = mechanism.replace(points=points)
    for name in ("as_drawn", "from_drawing"):
        function = partial(getattr(symkin.model.file_frames, name), drawn)
        yield Call(name, {"poses": poses}, function)
    noise = NoiseSettings(per_metre=1e-5)
    yield Call("NoiseSettings.at", {"distances": np.ones(4)}, noise.at)
    yield Call("NoiseSettings.along_at", {"distances": np.ones(4)}, noise.along_at)
    taken = symkin.Measurements.of(poses, readings, pose_space=mechanism.pose_space)
    yield Call(
        "Measurements.numbered",
        {"numbers": np.arange(len(poses))},
        lambda numbers: taken.numbered(numbers).row_numbers,
    )
    yield Call(
        "Observed.measure",
        {"times": np.ones(len(poses))},
        lambda times: Observed(("pose",)).measure(
            symkin.Measurements.of(poses, readings, pose_space=mechanism.pose_space),
            noise,
            1,
            times,
        ),
    )
    yield Call("joint_values", {"poses": poses}, partial(symkin.exports.joint_values, mechanism))
    yield Call(
        "Mechanism.forward_kinematics",
        {"readings": readings, "start": poses},
        mechanism.forward_kinematics,
    )
    for name in ("closure", "closure_error"):
        yield Call(
            f"Mechanism.{name}",
            {"poses": poses, "readings": readings[:, 0]},
            getattr(mechanism, name),
            leg,
        )
    bent = mechanism.replace(curvature=np.full((len(mechanism.legs), 3), 1e-3))
    yield Call("Mechanism.straightened", {"readings": readings}, bent.straightened)
    yield Call("Mechanism.curved", {"straight": readings}, bent.curved)
    yield Call(
        "Mechanism.linearised",
        {"poses": poses, "readings": readings[:, 0]},
        bent.linearised,
        leg,
    )
    yield Call("Mechanism.within_limits", {"readings": readings}, bent.within_limits)
    yield Call(
        "align_frames",
        {"measured": poses, "robot": poses},
        lambda measured, robot: symkin.align_frames(measured, robot, convention="as measured"),
    )
    yield Call("Mechanism.parameter_jacobian", {"poses": poses}, mechanism.parameter_jacobian, leg)
    for name in ("analyse_observability", "observability_rows"):
        function = getattr(symkin.analysis.observability, name)
        yield Call(
            name,
            {"poses": poses},
            lambda leg, poses, function=function: function(mechanism, leg, poses, "noise_aware"),
            leg,
        )
    yield Call("LegRows", {"poses": poses}, lambda leg, poses: LegRows(mechanism, leg, poses), leg)
    of_poses = {
        "error_weight": error_weight,
        "mechanism_rows": mechanism_rows,
        "travel_length": travel_length,
    }
    for name, function in of_poses.items():
        yield Call(
            name, {"poses": poses}, lambda poses, function=function: function(mechanism, poses)
        )
    yield Call(
        "expected_accuracy",
        {"poses": poses, "covariance": np.eye(legs * p)},
        lambda poses, covariance: expected_accuracy(mechanism, poses, covariance),
    )
    yield Call(
        "limits_of_rms",
        {"errors": 1e-4 * poses},
        lambda errors: acceptance.limits_of_rms(errors, 1e-4, 1e-3),
    )
    yield Call(
        "pose_accuracy",
        {"errors": 1e-4 * poses},
        lambda errors: acceptance.pose_accuracy(errors, 2),
    )
    yield Call(
        "visits_of", {"commanded": poses}, lambda commanded: acceptance.visits_of(commanded, 1e-3)
    )
    yield Call(
        "measurable_symmetry", {"poses": poses}, lambda poses: measurable_symmetry(mechanism, poses)
    )
    yield Call("map_poses", {"poses": poses}, lambda poses: map_poses(mechanism, "r0", poses))
    yield Call(
        "evaluate",
        {"poses": poses},
        lambda poses: symkin.evaluate(mechanism, actual=mechanism, poses=poses),
    )
    measured = {"poses": poses, "readings": readings, "leg_sets": np.arange(len(poses)) % legs}
    yield Call(
        "Measurements",
        measured | {"row_numbers": np.arange(len(poses))},
        lambda **given: symkin.identify(mechanism, symkin.Measurements(**given)),
    )
    yield Call(
        "Measurements.of",
        measured,
        lambda **given: symkin.evaluate(mechanism, measurements=symkin.Measurements.of(**given)),
    )
    whole = symkin.Measurements.of(**measured)
    yield Call("Measurements.subset", {"rows": np.arange(10)}, whole.subset)
    slopes = {
        "leg_covariates": np.ones((len(poses), 2 * legs)),
        "base_covariates": np.ones((len(poses), 1)),
    }
    yield Call("Measurements.observations", slopes, partial(whole.observations, mechanism.noise))
    yield Call(
        "make_plan",
        {"candidates": poses, "required": poses[:2]},
        lambda candidates, required: symkin.make_plan(
            mechanism, candidates, 12, required=required, margin_sigmas=0.0, threads=1, spares=0
        ),
    )
    yield Call(
        "pose_count_curve",
        {
            "candidates": symkin.sample_workspace(mechanism, 100, seed=2).poses,
            "counts": np.array([9, 10]),
        },
        lambda candidates, counts: symkin.pose_count_curve(mechanism, candidates, counts),
    )
    plan = {
        "leg_sets": np.full(len(poses), -1),
        "order": np.arange(len(poses)),
        "spare": np.zeros(len(poses), dtype=bool),
        "poses": poses,
        "readings": readings,
    }
    yield Call(
        "Plan", plan, lambda **given: symkin.simulate(mechanism, symkin.Plan(mechanism, **given), 1)
    )
    made = symkin.Plan(mechanism, **plan)
    yield Call(
        "predict_accuracy",
        {"workspace": poses},
        lambda workspace: symkin.predict_accuracy(mechanism, made, workspace),
    )

    yield from _of_further(mechanism, poses)


def _of_further(mechanism: symkin.Mechanism, poses: np.ndarray) -> Iterator[Call]:
    """What is offered to those who build upon symkin."""
    readings = mechanism.inverse_kinematics(poses)
    span = (float(readings.min()) - 1, float(readings.max()) + 1)
    table = SensorTable(((*((each, each**3) for each in span), (0.1, 0.001)),))
    for name in ("straight", "shown", "slope"):
        yield Call(
            f"SensorTable.{name}",
            {"shown": readings},
            lambda shown, name=name: getattr(table, name)(shown),
        )
    yield Call("pose_rows", {"poses": poses}, symkin.model.poses.pose_rows)
    for name in ("closure_deviation", "inside_box", "inside_workspace", "workspace_coordinates"):
        function = getattr(symkin.analysis.workspace, name)
        yield Call(name, {"poses": poses}, partial(function, mechanism))
    yield Call("wrong_quaternion", {"poses": poses}, symkin.model.poses.wrong_quaternion)
    bounds = symkin.analysis.workspace.workspace_coordinates(mechanism, poses)
    yield Call(
        "poses_from_bounds",
        {"values": bounds},
        partial(symkin.model.poses.poses_from_bounds, mechanism.pose_space),
    )
    vectors = np.random.default_rng(4).normal(size=(20, 3))
    rotations = symkin.model.poses.rotations_from_vectors(vectors)
    of_poses = {
        "cross_matrices": vectors,
        "rotations_from_vectors": vectors,
        "quaternions_from_rotation_vectors": vectors,
        "vectors_from_rotations": rotations,
        "rotations_from_quaternions": symkin.model.poses.quaternions_from_rotation_vectors(vectors),
        "vectors_from_quaternions": symkin.model.poses.quaternions_from_rotation_vectors(vectors),
    }
    for name, array in of_poses.items():
        function = getattr(symkin.model.poses, name)
        yield Call(name, {"array": array}, lambda array, function=function: function(array))
    other = symkin.model.poses.Transform(rotations, vectors)

    def product(rotation: Any, translation: Any) -> list[np.ndarray]:
        # In another memory order a product is summed in another one.
        return [
            np.round(each, 9)
            for each in symkin.model.poses.Transform(rotation, translation) @ other
        ]

    yield Call("Transform", {"rotation": rotations, "translation": vectors}, product)
    directions = np.eye(4)[:, :2]

    def combined(directions: Any, scale: Any) -> str:
        error = NotIdentifiableError("nothing shows them")
        error.null_directions = directions
        names = tuple(f"p{index}" for index in range(len(directions)))
        return str(symkin.analysis.observability.with_combinations(error, names, scale))

    yield Call("with_combinations", {"directions": directions, "scale": np.ones(4)}, combined)


def _of_statistics() -> Iterator[Call]:
    random = np.random.default_rng(3)
    effects, half = random.normal(size=(12, 4)), random.normal(size=(4, 4))
    covariance = half @ half.T / 10
    form = _core.QuadraticForm(np.array([2.0, 1.0, 0.5]))
    yield Call(
        "_core.QuadraticForm",
        {"weights": np.array([2.0, 1.0, 0.5]), "degrees": np.array([1.0, 3.0, 2.0])},
        lambda weights, degrees: _core.QuadraticForm(weights, degrees).mean,
    )
    yield Call("_core.csv_cells", {"values": np.array([0.1, -1e300, 0.0])}, _core.csv_cells)
    yield Call("_core.QuadraticForm.tail", {"values": np.array([0.1, 1.0, 9.0])}, form.tail)
    yield Call(
        "_core.QuadraticForm.of",
        {"mean_square": effects.T @ effects, "covariance": covariance},
        lambda mean_square, covariance: _core.QuadraticForm.of(mean_square, covariance).mean,
    )
    yield Call(
        "_core.mixed_quantile",
        {"mean_square": effects.T @ effects, "covariances": np.tile(covariance, (3, 1))},
        lambda mean_square, covariances: _core.mixed_quantile(mean_square, covariances, 0.95),
    )
    yield Call(
        "_core.largest_errors",
        {"effects": effects, "covariances": covariance},
        lambda effects, covariances: _core.largest_errors(
            effects, 6, 2, covariances, 0.95, draws=50
        ),
    )
    yield Call(
        "_core.drawing_conflict",
        {"change": random.normal(size=4), "covariance": covariance, "deviations": np.full(4, 2.0)},
        lambda change, covariance, deviations: (
            _core.drawing_conflict(change, covariance, deviations).q
        ),
    )
    yield Call(
        "_core.fleet_tolerances",
        {"information": np.tile(np.eye(3), (5, 1)), "scores": random.normal(size=(5, 3))},
        lambda information, scores: _core.fleet_tolerances(information, scores, [0, 1, 1]).factors,
    )


def _of_declared_legs() -> Iterator[Call]:
    """A leg with a crank, declared joint by joint, told anew with wrong numbers."""
    chain = declared_chain(symkin.load_mechanism(DECLARED).chains[0])
    assert chain is not None
    yield Call(
        "_core.Declaration",
        {"pose": np.array(chain.home_pose), "joints": np.array(chain.home_joints)},
        lambda pose, joints: _core.redundant_scalars(
            [
                replace(
                    chain, home_pose=np.ravel(pose).tolist(), home_joints=np.ravel(joints).tolist()
                ).core()
            ]
        ),
    )
    yield Call(
        "_core.joints_at",
        {
            "parameters": np.array([*(chain.nominal[scalar[0]] for scalar in chain.scalars), 1.0]),
            "poses": np.array([np.array(chain.home_pose) + off for off in (0.0, 0.01)]),
        },
        lambda **arrays: _core.joints_at(chain.core(), **arrays),
    )


def _of_selection() -> Iterator[Call]:
    rows = np.random.default_rng(3).normal(size=(40, 5))
    options = {
        "forbidden": np.arange(40) % 7 == 3,
        "required": np.array([1, 2]),
        "prior": np.eye(5),
        "coordinates": rows[:, :2] + 0,
        "scale": np.full(5, 0.5),
        "error_weight": np.eye(5),
    }
    for method, criterion in (
        ("exchange", "O1"),
        ("exchange", "O3"),
        ("exchange", "expected_error"),
        ("sun_hollerbach", "O1"),
        ("exhaustive", "O1"),
        ("random", "O2"),
        ("all", "O1"),
    ):
        distance = 0.0 if method in ("exhaustive", "all") else 0.01
        own = options if distance else options | {"coordinates": None}
        settings = {"method": method, "criterion": criterion, "minimum_distance": distance}
        yield Call(
            f"select_poses by {method} and {criterion}",
            {"rows": rows} | {key: value for key, value in own.items() if value is not None},
            lambda settings=settings, count=0, spares=0, **arrays: symkin.select_poses(
                **arrays,
                count=count,
                spares=spares,
                **settings,
                time_limit=0.2,
                threads=1,
            ),
            {"count": 7, "spares": 2},
        )
    yield Call(
        "select_poses of orbits",
        {"rows": rows.reshape(20, 2, 5)},
        lambda rows: symkin.select_poses(rows, 6, threads=1),
    )
    yield Call(
        "_core.select_poses",
        {"rows": rows, "prior": np.eye(5), "error_weight": np.eye(5), "column_scale": np.ones(5)},
        _select_in_core,
        {"rows_per_pose": 1},
    )


def _select_in_core(rows: Any, rows_per_pose: int, **arrays: Any) -> Any:
    options = _select_ten()
    options.criterion = _core.Criterion.expected_error
    for key, value in arrays.items():
        before = getattr(options, key)
        setattr(options, key, value)
        before.sum()  # not a view of what is no more
    return _core.select_poses(rows, rows_per_pose, options)
