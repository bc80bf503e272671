# SPDX-License-Identifier: MIT
"""All symmetries of a mechanism as pairs of motions, one of the base and one of the platform."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.observability import analyse_observability, carried_back, observability_rows
from symkin.errors import SymkinError
from symkin.model.settings import NoiseSettings, WorkspaceSettings
from symkin.model.symmetry import leg_carriers, map_poses, observability_group, symmetry_pairs
from symkin.model.symmetry.groups import mechanism_groups
from symkin.model.symmetry.naming import element_words, group_name
from symkin.planning.simulation import disturb

DECLARED_FOLDER = Path(__file__).parents[3] / "mechanisms" / "declared"

# Pairs, those that keep modes, that fix home, that do both and the group that these are, and how
# many of them permute readings.
SHIPPED = {
    "2RRR_PRP": (2, 2, 2, 2, "D_1", 2),
    "3PRP": (12, 12, 6, 6, "D_3", 6),
    "3PRR": (6, 3, 6, 3, "C_3", 3),
    "3PRS": (24, 12, 6, 6, "C_3v", 6),
    "3RPR": (6, 6, 3, 3, "C_3", 3),
    "3RPR_end_joint": (6, 3, 6, 3, "C_3", 3),
    "3RPS": (12, 12, 6, 6, "C_3v", 6),
    "3RRP": (12, 6, 6, 6, "D_3", 6),
    "3RRR": (6, 3, 6, 3, "C_3", 3),
    "3RRR_asymmetric": (1, 1, 1, 1, "C_1", 1),
    "4RRR": (8, 4, 8, 4, "C_4", 4),
    "5bar": (4, 2, 2, 2, "D_1", 2),
    "6RRR": (6, 6, 6, 6, "D_3", 6),
    "agile_eye": (96, 24, 12, 3, "C_3", 3),
    "hangprinter": (1, 1, 1, 1, "C_1", 1),
    "hexa": (12, 6, 6, 6, "C_3v", 6),
    "hexaglide": (12, 6, 12, 6, "C_3v", 6),
    "hexapod_jugglebot": (12, 12, 6, 6, "C_3v", 6),
    "linear_delta": (12, 6, 6, 6, "C_3v", 6),
    "lsst_camera_hexapod": (12, 12, 6, 6, "C_3v", 6),
    "rotary_delta": (12, 6, 6, 6, "C_3v", 6),
}
SENSOR = {"sensor_gain": 1.0, "sensor_offset": 0.0}
PLATFORMS = {
    "translating": "translating",
    "spatial rigid": "rigid",
    "planar rigid": "rigid",
    "planar point": "point",
    "spherical": "spherical",
}


def orthoglide():
    """Guides along x, y and z."""
    towards = [(-math.pi, 0.0, 0.5, 0.0), (-math.pi / 2, math.pi / 2, 0.5, 0.0), (0, 0, 0, -0.5)]
    legs = [
        symkin.Leg(
            "[P]US",
            {
                "distal_length": 0.31,
                "base_radius": radius,
                "base_azimuth": azimuth,
                "base_height": height,
                "guide_azimuth": guide,
                "guide_elevation": math.pi / 2 if height else 0.0,
                "guide_swing": 0.0,
                **SENSOR,
            },
            -1,
        )
        for azimuth, guide, radius, height in towards
    ]
    return symkin.Mechanism("orthoglide", legs, platform="translating")


def cable_box():
    """Eight cables from the corners of a box to those of a smaller one."""
    legs = []
    for corner in np.ndindex(2, 2, 2):
        signs = 2 * np.array(corner) - 1
        values = dict(SENSOR)
        for end, half in ("base", (2, 1.5, 1.25)), ("platform", (0.3, 0.2, 0.25)):
            point = signs * half
            radius = float(np.linalg.norm(point))
            values[f"{end}_radius"] = radius
            values[f"{end}_polar_angle"] = math.acos(point[2] / radius)
            values[f"{end}_azimuth"] = math.atan2(point[1], point[0])
        legs.append(symkin.Leg("U[P]S", values))
    return symkin.Mechanism("cable box", legs)


def crossed_3rpr():
    """The platform's points go round the other way."""
    legs = [
        symkin.Leg(
            "R[P]R",
            {
                "base_radius": 1.0,
                "base_angle": 2 * math.pi * leg / 3,
                "platform_radius": 0.3,
                "platform_angle": -2 * math.pi * leg / 3,
                **SENSOR,
            },
        )
        for leg in range(3)
    ]
    return symkin.Mechanism("crossed", legs)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_shipped_mechanisms_have_these_symmetries(name):
    found = symmetry_pairs(symkin.load_mechanism(name))
    home = found.keep_modes_and_home
    numbers = len(found.pairs), len(found.keep_modes), len(found.fix_home), len(home)
    permuting = sum(each.permutes_readings for each in home)
    assert (*numbers, found.name(home), permuting) == SHIPPED[name]
    assert not found.exchanges


def some_poses(mechanism, rng):
    """Poses near home that all legs reach."""
    near = mechanism.home + rng.normal(0, 0.01, (6, len(mechanism.home)))
    if mechanism.space.turns and mechanism.space.in_space:
        near[:, -4:] /= np.linalg.norm(near[:, -4:], axis=1, keepdims=True)
    return near[np.isfinite(mechanism.inverse_kinematics(near)).all(axis=1)]


@pytest.mark.parametrize("name", SHIPPED)
def test_readings_at_the_image_are_what_the_joint_maps_say(name):
    mechanism = symkin.load_mechanism(name)
    rng = np.random.default_rng(4)
    poses = some_poses(mechanism, rng)
    assert len(poses) > 2
    names = mechanism.parameter_names
    gains, offsets = (
        mechanism.parameters[:, names.index(f"sensor_{kind}")] for kind in ("gain", "offset")
    )
    joints = gains * mechanism.inverse_kinematics(poses) + offsets
    elements = symmetry_pairs(mechanism).elements
    for element in elements[:: max(1, len(elements) // 12)]:
        onto = list(element.permutation)
        modes = [0] * len(onto)
        for leg, joint in enumerate(element.joints):
            modes[onto[leg]] = mechanism.working_modes[leg] * joint.mode_factor
        legs = [
            symkin.Leg(leg.chain, leg.parameters, mode)
            for leg, mode in zip(mechanism.legs, modes, strict=True)
        ]
        image = mechanism.replace(symmetry=None, legs=legs)
        readings = image.inverse_kinematics(element.map_poses(mechanism, poses))
        found = gains * readings + offsets
        for leg, joint in enumerate(element.joints):
            off = found[:, onto[leg]] - (joint.sign * joints[:, leg] + joint.constant)
            if mechanism.reading_unit == "rad":
                off = (off + math.pi) % (2 * math.pi) - math.pi
            assert np.abs(off).max() < 1e-9, (element.words, leg)


def test_an_orthoglide_along_the_axes_has_its_symmetry_about_the_diagonal():
    mechanism = orthoglide()
    found = symmetry_pairs(mechanism)
    home = found.keep_modes_and_home
    assert (len(found.pairs), found.name(found.pairs)) == (48, "O_h")
    assert (len(home), found.name(home)) == (6, "C_3v")
    assert {each.words for each in home if each.words.startswith("turn")} == {
        "turn by 120° about (1, 1, 1)",
        "turn by -120° about (1, 1, 1)",
    }
    # One choice of poses serves all legs.
    assert [reference for reference, _ in leg_carriers(mechanism)] == [0, 0, 0]
    poses = np.random.default_rng(1).uniform(-0.05, 0.05, (5, 3))
    readings = mechanism.inverse_kinematics(poses)
    for leg, element in enumerate(observability_group(mechanism)):
        image = mechanism.inverse_kinematics(map_poses(mechanism, element, poses))
        np.testing.assert_allclose(image[:, leg], readings[:, 0], atol=1e-14)
        np.testing.assert_array_equal(
            map_poses(mechanism, element.label, poses), map_poses(mechanism, element, poses)
        )


def test_a_cable_box_is_one_orbit():
    mechanism = cable_box()
    found = symmetry_pairs(mechanism)
    assert found.name(found.keep_modes_and_home) == "D_2h"
    assert {reference for reference, _ in leg_carriers(mechanism)} == {0}
    observability = mechanism_groups(mechanism, symkin.detect_symmetry(mechanism))[-1]
    assert (observability.name, len(observability.elements)) == ("D_2h", 8)


def test_of_a_crossed_platform_no_pose_is_fixed_by_all_symmetries():
    found = symmetry_pairs(crossed_3rpr())
    assert (len(found.pairs), found.name(found.pairs)) == (6, "D_3")
    assert found.name(found.pairs, "platform") == "D_3"
    assert found.name(found.fix_home) == "D_1"


def test_legs_that_read_the_same_from_either_end_may_exchange_base_and_platform(shared_reference):
    elements = json.loads((shared_reference / "symmetry_pairs.json").read_text())["cases"]
    case = next(each for each in elements if each["name"] == "exchange_generic")
    mechanism = mechanism_of(case)
    found = symmetry_pairs(mechanism)
    assert (len(found.pairs), len(found.exchanges)) == (1, 1)
    poses = np.array([each["pose"] for each in case["mapped_poses"]])
    readings = mechanism.inverse_kinematics(poses)
    (exchange,) = found.exchanges
    image = mechanism.inverse_kinematics(exchange.map_poses(mechanism, poses))
    np.testing.assert_allclose(image[:, list(exchange.permutation)], readings, atol=1e-12)
    # Twice is the identity, or one of the pairs.
    twice = exchange.core.compose(exchange.core)
    assert min(_core.apart(twice, each.core) for each in found.pairs) < 1e-12


def mechanism_of(case):
    legs = [
        symkin.Leg(leg["chain"], leg["parameters"], leg["working_mode"]) for leg in case["legs"]
    ]
    return symkin.Mechanism(case["name"], legs, platform=PLATFORMS[case["platform"]])


def same_motion(motion, case, end, tolerance):
    if f"{end}_rotation" not in case:
        return True
    linear, shift = np.array(case[f"{end}_rotation"]), case[f"{end}_translation"]
    size = len(linear)
    off = np.abs(motion.linear[:size, :size] - linear).max(), np.abs(motion.shift[:size] - shift)
    return max(off[0], off[1].max()) < tolerance


def test_all_elements_of_the_reference_mechanisms_are_found(shared_reference):
    for case in json.loads((shared_reference / "symmetry_pairs.json").read_text())["cases"]:
        mechanism, expected = mechanism_of(case), case["expected"]
        found = symmetry_pairs(mechanism, tolerance=case["tolerance"]["length"])
        assert len(found.pairs) == expected["elements"], case["name"]
        assert len(found.exchanges) == expected["exchanges"]
        assert found.name(found.pairs) == expected["base_group"]
        assert found.name(found.keep_modes) == expected["keep_modes_base_group"]
        assert len(found.orbits(found.pairs)) == expected["orbits"]
        assert len(found.orbits(found.keep_modes)) == expected["keep_modes_orbits"]
        tolerance = 1e-3 if case["name"] == "within_tolerance" else 1e-9
        for element in expected["elements_list"]:
            (match,) = (
                each
                for each in found.elements
                if each.exchange == element["exchange"]
                and [leg + 1 for leg in each.permutation] == element["permutation"]
                and same_motion(each.base, element, "base", tolerance)
                and same_motion(each.platform, element, "platform", tolerance)
            )
            assert match.keeps_modes == element["keeps_modes"]
            words = element["base_words"].replace(" deg", "°")
            assert match.words.split(";")[0].endswith(words)


def test_errors_of_the_drawing_within_the_tolerance_leave_the_group():
    mechanism = cable_box()
    rng = np.random.default_rng(2)
    parameters = mechanism.parameters.copy()
    parameters[:, :6] += rng.uniform(-2e-5, 2e-5, parameters[:, :6].shape)
    rough = mechanism.with_parameters(parameters)
    assert len(symmetry_pairs(rough).pairs) == 1
    assert len(symmetry_pairs(rough, tolerance=1e-4).pairs) == 8


def test_point_groups_are_named():
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    mirror = np.diag([1.0, 1, -1])
    identity = np.eye(3)
    quarter = [np.linalg.matrix_power(turn, power) for power in range(4)]
    assert group_name(quarter, planar=False) == "C_4"
    assert group_name([*quarter, *(each @ mirror for each in quarter)], planar=False) == "C_4h"
    assert group_name([identity, mirror], planar=False) == "C_s"
    assert group_name([identity, -identity], planar=False) == "C_i"
    improper = [np.linalg.matrix_power(turn @ mirror, power) for power in range(4)]
    assert group_name(improper, planar=False) == "S_4"
    assert element_words(turn @ mirror, planar=False) == "turn by 90° and mirror along (0, 0, 1)"
    assert element_words(-identity, planar=False) == "inversion"


def test_a_label_that_there_is_not_is_refused(paper):
    with pytest.raises(symkin.SymkinError, match=r'"p6" is no element.*expected p0 to p5'):
        symmetry_pairs(paper).parse("p6")


@pytest.fixture(scope="module")
def along_axes():
    """An Orthoglide along x, y and z: the base point of leg 3 has no azimuth."""
    return orthoglide().replace(
        workspace=WorkspaceSettings(lower=(-0.07,) * 3, upper=(0.07,) * 3, home=(0.0, 0.0, 0.0)),
        noise=NoiseSettings(5e-5, 0.0, 5e-6),
    )


def test_every_leg_of_an_orthoglide_shows_the_same_of_its_joints(along_axes):
    poses = symkin.sample_workspace(along_axes, 40, seed=1).poses
    shown = [
        analyse_observability(along_axes, leg, map_poses(along_axes, element, poses))
        for leg, (_, element) in enumerate(leg_carriers(along_axes))
    ]
    assert [each.rank for each in shown] == [7, 7, 7]
    assert shown[2].parameter_names == shown[0].parameter_names
    for other in shown[1:]:
        np.testing.assert_allclose(other.r_diagonal, shown[0].r_diagonal, rtol=1e-9)
    as_drawn = observability_rows(along_axes, 2, poses)
    assert np.linalg.matrix_rank(as_drawn) == 6  # which is why they are carried


def test_a_leg_is_carried_back_onto_its_reference_with_its_own_errors(along_axes):
    moved, leg, _ = carried_back(along_axes, 2, np.zeros((1, 3)))
    assert leg == 0
    values, reference = moved.parameters[0], along_axes.parameters[0]
    np.testing.assert_allclose(values, reference, atol=1e-12)
    same, leg, _ = carried_back(symkin.load_mechanism("3RRR"), 2, np.zeros((1, 3)))
    assert (same.name, leg) == ("3RRR", 2)


def test_check_names_what_an_estimate_could_not_write_and_nothing_else(along_axes):
    checked = symkin.check_mechanism(along_axes)
    assert not checked.blind
    (undefined,) = checked.undefined
    assert "leg 3: base_radius is 0 m: its base point is on Z" in undefined
    assert "base_azimuth is undefined; shift the origin" in undefined
    failing = [each for each in checked.conditions.conditions if not each.holds]
    assert not [each for each in failing if each.section == 5 and each.number in (4, 5)]


def test_a_plan_for_all_legs_is_made_and_estimates_are_refused_with_what_to_do(along_axes):
    planned = symkin.plan(along_axes, design="orbits", pose_count=8, candidates=300)
    _, carrier = leg_carriers(along_axes)[1]
    images = map_poses(along_axes, carrier, planned.poses)
    apart = np.linalg.norm(images[:, None] - planned.poses, axis=2).min(axis=1)
    assert apart.max() < 2e-9  # whole orbits
    simulated = symkin.simulate(along_axes, planned, seed=1)
    with pytest.raises(SymkinError, match=r"leg 3: base_radius is 0 m.*shift the origin"):
        symkin.identify(along_axes, simulated.measurements)


DECLARED = {
    "3UPU": (6, 6, "C_3v"),
    "3RRR_encoders": (6, 3, "C_3"),
    "3RRR_four_bar": (3, 3, "C_3"),
    "cables4": (4, 4, "C_2v"),
    "gough_imperfect": (6, 6, "C_3v"),
    "h4": (4, 4, "C_2v"),
    "h4_rods": (2, 2, "C_s"),
    "orthoglide": (6, 6, "C_3v"),
    "orthoglide_rods": (3, 3, "C_3"),
    "tripteron": (3, 3, "C_3"),
}


@pytest.mark.parametrize("name", sorted(DECLARED))
def test_legs_that_are_declared_are_carried_as_they_stand_with_their_errors(name):
    mechanism = symkin.load_mechanism(DECLARED_FOLDER / f"{name}.toml")
    found = symmetry_pairs(mechanism)
    kept = found.keep_modes_and_home
    assert (len(found.pairs), len(kept), found.group_of(kept)) == DECLARED[name]
    poses = symkin.sample_workspace(mechanism, 4, seed=1).poses
    readings = mechanism.inverse_kinematics(poses)
    robot = disturb(mechanism, seed=2).replace(symmetry=None)
    for element in found.keep_modes:
        images = element.map_poses(mechanism, poses)
        at_images = mechanism.inverse_kinematics(images)
        for leg, (onto, joint) in enumerate(zip(element.permutation, element.joints, strict=True)):
            assert joint.constant == pytest.approx(0, abs=1e-12)
            turned = at_images[:, onto] - joint.sign * readings[:, leg]
            np.testing.assert_allclose(np.sin(turned / 2), 0, atol=1e-11)  # m, or a whole turn
            # The leg of a robot that was made does at the images what it does at the poses.
            values, _ = _core.carried_leg(robot.core, leg, element.core, onto)
            parameters = robot.parameters.copy()
            parameters[onto] = values
            carried = robot.with_parameters(parameters)
            here = robot.closure(leg, poses, readings[:, leg])
            there = carried.closure(onto, images, joint.sign * readings[:, leg])
            size = np.linalg.norm(np.reshape(here, (len(poses), -1)), axis=1)
            image_size = np.linalg.norm(np.reshape(there, (len(poses), -1)), axis=1)
            np.testing.assert_allclose(image_size, size, atol=1e-11)
