# SPDX-License-Identifier: MIT
"""Platforms on fewer legs than they have freedoms: what readings leave to gravity is named."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.checks import check_mechanism
from symkin.errors import MeasurementError, NotIdentifiableError, SymkinError
from symkin.present import page_of

FILE = Path(__file__).parents[3] / "mechanisms" / "declared" / "cables4.toml"
NAMED = "4 of the platform's 6 coordinates, gravity decides the rest: measure rx, ry as well"


@pytest.fixture(scope="module")
def robot() -> symkin.Mechanism:
    return symkin.load_mechanism(FILE)


@pytest.fixture(scope="module")
def plan(robot: symkin.Mechanism) -> symkin.Plan:
    return symkin.plan(robot, 12, candidates=200)


def test_what_is_left_open_determines_the_pose_with_the_readings(robot: symkin.Mechanism) -> None:
    assert robot.open_coordinates == ("rx", "ry")
    assert symkin.load_mechanism("lsst_camera_hexapod").open_coordinates == ()
    rows = np.vstack([robot.pose_jacobian(robot.home)[0], np.eye(6)[3:5]])
    assert np.linalg.matrix_rank(rows, tol=1e-6) == 6


def test_plan_check_and_prediction_name_it(robot: symkin.Mechanism, plan: symkin.Plan) -> None:
    assert plan.expected is None
    for result in (plan, check_mechanism(robot)):
        assert NAMED in " ".join(page_of(result).notes)
    sample = symkin.sample_workspace(robot, 50)
    for predict in (
        lambda: symkin.pose_count_curve(robot, sample, [12]),
        lambda: symkin.predict_accuracy(robot, plan, sample),
    ):
        with pytest.raises(SymkinError, match=r"4 of the platform's 6 .* measure rx, ry"):
            predict()


def test_positions_identify_what_they_show_and_the_estimate_names_the_rest(
    robot: symkin.Mechanism, plan: symkin.Plan, tmp_path: Path
) -> None:
    measured = symkin.simulate(robot, plan, 1, observe="position").measurements
    path = tmp_path / "measurements.csv"
    dataclasses.replace(measured, commanded=None).save(path, robot)
    found = symkin.identify(robot, symkin.read_measurements(path, robot), prior="tolerances")
    notes = {each.code: str(each) for each in found.notes}
    assert NAMED in notes["left-to-gravity"]
    assert found.expected is None
    # As the reference of declared legs says of positions alone.
    with pytest.raises(NotIdentifiableError, match="29 independent combinations of the 32"):
        symkin.plan(robot, 40, candidates=200, observe="position")


def test_readings_alone_are_refused(
    robot: symkin.Mechanism, plan: symkin.Plan, tmp_path: Path
) -> None:
    path = tmp_path / "measurements.csv"
    symkin.simulate(robot, plan, 1, observe="readings").measurements.save(path, robot)
    with pytest.raises(MeasurementError, match="they leave rx, ry to gravity"):
        symkin.read_measurements(path, robot)


def test_readings_with_tilts_are_as_many_as_the_platform_moves_and_say_nothing(
    robot: symkin.Mechanism, plan: symkin.Plan
) -> None:
    measured = symkin.simulate(robot, plan, 1, observe="tilt").measurements
    for nothing in (
        lambda: symkin.identify(robot, measured, prior="tolerances"),
        lambda: symkin.plan(robot, 12, candidates=200, observe="tilt", prior="tolerances"),
    ):
        with pytest.raises(NotIdentifiableError, match="some pose explains any"):
            nothing()


def test_a_leg_may_give_its_rod_as_it_is_declared(robot: symkin.Mechanism, tmp_path: Path) -> None:
    kept, _ = FILE.read_text().split("[symmetry]")
    rest = FILE.read_text()[FILE.read_text().index("[workspace]") :]
    made = []
    for form in (
        "cable = {{ at = {{ x = {}, y = {}, z = {} }}, end = {{ x = {}, y = {}, z = {} }} }}",
        "cable_at = {{ x = {}, y = {}, z = {} }}\ncable_end = {{ x = {}, y = {}, z = {} }}",
    ):
        names = [f"cable_{end}_{axis}" for end in ("at", "end") for axis in "xyz"]
        numbers = [[leg.parameters[name] for name in names] for leg in robot.legs]
        legs = "\n".join("[[legs]]\n" + form.format(*each) for each in numbers)
        path = tmp_path / "listed.toml"
        path.write_text(kept + legs + "\n\n" + rest)
        made.append(symkin.load_mechanism(path))
    first, second = made
    np.testing.assert_array_equal(first.parameters, second.parameters)
    assert first.legs[2].parameters["cable_end_y"] == robot.legs[2].parameters["cable_end_y"]
    path.write_text(path.read_text().replace("cable_at = { x", "cable = { att = { x", 1))
    path.write_text(path.read_text().replace("}\ncable_end", "} }\ncable_end", 1))
    with pytest.raises(SymkinError, match="did you mean"):
        symkin.load_mechanism(path)


SEVEN = """schema = 1
chain = "cable"
[chains.cable]
rods = [{ name = "cable", from = "base", at = { x = 0, y = 0, z = 0 }, to = "platform", end = { x = 0, y = 0, z = 0 }, length = "[q]" }]
[workspace]
x = [-0.5, 0.5]
y = [-0.5, 0.5]
z = [0.7, 1.3]
tilt = 0.15
home = [0, 0, 1, 0, 0, 0]
conditioning_limit = 40
"""  # noqa: E501
CABLES = [
    ((2, 2, 2), (-0.12, 0.256, 0.1)),
    ((-2, 2, 2.1), (-0.256, -0.12, 0.1)),
    ((-2, -2, 2), (0.12, -0.256, 0.1)),
    ((2, -2, 1.9), (0.256, 0.12, 0.1)),
    ((2, 0, 0), (0.129, -0.153, -0.1)),
    ((-1.8, 1, 0), (-0.052, 0.217, -0.1)),
    ((-1, -1.9, 0), (-0.217, -0.052, -0.1)),
]


def test_more_cables_than_freedoms_stray_to_no_pose_that_closes_worse(tmp_path: Path) -> None:
    numbers = "x = {}, y = {}, z = {}"
    leg = f"[[legs]]\ncable = {{{{ at = {{{{ {numbers} }}}}, end = {{{{ {numbers} }}}} }}}}\n"
    path = tmp_path / "seven.toml"
    path.write_text(SEVEN + "".join(leg.format(*at, *end) for at, end in CABLES))
    robot = symkin.load_mechanism(path)
    poses = symkin.sample_workspace(robot, 600, seed=2).poses
    noise = 1e-4 * np.random.default_rng(1).normal(size=(len(poses), len(CABLES)))
    found, converged = robot.forward_kinematics(robot.inverse_kinematics(poses) + noise)
    assert converged.all()
    assert np.linalg.norm((found - poses)[:, :3], axis=1).max() < 0.01
