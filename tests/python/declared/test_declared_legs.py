# SPDX-License-Identifier: MIT
"""Legs that a file declares joint by joint: read, checked, identified, written back."""

from __future__ import annotations

import dataclasses
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.errors import MechanismFileError
from symkin.model.symmetry import verify_declared
from symkin.planning.simulation import disturb
from symkin.show.mechanism import held_parameters

FOLDER = Path(__file__).parents[3] / "mechanisms" / "declared"
SHOWN = {  # by the reference of declared legs; and the sensor's gain and offset
    "3UPU": "base_x base_y base_z base_ry base_rz foot_rx foot_rz",
    "orthoglide": "base_y base_z base_ry base_rz rod_x end_x",
    "orthoglide_rods": "base_z base_ry base_rz left_at_y left_end_x left_end_z left_length "
    "right_at_y right_length",
    "tripteron": "base_ry base_rz proximal_ry proximal_rz",
    # Of the four-bar crank the reference shows four numbers more, which the file calls exact.
    "3RRR_four_bar": "base_x base_y proximal_x distal_x platform_x platform_y",
    "gough_imperfect": "base_x base_y base_z cross_z platform_x platform_y platform_z",
    "h4": "base_x base_y base_z base_rx base_rz crank_x rod_x bar_x bar_y bar_rx bar_ry",
    "cables4": "cable_at_x cable_at_y cable_at_z cable_end_x cable_end_y cable_end_z",
}
PLANAR = """\
schema = 1
name = "declared"
chain = "rrr"

[chains.rrr]
path = [
  { name = "base", azimuth = "210 deg", x = "6 m / sqrt(3)" },
  "q: [R]",
  { name = "proximal", x = "1.5 m" },
  "elbow: R",
  { name = "distal", x = "1.5 m" },
  "R",
  { name = "platform", azimuth = "210 deg", x = "1.5 m / sqrt(3)" },
]
home = { q = "150 deg", elbow = "60 deg" }

[symmetry]
group = "C3"
legs = 3

[workspace]
x = ["-0.3 m", "0.3 m"]
y = ["-0.3 m", "0.3 m"]
phi = ["-0.3 rad", "0.3 rad"]
home = ["0 m", "0 m", 0]

[noise]
position = "0.1 mm"
orientation = 1e-4
"""


@pytest.fixture
def planar(tmp_path: Path) -> symkin.Mechanism:
    path = tmp_path / "declared.toml"
    path.write_text(PLANAR)
    return symkin.load_mechanism(path)


def refused(tmp_path: Path, old: str, new: str) -> MechanismFileError:
    assert old in PLANAR
    path = tmp_path / "wrong.toml"
    path.write_text(PLANAR.replace(old, new, 1))
    with pytest.raises(MechanismFileError) as caught:
        symkin.load_mechanism(path)
    return caught.value


@pytest.mark.parametrize("name", sorted(SHOWN))
def test_the_examples_show_what_the_reference_says(name: str) -> None:
    mechanism = symkin.load_mechanism(FOLDER / f"{name}.toml")
    assert mechanism.name == name
    expected = {*SHOWN[name].split(), "sensor_gain", "sensor_offset"}
    for leg in range(len(mechanism.legs)):
        assert set(mechanism.estimated_names(leg)) == expected
    if mechanism.symmetry is not None:
        verify_declared(mechanism)


def test_a_known_chain_written_joint_by_joint_is_the_same_robot(
    planar: symkin.Mechanism, paper: symkin.Mechanism
) -> None:
    # The known chain counts the first link from the x axis, the declared one from its base.
    known = paper.replace(noise=planar.noise)
    lengths = ("proximal_length", "distal_length", "base_radius", "platform_radius")
    own = ("proximal_x", "distal_x", "base_x", "platform_x")
    drawn = disturb(known, seed=3)
    legs = [dataclasses.replace(leg, working_mode=1) for leg in drawn.legs]
    robot = drawn.replace(legs=legs, symmetry=None)
    parameters = planar.parameters.copy()
    for theirs, mine in zip(lengths, own, strict=True):
        parameters[:, planar.parameter_names.index(mine)] = robot.parameters[
            :, robot.parameter_names.index(theirs)
        ]
    angles = {end: robot.parameter_names.index(f"{end}_angle") for end in ("base", "platform")}
    for end, column in angles.items():
        azimuth = planar.parameter_names.index(f"{end}_azimuth")
        parameters[:, azimuth] = robot.parameters[:, column]
    gain, offset = (robot.parameter_names.index(f"sensor_{each}") for each in ("gain", "offset"))
    parameters[:, -2] = robot.parameters[:, gain]
    parameters[:, -1] = robot.parameters[:, offset] - robot.parameters[:, angles["base"]]
    declared = planar.with_parameters(parameters)
    poses = symkin.sample_workspace(planar, 200).poses
    found, expected = declared.inverse_kinematics(poses), robot.inverse_kinematics(poses)
    turns = (found - expected) * robot.parameters[:, gain] / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    back, there = declared.forward_kinematics(found)
    expected_back, expected_there = robot.forward_kinematics(expected)
    np.testing.assert_array_equal(there, expected_there)
    np.testing.assert_allclose(back, expected_back, atol=1e-9)
    assert there.mean() > 0.9


@pytest.mark.parametrize("name", sorted(SHOWN))
def test_estimates_scatter_as_they_say(name: str) -> None:
    mechanism = symkin.load_mechanism(FOLDER / f"{name}.toml")
    plan = symkin.plan(mechanism, 24, candidates=300)
    shown = mechanism.is_estimated
    chi_square = 0.0
    robots = 6
    for seed in range(robots):
        drawn = disturb(mechanism, seed=seed).parameters
        actual = mechanism.with_parameters(np.where(shown, drawn, mechanism.parameters))
        measured = symkin.simulate(mechanism, plan, seed, actual=actual).measurements
        estimate = symkin.identify(mechanism, measured, "joint")
        assert estimate.converged
        errors = (estimate.mechanism.parameters - actual.parameters)[shown]
        scales = np.sqrt(np.diag(estimate.covariance))
        assert len(scales) == len(errors)
        correlation = estimate.covariance / np.outer(scales, scales)
        standard = errors / scales
        chi_square += float(standard @ np.linalg.solve(correlation, standard))
    per_unknown = chi_square / (robots * np.count_nonzero(shown))
    assert 0.75 < per_unknown < 1.3


@pytest.mark.parametrize(
    "name",
    [
        "quattro.toml",
        "cables8_pulleys.toml",
        "2rps_ups.toml",
        "../2RRR_PRP.toml",
    ],
)
def test_forward_kinematics_of_a_row_depends_on_no_other(name: str) -> None:
    """Rows are solved side by side: more than fit, and some that no pose has."""
    robot = symkin.load_mechanism(FOLDER / name)
    poses = symkin.sample_workspace(robot, 100, seed=1).poses[:19]
    readings = robot.inverse_kinematics(poses)
    readings[::6] += np.random.default_rng(1).normal(0, 0.5, readings[::6].shape)
    start = np.repeat(robot.home[None], len(poses), axis=0)
    together, reached = robot.forward_kinematics(readings, start)
    alone = [robot.forward_kinematics(readings[[i]], start[[i]]) for i in range(len(poses))]
    np.testing.assert_array_equal(together, np.concatenate([each for each, _ in alone]))
    np.testing.assert_array_equal(reached, np.concatenate([each for _, each in alone]))
    sound = np.arange(len(poses)) % 6 > 0
    assert reached[sound].all()
    np.testing.assert_allclose(
        robot.inverse_kinematics(together[sound]), readings[sound], atol=1e-9
    )


def test_a_file_is_written_that_reads_back_to_the_same_mechanism(tmp_path: Path) -> None:
    for name in (*SHOWN, "3RRR_encoders"):
        mechanism = symkin.load_mechanism(FOLDER / f"{name}.toml")
        robot = disturb(mechanism, seed=2).replace(symmetry=None)
        for number, each in enumerate((mechanism, robot)):
            path = tmp_path / f"{name}_{number}.toml"
            symkin.save_mechanism(each, path)
            again = symkin.load_mechanism(path)
            np.testing.assert_array_equal(again.parameters, each.parameters)
            poses = symkin.sample_workspace(each, 20, seed=4).poses
            np.testing.assert_allclose(
                again.inverse_kinematics(poses), each.inverse_kinematics(poses), atol=1e-12
            )


def test_another_process_knows_what_was_declared(planar: symkin.Mechanism, tmp_path: Path) -> None:
    path = tmp_path / "robot.pickle"
    path.write_bytes(pickle.dumps(planar))
    code = (
        "import pickle, sys, pathlib\n"
        "robot = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes())\n"
        "print(float(robot.inverse_kinematics([[0.1, 0.2, 0.1]])[0, 0]).hex())\n"
    )
    printed = subprocess.run(
        [sys.executable, "-c", code, str(path)], check=True, capture_output=True, text=True
    ).stdout
    assert float.fromhex(printed) == planar.inverse_kinematics([[0.1, 0.2, 0.1]])[0, 0]


def test_what_is_held_is_told_by_its_reason() -> None:
    mechanism = symkin.load_mechanism(FOLDER / "orthoglide.toml")
    text = " ".join(held_parameters(mechanism))
    assert "base_x; redundant by structure" in text
    assert "platform_x; called exact by the file" in text


def test_a_number_of_one_leg_may_differ(tmp_path: Path) -> None:
    path = tmp_path / "listed.toml"
    head, tail = PLANAR.split('[symmetry]\ngroup = "C3"\nlegs = 3\n')
    legs = "[[legs]]\n"
    for turn in (90, 330):
        legs += f'[[legs]]\nbase = {{ azimuth = "{turn} deg" }}\n'
        legs += f'platform = {{ azimuth = "{turn} deg" }}\n'
    path.write_text(head + legs + 'proximal = { x = "1.6 m" }\n' + tail)
    mechanism = symkin.load_mechanism(path)
    column = mechanism.parameter_names.index("proximal_x")
    np.testing.assert_array_equal(mechanism.parameters[:, column], [1.5, 1.5, 1.6])


@pytest.mark.parametrize(
    ("old", "new", "line", "says"),
    [
        ('"elbow: R"', '"elbow: Q"', 10, 'expected "name: [R] z"'),
        ('"q: [R]"', '"q: R"', 6, "no joint in brackets; expected one"),
        ('"elbow: R"', '"q: R"', 10, "two joints are called q"),
        ('x = "1.5 m" },\n  "elbow', 'lenght = "1.5 m" },\n  "elbow', 9, "unknown key"),
        ('x = "1.5 m" },\n  "elbow', 'x = "1.5 deg" },\n  "elbow', 9, "deg"),
        ('elbow = "60 deg"', 'elbw = "60 deg"', 15, 'did you mean "elbow"'),
        ('elbow = "60 deg"', 'elbow = "10 deg"', 15, 'others do: q = "150 deg", elbow'),
        ('"elbow: R"', '"elbow: R = -knee"', 10, "follows knee, no joint before it"),
        ('  "R",\n', "", 5, "home, nor any others"),
        (
            '["0 m", "0 m", 0]',
            '["0 m", "0 m", "0 m"]',
            5,
            "phi of the workspace's home (x, y, phi)",
        ),
        ("path = [", "pathes = []\npath = [", 6, 'did you mean "path"'),
        ('chain = "rrr"', 'chain = "rr"', 3, "chain: is 'rr'; expected rrr"),
        (
            '"elbow: R",',
            '"elbow: [R]",\n  { name = "middle", x = "1 mm" },\n  "R",',
            6,
            "reads q and elbow, but has so many joints that the others meet all equations",
        ),
        ('["0 m", "0 m", 0]', "5", 5, "home is 5; expected x, y, phi"),
        ("[workspace]", "[workspace]\nfree = 5", 22, "workspace.free: is not a list"),
        ("[workspace]", '[workspace]\nfree = ["z"]', 22, "workspace.free[1]: is 'z'; expected 'x'"),
        ("[workspace]", '[workspace]\ntilt = "9 deg"', 22, "limits how a platform tilts in space"),
        ("[workspace]", "[observation]\nmeasured = 5\n[workspace]", 22, "measured: is 5; expected"),
        (
            "[workspace]",
            '[observation]\nmeasured = "readings"\ndatum = { proximal_x = "leg 1" }\n'
            "[identification]\nfixed = 5\n[workspace]",
            25,
            "identification.fixed: is not a list",
        ),
        (
            "[workspace]",
            '[observation]\nmeasured = "readings"\ndatum = { proximal_x = "1" }\n[workspace]',
            23,
            """observation.datum.proximal_x: is '1'; expected such as "leg 1\"""",
        ),
        ("[noise]", "[noise]\nreading = {}", 28, "noise.reading: has nothing for"),
        ("[noise]", "[noise]\ntilt = 1", 28, "stands beside"),
        ('"elbow: R"', '"elbow: R = 2 q + 3 lb"', 10, 'unknown unit or function "lb"'),
        ('"elbow: R"', '"elbow: R = q", "knee: R = elbow"', 10, "follows another joint itself"),
        ('"elbow: R"', "5", 10, 'is 5; expected "name: [R] z"'),
        ('group = "C3"', 'group = "C3"\naxis = [0, 0, 0]', 19, "is [0, 0, 0]; expected an angle"),
        ('group = "C3"', 'group = "D3"\naxis = [0, 0, 1]', 18, "turns about the axis, such as"),
    ],
)
def test_what_cannot_be_a_leg_is_refused_at_its_line(
    tmp_path: Path, old: str, new: str, line: int, says: str
) -> None:
    error = refused(tmp_path, old, new)
    assert error.line == line, str(error)
    assert says in str(error)


def test_too_few_legs_are_refused(tmp_path: Path) -> None:
    assert "needs as many" in str(
        refused(tmp_path, 'group = "C3"\nlegs = 3', 'group = "C2"\nlegs = 2')
    )
