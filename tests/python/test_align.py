# SPDX-License-Identifier: MIT
"""Frames alone: where a device stands, and how its poses are meant."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.analysis.alignment import poses_of_columns
from symkin.analysis.observed import Observed
from symkin.cli import main
from symkin.errors import MeasurementError, SymkinError
from symkin.model.poses import frame, poses_of, transforms, vectors_from_quaternions
from symkin.planning.simulation import disturb
from symkin.storage.tables import read_table

BASE, TARGET = (1.0, -0.5, 0.3, 0.4, -1.2, 2.6), (0.05, 0.02, -0.1, 0.3, 0.1, -0.4)
DEVICE = "tracker_x_m,tracker_y_m,tracker_z_m,tracker_qx,tracker_qy,tracker_qz,tracker_qw"
ROBOT = "surge_m,sway_m,heave_m,phi_rad,theta_rad,psi_rad"


@pytest.fixture(scope="module")
def robot():
    random = np.random.default_rng(1)
    tangents = random.uniform(-0.4, 0.4, (40, 6))
    return poses(tangents)


@pytest.fixture
def laboratory(hexapod_table):
    path = hexapod_table.parents[1] / "motion_lab" / "at960_em8000.csv"
    if not path.exists():
        pytest.skip("the measured poses of the motion laboratory are not at hand")
    return path


def poses(tangents):
    from symkin.model.poses import poses_from_bounds

    return poses_from_bounds("spatial", tangents)


def seen(robot, noise=1e-4):
    random = np.random.default_rng(2)
    both = (frame("spatial", values) for values in (BASE, TARGET))
    base, target = both
    true = base @ transforms("spatial", robot) @ target
    errors = random.normal(0, noise, (len(robot), 6))
    turned = transforms("spatial", poses(errors))
    return poses_of(
        "spatial",
        type(true)(turned.rotation @ true.rotation, true.translation + errors[:, :3]),
    )


def test_frames_are_found_wherever_the_device_stands(robot):
    found = symkin.align_frames(seen(robot), robot)
    assert found.trustworthy
    assert found.convention == "as measured"
    for values, true, deviations in (
        (found.frames.base, BASE, found.base_deviations),
        (found.frames.target, TARGET, found.target_deviations),
    ):
        assert np.abs((np.array(values) - true) / deviations).max() < 5


def test_a_convention_that_fits_is_named_and_doubted(robot):
    measured = transforms("spatial", seen(robot))
    turned = np.swapaxes(measured.rotation, 1, 2)
    inverse = type(measured)(turned, -np.einsum("nij,nj->ni", turned, measured.translation))
    found = symkin.align_frames(poses_of("spatial", inverse), robot)
    assert found.convention == "inverse"
    assert 'not taken as they are, but as "inverse"' in found.doubts[0]
    told = symkin.align_frames(poses_of("spatial", inverse), robot, convention="inverse")
    assert told.trustworthy


def test_a_quaternion_with_the_scalar_first_is_recognised(robot):
    measured = seen(robot)
    measured[:, 3:] = np.roll(measured[:, 3:], 1, axis=1)
    assert symkin.align_frames(measured, robot).convention == "scalar first"


def test_poses_that_do_not_turn_do_not_tell_the_frames_apart(robot):
    still = robot.copy()
    still[:, 3:] = (0, 0, 0, 1)
    found = symkin.align_frames(seen(still), still, convention="as measured")
    assert any("do not tell the base frame from the target" in each for each in found.doubts)
    assert not np.isfinite(found.base_deviations).all()


@pytest.mark.parametrize(
    ("of_device", "of_robot", "words"),
    [
        ([3, 4, 5, 6], [], "no measured pose is known in full: none has qx, qy, qz, qw;"),
        ([], [0], "no pose of the robot is known in full: none has x;"),
        ((slice(None, None, 2), 0), (slice(1, None, 2), 0), "no row has both a full measured pose"),
    ],
)
def test_what_is_missing_where_no_pose_is_full_is_said(robot, of_device, of_robot, words):
    both = np.array(robot), np.array(robot)
    for values, empty in zip(both, (of_device, of_robot), strict=True):
        values[empty if isinstance(empty, tuple) else (slice(None), empty)] = np.nan
    with pytest.raises(symkin.SymkinError, match=words):
        symkin.align_frames(*both)


def test_poses_of_unequal_shapes_are_refused(robot):
    with pytest.raises(MeasurementError, match=r"are \(40, 7\), the robot's \(39, 7\)"):
        symkin.align_frames(robot, robot[:-1])
    with pytest.raises(SymkinError, match="convention is 'upside down'"):
        symkin.align_frames(robot, robot, convention="upside down")


@pytest.mark.parametrize(("angles", "columns"), [("XYY1", 6), ("Xyz", 6), ("XYZ", 7)])
def test_angles_about_no_axes_are_refused(laboratory, angles, columns):
    names = (ROBOT if columns == 6 else DEVICE).split(",")
    with pytest.raises(MeasurementError, match="three letters"):
        poses_of_columns(read_table(laboratory), names, angles)


def test_the_motion_laboratory_is_aligned(laboratory, tmp_path, capsys):
    arguments = ["align", str(laboratory), "--device", DEVICE, "--robot", ROBOT]
    assert main([*arguments, "--angles", "XYZ", "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert 'as "inverse"' in printed
    found = symkin.read_results(tmp_path / "out" / "results.json")
    assert found["convention"] == "inverse"
    assert found["position_rms_m"] == pytest.approx(1.300e-3, abs=5e-7)
    assert np.degrees(found["orientation_rms_rad"]) == pytest.approx(0.0230, abs=5e-5)
    assert (tmp_path / "out" / "frames.toml").read_text().startswith("[frames]\nbase = [")


def test_the_forward_kinematics_of_a_mechanism_is_aligned(tmp_path, capsys):
    paper = symkin.load_mechanism("3RRR")
    observe = Observed("pose", base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17))
    plan = paper.plan(10, seed=3)
    made = symkin.simulate(paper, plan, seed=1, actual=paper, observe=observe)
    made.measurements.save(tmp_path / "tracked.csv")
    arguments = [str(tmp_path / "tracked.csv"), "--mechanism", "3RRR", "--json"]
    assert main(["align", *arguments]) == 0
    import json

    found = json.loads(capsys.readouterr().out)
    assert found["trustworthy"]
    np.testing.assert_allclose(found["frames"]["base"], observe.base, atol=5e-4)


def test_align_wants_a_mechanism_or_columns(tmp_path, capsys):
    assert main(["align", str(tmp_path / "x.csv")]) == 2
    assert "expected --mechanism, or --device and --robot" in capsys.readouterr().err


def test_align_does_not_pass_over_a_file_of_columns_in_silence(tmp_path, capsys):
    arguments = ["align", str(tmp_path / "x.csv"), "--device", "x,y,turn", "--robot", "px,py,pt"]
    assert main([*arguments, "--columns", str(tmp_path / "columns.toml")]) == 2
    assert "--columns goes with --mechanism alone" in capsys.readouterr().err


def test_the_file_of_the_mechanism_is_not_replaced_by_its_frames(tmp_path, capsys):
    robot = tmp_path / "frames.toml"
    symkin.load_mechanism("3RRR").save(robot)
    before = robot.read_bytes()
    arguments = ["align", str(tmp_path / "x.csv"), "--mechanism", str(robot)]
    assert main([*arguments, "--out", str(tmp_path), "--overwrite"]) == 2
    assert "frames.toml: is an input of this command" in capsys.readouterr().err
    assert robot.read_bytes() == before


def angles_of(rotations, order):
    """Angles about each axis as it has turned, or about fixed ones: the same, the other way."""
    if order.islower():
        return angles_of(rotations, order[::-1].upper())[:, ::-1]
    a, b, c = ("XYZ".index(letter) for letter in order)
    r = rotations
    if a != c:
        sign = 1 if (b - a) % 3 == 1 else -1
        return np.stack(
            [
                np.arctan2(-sign * r[:, b, c], r[:, c, c]),
                np.arcsin(sign * r[:, a, c]),
                np.arctan2(-sign * r[:, a, b], r[:, a, a]),
            ],
            axis=1,
        )
    d = 3 - a - b
    sign = 1 if (b - a) % 3 == 1 else -1
    return np.stack(
        [
            np.arctan2(r[:, b, a], -sign * r[:, d, a]),
            np.arccos(r[:, a, a]),
            np.arctan2(r[:, a, b], sign * r[:, a, d]),
        ],
        axis=1,
    )


WAYS = (
    *("ZYX in degrees", "xyz", "ZXZ, inverse", "xyx in degrees, conjugate"),
    "YXZ from columns 213 in degrees, inverse",
)


@pytest.mark.parametrize("way", WAYS)
def test_angles_are_recognised_by_a_few_poses_whatever_was_meant_by_them(robot, way):
    order, _, how = way.partition(" in degrees")
    order, _, end = (order + how).partition(", ")
    order, _, columns = order.partition(" from columns ")
    few = robot[:8]
    meant = transforms("spatial", seen(few))
    back = np.swapaxes(meant.rotation, 1, 2)
    position = meant.translation
    if end == "inverse":
        position = -np.einsum("nij,nj->ni", back, position)
    angles = angles_of(back if end else meant.rotation, order)
    angles = angles[:, [(columns or "123").index(column) for column in "123"]]
    if "degrees" in way:
        angles = np.degrees(angles)
    found = symkin.align_frames(np.hstack([position, angles]), few)
    assert found.convention == way
    assert f'but as "{way}"' in found.doubts[0]
    np.testing.assert_allclose(found.frames.base, BASE, atol=2e-3)


def test_columns_that_no_frames_explain_are_doubted(robot):
    device = seen(robot)
    device[:, :3] = np.roll(device[:, :3], 1, axis=0)
    found = symkin.align_frames(device, robot)
    assert found.doubts[0].startswith("no frames explain the poses")
    assert not found.trustworthy


def test_rotation_vectors_are_taken_as_they_are_where_their_tilts_are_small(robot):
    near = robot.copy()
    near[:, 3:] = [0, 0, 0, 1] + 0.02 * near[:, 3:]
    near[:, 3:] /= np.linalg.norm(near[:, 3:], axis=1)[:, None]
    vectors = vectors_from_quaternions(seen(near)[:, 3:])
    found = symkin.align_frames(np.hstack([seen(near)[:, :3], vectors]), near)
    assert found.convention == "as measured"
    assert found.trustworthy


def test_angles_in_a_table_of_the_device_are_recognised(robot, tmp_path, capsys):
    device = transforms("spatial", seen(robot[:10]))
    values = np.hstack(
        [
            device.translation,
            np.degrees(angles_of(device.rotation, "ZYX")),
            robot[:10],
        ]
    )
    names = "tx_m,ty_m,tz_m,ta_deg,tb_deg,tc_deg"
    own = "px_m,py_m,pz_m,qx,qy,qz,qw"
    header = f"{names},{own}"
    path = tmp_path / "log.csv"
    np.savetxt(path, values, delimiter=",", header=header, comments="")
    assert main(["align", str(path), "--device", names, "--robot", own]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert 'but as "ZYX"' in printed
    told = ["align", str(path), "--device", names, "--robot", own, "--convention", "ZYX"]
    assert main(told) == 0
    assert "nothing speaks against them" in " ".join(capsys.readouterr().out.split())


def test_identify_names_the_order_of_angles_that_were_taken_for_rotation_vectors():
    hexapod = symkin.load_mechanism("hexapod_jugglebot")
    noise = dataclasses.replace(hexapod.noise, position=1e-4, orientation=3e-4, reading=4e-3)
    made = dataclasses.replace(hexapod.tolerances, length=1e-3, angle=2e-3, gain=1e-3)
    hexapod = hexapod.replace(noise=noise, tolerances=made)
    at = symkin.sample_workspace(hexapod, 40, seed=3).poses
    readings = disturb(hexapod, 2).inverse_kinematics(at)
    exact = symkin.Measurements.of(at, readings, reading_unit="rad", pose_space="spatial")
    measured = Observed("pose").measure(exact, noise, 1)
    angles = angles_of(transforms("spatial", measured.poses).rotation, "ZYX")
    mistaken = poses(np.hstack([measured.poses[:, :3], angles]))
    found = symkin.identify(hexapod, dataclasses.replace(measured, poses=mistaken))
    assert "no rotation vectors, but angles ZYX" in str(found.doubts[0])
    assert symkin.identify(hexapod, measured).trustworthy
