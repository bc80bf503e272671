# SPDX-License-Identifier: MIT
"""What was really measured, against explicit least squares over all parameters and poses."""

import dataclasses
import json

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.estimate.problem import KINDS
from symkin.model.poses import quaternions_from_rotation_vectors, vectors_from_rotations
from symkin.model.settings import Frames, NoiseSettings, WorkspaceSettings
from symkin.planning.simulation import disturb

PLATFORMS = {"rigid": "rigid", "point2": "point", "point3": "translating", "spatial": "rigid"}
# Of a delta whose towers stand upright from z = 0.
UPRIGHT = {"base_height": 0.0, "guide_elevation": np.pi / 2, "guide_swing": 0.0}


def numbers(values, columns):
    return np.array(
        [[np.nan] * columns if v is None else [np.nan if x is None else x for x in np.atleast_1d(v)]
         for v in values],
        dtype=float,
    )  # fmt: skip


@pytest.fixture
def case(request, shared_reference):
    text = (shared_reference / "observations.json").read_text(encoding="utf-8")
    (found,) = (each for each in json.loads(text)["cases"] if each["name"] == request.param)
    return found


def robot_of(case):
    """A robot of a chain that symkin has, with its parameters, at the first pose."""
    scalars, chain = case["scalars"], case["chain"]
    legs = len(case["measurements"]["readings"][0])
    platform = PLATFORMS[case["platform"]]
    delta = chain == "[P]US"
    names = symkin.chain_info(chain, platform).parameter_names
    made = []
    for leg in range(1, legs + 1):
        given = {
            name: scalars.get(f"{'base_angle' if delta and name == 'base_azimuth' else name}_{leg}")
            for name in names
        }
        own = {name: value for name, value in given.items() if value is not None}
        extra = {name: UPRIGHT[name] for name in names if delta and name in UPRIGHT}
        mode = case["working_modes"][leg - 1] if "working_modes" in case else -1
        made.append(symkin.Leg(chain, own | extra, mode))
    start = case["start_poses"][0]
    home = tuple(start) if isinstance(start, list) else (*start["position"], 0.0, 0.0, 0.0)
    size = len(home)
    return symkin.Mechanism(
        case["name"],
        made,
        platform=platform,
        workspace=WorkspaceSettings((-1.0,) * size, (1.0,) * size, home=home),
        noise=NoiseSettings(reading=case["measurements"]["reading_sd"]),
        frames=Frames(),
    )


def measured_of(case, robot):
    """What was measured, as symkin's measurements."""
    data, space = case["measurements"], robot.space
    readings = np.array(data["readings"])
    rows = len(readings)
    poses = np.full((rows, space.coordinates), np.nan)
    deviations = np.full((rows, space.dof), np.nan)
    given = {}
    if "position" in data:
        poses[:, : space.size] = numbers(data["position"], space.size)
        deviations[:, : space.size] = data["position_sd"]
    if "angle" in data:
        poses[:, 2] = numbers(data["angle"], 1)[:, 0]
        deviations[:, 2] = data["angle_sd"]
    if "rotation_matrix" in data:
        turned = vectors_from_rotations(np.array(data["rotation_matrix"]))
        poses[:, 3:] = quaternions_from_rotation_vectors(turned)
        deviations[:, 3:] = data["rotation_sd"]
    if np.isfinite(poses).any():
        given["pose_deviations"] = deviations
    if "plane_height" in data:
        given["heights"] = numbers(data["plane_height"], 1)[:, 0]
        given["height_deviations"] = np.full(rows, data["plane_height_sd"][0])
    if "roll_pitch_yaw" in data:
        given["attitudes"] = numbers(data["roll_pitch_yaw"], 3)
        given["attitude_deviations"] = np.tile(data["roll_pitch_yaw_sd"], (rows, 1))
    if "twist" in data:
        given["turns"] = numbers(data["twist"], 1)[:, 0]
        given["turn_deviations"] = np.full(rows, data["twist_sd"][0])
        given["turn_axes"] = np.tile(data["twist_axis"], (rows, 1))
    if "distance" in data:
        sessions = np.unique(case["session"])
        away = numbers(data["distance"], 1)
        given["distances"] = np.where(np.array(case["session"])[:, None] == sessions, away, np.nan)
        given["distance_deviations"] = np.full(given["distances"].shape, data["distance_sd"][0])
    if "velocity" in data:
        given["velocities"] = np.array(data["velocity"])
    given |= pairs_of(case, rows, space.size)
    return symkin.Measurements.of(
        poses,
        readings,
        reading_unit=robot.reading_unit,
        pose_space=robot.pose_space,
        **given,
    )


def pairs_of(case, rows, size):
    pairs = case.get("pairs", [])
    if not pairs:
        return {}
    last = [max(pair["rows"]) for pair in pairs]
    count = max(last.count(row) for row in last)
    found = {
        "partners": np.zeros((rows, count), dtype=int),
        "separations": np.full((rows, count), np.nan),
        "rises": np.full((rows, count), np.nan),
        "offsets": np.full((rows, count, size), np.nan),
    }
    kinds = {"distance": "separations", "height_difference": "rises", "same_point": "offsets"}
    sds = {name: np.full_like(found[name], np.nan) for name in kinds.values()}
    next_free = dict.fromkeys(last, 0)
    for pair in pairs:
        first, second = pair["rows"]
        assert first < second
        place = second, next_free[second]
        next_free[second] += 1
        name = kinds[pair["kind"]]
        found["partners"][place] = first + 1
        found[name][place] = pair.get("value", 0.0)
        sds[name][place] = pair["sd"]
    for name in kinds.values():
        if not np.isfinite(found[name]).any():
            found[name] = None
        else:
            found[f"{name.removesuffix('s')}_deviations"] = sds[name]
    return found


def name_of(scalar, kind=""):
    """As symkin has it, of a name in the reference."""
    first, _, session = scalar.partition("@")
    parameter, _, last = first.rpartition("_")
    if parameter in ("base_frame", "target_frame"):
        return f"{parameter.partition('_')[0]}.{last}"
    if parameter == "plane":
        return f"plane.c{last}"
    if parameter == "anchor":
        return f"anchor{session}.{last}"
    if first == "bar_length":
        return "distance1.zero"
    if first == "time_offset":
        return "clock_x.x"
    renamed = {"delta": {"base_angle": "base_azimuth"}}.get(kind, {})
    if kind == "belts" and parameter.startswith("base_"):
        parameter = f"belt_at_{parameter[-1]}"
    if kind == "cables" and parameter[:-1] in ("base_", "platform_"):
        parameter = f"cable_{'at' if parameter[0] == 'b' else 'end'}_{parameter[-1]}"
    return f"leg{last}.{renamed.get(parameter, parameter)}"


def priors_of(case, kind=""):
    return {name_of(row["terms"][0][1], kind): row["sd"] for row in case.get("priors", [])}


def compared(case, found, kind=""):
    expected = case["expected"]
    assert found.converged
    assert found.chi_square == pytest.approx(expected["chi_square"], rel=1e-8)
    assert found.degrees_of_freedom == expected["degrees_of_freedom"]
    assert (found.rank, found.data_rank) == (expected["rank"], expected["rank_of_data"])
    for scalar, value, sd in zip(case["free"], expected["estimate"], expected["sd"], strict=True):
        name = name_of(scalar, kind)
        unknown = found.params[name]
        assert unknown.value == pytest.approx(value, abs=1e-5 * sd), name
        columns, factors = map(list, zip(*unknown.moves, strict=True))
        known = found.model_covariance[np.ix_(columns, columns)]
        assert factors @ known @ factors == pytest.approx(sd**2, rel=2e-6), name


@pytest.mark.parametrize(
    "case", ["delta_heights_and_distances", "delta_chain_of_differences"], indirect=True
)
def test_distances_and_differences_of_height_of_a_delta_are_as_by_least_squares(case):
    robot = robot_of(case)
    found = symkin.identify(
        robot,
        measured_of(case, robot),
        free=["base_radius", "base_azimuth", "distal_length", "sensor_offset"],
        frames=["plane"] if "plane_0" in case["free"] else [],
        prior=priors_of(case, "delta"),
    )
    compared(case, found, "delta")


@pytest.mark.parametrize("case", ["planar_same_point_twice"], indirect=True)
def test_a_point_touched_twice_is_as_by_least_squares(case):
    robot = robot_of(case)
    target = [case["scalars"][f"target_frame_{axis}"] for axis in ("x", "y", "phi")]
    robot = robot.replace(frames=Frames(target=tuple(target)))
    found = symkin.identify(
        robot,
        measured_of(case, robot),
        frames=["target"],
        fixed=["sensor_gain", "target.phi"],
        prior=priors_of(case),
    )
    compared(case, found)


@pytest.mark.parametrize("case", ["planar_ties_with_priors"], indirect=True)
def test_ties_of_parameters_with_priors_are_as_by_least_squares(case):
    robot = robot_of(case)
    ties = [tie_of(tie) for tie in case["ties"]]
    given = {}
    for row in case["priors"]:
        (_, first), *more = row["terms"]
        if more:
            ties.append(f"{name_of(first)} = {name_of(more[0][1])} within {row['sd']} m")
        else:
            given[name_of(first)] = row["sd"]
    found = symkin.identify(
        robot, measured_of(case, robot), fixed=["sensor_gain"], tie=ties, prior=given
    )
    compared(case, found)


def tie_of(tie):
    """As symkin has it: the last named parameter follows the others, which keep their priors."""
    words = tie["text"].split()
    words = [name_of(each) if "_" in each else each for each in words]
    return " ".join(words if "+" in words else reversed(words))


@pytest.mark.parametrize("case", ["planar_ball_bar"], indirect=True)
def test_a_ball_bar_about_unknown_centres_is_as_by_least_squares(case):
    scalars = case["scalars"]
    robot = robot_of(case).replace(
        frames=Frames(
            target=tuple(scalars[f"target_frame_{axis}"] for axis in ("x", "y", "phi")),
            anchors=tuple((scalars[f"anchor_x@{k}"], scalars[f"anchor_y@{k}"]) for k in (1, 2)),
        )
    )
    found = symkin.identify(
        robot,
        measured_of(case, robot),
        free=["leg?", "distance?.zero"],
        shared=["distance?.zero"],
        frames=["target", "anchors"],
        fixed=["sensor_gain", "target.phi"],
        prior=priors_of(case),
    )
    compared(case, found)


@pytest.mark.parametrize("case", ["hexapod_rotation_about_a_known_axis"], indirect=True)
def test_a_turn_about_a_known_axis_is_as_by_least_squares(case):
    robot = robot_of(case)
    found = symkin.identify(
        robot, measured_of(case, robot), fixed=["sensor_gain"], prior=priors_of(case)
    )
    compared(case, found)


@pytest.mark.parametrize("case", ["five_bar_time_offset"], indirect=True)
def test_a_clock_that_is_off_is_as_by_least_squares(case):
    robot = robot_of(case).replace(
        frames=Frames(base=tuple(case["scalars"][f"base_frame_{x}"] for x in ("x", "y", "phi")))
    )
    found = symkin.identify(
        robot,
        measured_of(case, robot),
        free=["*_length", "sensor_offset"],
        frames=["base"],
        clock_offset=True,
    )
    compared(case, found)


BELTS = """
schema = 1
name = "belts"
chain = "belt"
platform = "translating"

[chains.belt]
rods = [
  { name = "belt", from = "base", at = { x = 0, y = 0, z = 0 }, to = "platform", length = "[q]" },
]

[workspace]
x = [-1, 1]
y = [-0.6, 0.6]
z = [-0.01, 0.01]
home = [0, 0, 0]

[noise]
position = "0.3 mm"
reading = "0.5 mm"
"""


@pytest.mark.parametrize("case", ["belts_in_a_plane"], indirect=True)
def test_belts_whose_point_is_held_in_a_plane_are_as_by_least_squares(case, tmp_path):
    file, scalars = tmp_path / "belts.toml", case["scalars"]
    legs = [
        "[[legs]]\nbelt_at = {{ x = {}, y = {}, z = {} }}\n".format(
            *(scalars[f"base_{axis}_{leg}"] for axis in "xyz")
        )
        for leg in range(1, 5)
    ]
    file.write_text(BELTS + "".join(legs))
    robot = symkin.load_mechanism(file)
    found = symkin.identify(
        robot,
        measured_of(case, robot),
        fixed=["sensor_gain"],
        frames=[],
        prior=priors_of(case, "belts"),
    )
    compared(case, found, "belts")


CABLES = """
schema = 1
name = "cables"
chain = "cable"

[[chains.cable.rods]]
name = "cable"
from = "base"
at = { x = 0, y = 0, z = 0 }
to = "platform"
end = { x = 0, y = 0, z = 0 }
length = "[q]"

[workspace]
x = [-1, 1]
y = [-1, 1]
z = [0.5, 1.5]
tilt = 0.3
home = [0, 0, 1, 0, 0, 0]

[noise]
position = "2 mm"
orientation = "1 mrad"
reading = "1 mm"
"""


@pytest.mark.parametrize("case", ["four_cables_attitude"], indirect=True)
def test_four_cables_with_attitudes_are_as_by_least_squares_from_wherever_they_start(
    case, tmp_path
):
    file, scalars = tmp_path / "cables.toml", case["scalars"]
    ends = {"base": "at", "platform": "end"}
    legs = [
        "[[legs]]\n"
        + "".join(
            f"cable_{own} = {{ "
            + ", ".join(f"{axis} = {scalars[f'{end}_{axis}_{leg}']}" for axis in "xyz")
            + " }\n"
            for end, own in ends.items()
        )
        for leg in range(1, 5)
    ]
    file.write_text(CABLES + "".join(legs))
    robot = symkin.load_mechanism(file)
    start = [each["position"] for each in case["start_poses"]]
    turns = vectors_from_rotations(np.array([e["rotation_matrix"] for e in case["start_poses"]]))
    start = np.column_stack([start, quaternions_from_rotation_vectors(turns)])
    measured = measured_of(case, robot)
    random = np.random.default_rng(1)
    for off in (0.0, 0.05):
        there = start + np.pad(random.normal(0, off, (len(start), 3)), ((0, 0), (0, 4)))
        found = symkin.identify(
            robot,
            dataclasses.replace(measured, commanded=there),
            free=["cable_at_?", "cable_end_?", "sensor_offset", "target.r?"],
            prior=priors_of(case, "cables"),
        )
        compared(case, found, "cables")


def test_a_wrong_distance_between_rows_is_named_and_its_pair_is_left_out_together():
    robot = symkin.load_mechanism("linear_delta")
    poses = symkin.sample_workspace(robot, 30, seed=1).poses
    exact = symkin.Measurements.of(
        poses,
        disturb(robot, 1).inverse_kinematics(poses),
        reading_unit="m",
        pose_space="translating",
    )
    taken = Observed(("height", "separation")).measure(exact, robot.noise, 1)
    assert symkin.cross_validate(robot, taken, 5).observed_rms["separations_m"] < 2e-4
    wrong = np.array(taken.separations)
    wrong[7, 0] += 2e-3
    found = symkin.identify(robot, dataclasses.replace(taken, separations=wrong))
    assert not found.trustworthy
    rows = found.rows
    worst = int(np.nanargmax(np.abs(np.where(rows.kind == KINDS.index("separations"), rows.t, 0))))
    assert (rows.pose[worst], abs(rows.blunder[worst])) == (7, pytest.approx(2e-3, rel=0.3))
    assert rows.what(worst, "translating") == "distance from the other row of pair 1"


def test_many_heights_above_one_row_are_as_heights_above_a_reference_that_is_exact():
    robot, rows = symkin.load_mechanism("linear_delta"), 41
    random = np.random.default_rng(1)
    poses = symkin.sample_workspace(robot, rows, seed=2).poses
    noise = robot.noise
    readings = disturb(robot, 2).inverse_kinematics(poses)
    readings += random.normal(0, noise.reading, readings.shape)
    above = poses[:, 2] - poses[0, 2] + random.normal(0, noise.position, rows)
    above[0] = 0.0
    nothing, some = np.full_like(poses, np.nan), np.arange(rows) > 0
    of = {"reading_unit": "m", "pose_space": "translating"}
    hub = symkin.Measurements.of(
        nothing,
        readings,
        **of,
        partners=some[:, None].astype(int),
        rises=np.where(some, above, np.nan)[:, None],
    )
    deviations = np.where(some, noise.position, 0.0)
    against = symkin.Measurements.of(
        nothing, readings, **of, heights=above, height_deviations=deviations
    )
    block = symkin.identify(robot, hub, free=["leg?"], prior="tolerances")
    row = symkin.identify(robot, against, free=["leg?", "plane.c0"], prior="tolerances")
    assert block.degrees_of_freedom == row.degrees_of_freedom == rows - 1
    assert block.chi_square == pytest.approx(row.chi_square, rel=1e-8)
    by = np.nan_to_num(block.mechanism.deviations, nan=1.0)
    off = (block.mechanism.parameters - row.mechanism.parameters) / np.where(by > 0, by, 1.0)
    assert np.abs(off).max() < 1e-6
