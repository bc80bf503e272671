# SPDX-License-Identifier: MIT
"""Mechanism files whose points are coordinates, as drawings have them."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import symkin
from symkin.analysis.alignment import poses_of_mechanism
from symkin.cli.options import Observing
from symkin.data.pose_tables import read_pose_list
from symkin.errors import MeasurementError, MechanismFileError
from symkin.files.mechanism_schema import ends_of
from symkin.files.mechanism_writer import mechanism_text
from symkin.model.file_frames import (
    as_drawn,
    axis_of_drawing,
    cartesian,
    from_drawing,
    jacobian,
    polar,
)
from symkin.model.framing import unframed
from symkin.model.poses import Transform, poses_of, rotations_from_vectors, transforms
from symkin.model.settings import Frames
from symkin.storage.toml_file import toml_value

STAYS = Transform(np.eye(3), np.zeros(3))
HERE = {"base": STAYS, "platform": STAYS}


def typed(mechanism: Any, motions: Any = HERE, *, workspace: bool = True) -> str:
    """The file of all legs with points by coordinates, in frames that these motions lead to."""
    ends = ends_of(symkin.chain_info(mechanism.chain, mechanism.platform))
    listed = mechanism.replace(symmetry=None)
    if not workspace:
        listed = listed.replace(workspace=None)
    lines: list[str] = []
    leg = -1
    for line in mechanism_text(listed).splitlines():
        leg += line.startswith("[[legs]]")
        key = line.split(" =")[0]
        end = next((end for end, names in ends.items() if key in names.values()), None)
        if end is None or leg < 0:
            lines.append(line)
        elif key == ends[end]["radius"]:
            own = mechanism.legs[leg].parameters
            at = cartesian({kind: np.array(own[name]) for kind, name in ends[end].items()})
            full = np.zeros(3)
            full[: len(at)] = at
            moved = motions[end].rotation @ full + motions[end].translation
            lines.append(f"{end}_point = {toml_value(moved[: len(at)].tolist())}")
    return "\n".join(lines) + "\n"


def loaded(folder: Path, text: str, name: str = "typed.toml") -> Any:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return symkin.load_mechanism(path)


def refused(folder: Path, text: str) -> str:
    with pytest.raises(MechanismFileError) as caught:
        loaded(folder, text)
    return str(caught.value)


def differences(one: Any, another: Any) -> Any:
    """Of parameters, angles by the shortest turn."""
    apart = one.parameters - another.parameters
    angles = [unit == "rad" for unit in one.parameter_units(0)]
    apart[:, angles] = np.angle(np.exp(1j * apart[:, angles]))
    return apart


@pytest.mark.parametrize("name", ["hexapod_jugglebot", "3RRR", "3PRR", "linear_delta", "hexa"])
def test_points_in_the_frames_of_the_polar_file_give_the_same_mechanism(
    tmp_path: Path, name: str
) -> None:
    nominal = symkin.load_mechanism(name)
    made = loaded(tmp_path, typed(nominal))
    size = np.abs(nominal.parameters).max()
    assert np.abs(differences(made, nominal)).max() < 1e-12 * size
    assert made.frames is None
    assert made.workspace == nominal.workspace
    assert not made.points.moved


@st.composite
def motions(draw: Any, *, in_space: bool) -> Transform:
    number = st.floats(-1.0, 1.0)
    vector = np.array([draw(number) for _ in range(6)])
    if not in_space:
        vector[[2, 3, 4]] = 0.0
    return Transform(rotations_from_vectors(3 * vector[None, 3:])[0], vector[:3])


@pytest.mark.parametrize("name", ["3RPR", "hexapod_jugglebot"])  # whose readings know no axes
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_readings_at_corresponding_poses_do_not_depend_on_the_frames_of_the_drawing(
    tmp_path: Path, name: str, data: Any
) -> None:
    nominal = symkin.load_mechanism(name)
    in_space = nominal.space.in_space
    frames = {end: data.draw(motions(in_space=in_space)) for end in ("base", "platform")}
    made = loaded(tmp_path, typed(nominal, frames, workspace=False))
    space = nominal.pose_space
    poses = symkin.sample_workspace(nominal, 40, seed=2).poses
    in_drawing = poses_of(
        space, frames["base"] @ transforms(space, poses) @ frames["platform"].inverse
    )
    taken = made.inverse_kinematics(from_drawing(made, in_drawing))
    np.testing.assert_allclose(taken, nominal.inverse_kinematics(poses), atol=2e-11)
    # A measured pose is that of the drawing's frames, too.
    np.testing.assert_allclose(
        transforms(space, unframed(made, in_drawing)).translation,
        transforms(space, from_drawing(made, in_drawing)).translation,
        atol=1e-12,
    )
    np.testing.assert_allclose(as_drawn(made, from_drawing(made, poses)), poses, atol=1e-12)


SHIFTED = {
    "base": Transform(np.eye(3), np.array([1.0, -2.0, 0.0])),
    "platform": Transform(np.eye(3), np.array([0.1, 0.0, 0.0])),
}


def test_the_parameters_are_about_the_centre_of_the_symmetry(tmp_path: Path) -> None:
    nominal = symkin.load_mechanism("3RRR")
    made = loaded(tmp_path, typed(nominal, SHIFTED, workspace=False))
    assert np.abs(differences(made, nominal)).max() < 1e-12
    assert made.points.base == pytest.approx((1.0, -2.0), abs=1e-12)
    assert made.points.platform == pytest.approx((0.1, 0.0), abs=1e-12)
    assert made.frames.base == pytest.approx((1.0, -2.0, 0.0), abs=1e-12)
    assert made.frames.target == pytest.approx((-0.1, 0.0, 0.0), abs=1e-12)


def test_a_leg_at_the_origin_of_the_drawing_is_regular(tmp_path: Path) -> None:
    nominal = symkin.load_mechanism("3RRR_asymmetric")
    first = nominal.legs[0].parameters
    at = first["base_radius"] * np.array(
        [np.cos(first["base_angle"]), np.sin(first["base_angle"]), 0.0]
    )
    frames = {"base": Transform(np.eye(3), -at), "platform": STAYS}
    made = loaded(tmp_path, typed(nominal, frames, workspace=False))
    radii = made.parameters[:, made.parameter_names.index("base_radius")]
    assert radii.min() > 0.2 * radii.max()
    poses = symkin.sample_workspace(nominal, 50, seed=2).poses
    in_drawing = poses - np.append(at[:2], 0.0)
    np.testing.assert_allclose(
        made.inverse_kinematics(from_drawing(made, in_drawing)),
        nominal.inverse_kinematics(poses),
        atol=1e-12,
    )


def test_home_and_box_are_in_the_frames_of_the_drawing(tmp_path: Path) -> None:
    nominal = symkin.load_mechanism("hangprinter")
    drawn = nominal.points.workspace
    assert drawn.home == (0.0, 0.0, 0.3)
    shift = np.array(nominal.points.base)
    assert nominal.home + shift == pytest.approx(drawn.home)
    assert np.array(nominal.workspace.lower) + shift == pytest.approx(drawn.lower)
    nominal.save(tmp_path / "copy.toml")
    copy = symkin.load_mechanism(tmp_path / "copy.toml")
    assert copy.points.workspace == drawn
    np.testing.assert_allclose(copy.parameters, nominal.parameters, rtol=1e-14)


def test_the_box_of_a_platform_that_turns_about_another_point_holds_every_pose(
    tmp_path: Path,
) -> None:
    nominal = symkin.load_mechanism("3RPR")
    aside = {"base": STAYS, "platform": SHIFTED["platform"]}
    text = typed(nominal, aside).replace("working_mode", "#")
    made = loaded(tmp_path, text)
    drawn = made.points.workspace
    assert drawn.lower == nominal.workspace.lower
    random = np.random.default_rng(1).uniform(drawn.lower, drawn.upper, (200, 3))
    own = from_drawing(made, random)
    assert (own > np.array(made.workspace.lower) - 1e-3).all()
    assert (own < np.array(made.workspace.upper) + 1e-3).all()
    made.save(tmp_path / "copy.toml")
    assert symkin.load_mechanism(tmp_path / "copy.toml").points.workspace == drawn


def test_frames_of_the_device_are_those_of_the_drawing(tmp_path: Path) -> None:
    text = typed(symkin.load_mechanism("hexapod_jugglebot"), workspace=False)
    shift = "base_centre = [0.1, 0, 0.2]\nplatform_centre = [0, 0.05, 0]\n"
    frames = (
        "[frames]\nbase = [1, 2, 3, 0.1, 0.2, 0.3]\ntarget = [0, 0, 0.1, 0, 0, 0.2]\n"
        "points = [[0.1, 0.2, 0.3]]\nanchors = [[1, 1, 1]]\nplane = [0.1, 0.01, 0.02]\n"
    )
    here, elsewhere = loaded(tmp_path, text + frames), loaded(tmp_path, text + frames + shift)
    poses = symkin.sample_workspace(symkin.load_mechanism("hexapod_jugglebot"), 5, seed=1).poses
    own = unframed(elsewhere, poses)
    np.testing.assert_allclose(
        elsewhere.inverse_kinematics(own), here.inverse_kinematics(unframed(here, poses)), atol=1e-9
    )
    # A further target and the plane stay where they are.
    base, platform = np.array(elsewhere.points.base), np.array(elsewhere.points.platform)
    assert elsewhere.frames.points[0] + platform == pytest.approx(here.frames.points[0])
    c0, c1, c2 = here.frames.plane
    at = np.array([0.3, -0.2, c0 + c1 * 0.3 - c2 * 0.2]) - base
    d0, d1, d2 = elsewhere.frames.plane
    assert at[2] == pytest.approx(d0 + d1 * at[0] + d2 * at[1])
    assert elsewhere.frames.anchors == here.frames.anchors
    elsewhere.save(tmp_path / "copy.toml")
    again = symkin.load_mechanism(tmp_path / "copy.toml")
    for name in ("base", "target", "points", "anchors", "plane"):
        ours, theirs = getattr(again.frames, name), getattr(elsewhere.frames, name)
        assert np.ravel(ours) == pytest.approx(np.ravel(theirs))


def test_the_default_plane_is_that_of_the_drawing() -> None:
    nominal = symkin.load_mechanism("hangprinter")
    assert nominal.frames.plane[0] == -nominal.points.base[2] != 0


def test_without_another_centre_a_file_has_no_frames(tmp_path: Path) -> None:
    made = loaded(tmp_path, typed(symkin.load_mechanism("3RRR")))
    assert made.frames is None
    assert made.replace(frames=Frames()).points == made.points


def test_the_derivatives_of_points_are_those_of_differences() -> None:
    for kinds in (
        {"radius": 0.7, "azimuth": 2.0},
        {"radius": 0.7, "polar_angle": 1.1, "azimuth": -2.0},
        {"radius": 0.7, "azimuth": 2.0, "height": -0.3},
    ):
        at = jacobian(kinds)
        for column, kind in enumerate(kinds):
            ends = [
                cartesian({k: np.array(v + s * (k == kind)) for k, v in kinds.items()})
                for s in (1e-6, -1e-6)
            ]
            np.testing.assert_allclose(at[:, column], (ends[0] - ends[1]) / 2e-6, atol=1e-9)
        back = polar(cartesian({k: np.array(v) for k, v in kinds.items()}), dict.fromkeys(kinds))
        assert {k: float(v) for k, v in back.items()} == pytest.approx(kinds)


@pytest.mark.parametrize("estimator", ["implicit", "joint"])
def test_calibrated_points_have_the_deviations_of_their_coordinates(
    tmp_path: Path, estimator: str
) -> None:
    nominal = loaded(tmp_path, typed(symkin.load_mechanism("3RRR")))
    plan = nominal.plan(12, seed=1)
    errors, deviations = [], []
    for seed in range(25):
        simulated = nominal.simulate(plan, seed=seed)
        found = nominal.identify(simulated.measurements, estimator).mechanism
        found.save(tmp_path / "found.toml", overwrite=True)
        values = read_points(tmp_path / "found.toml")
        true = [point_of(simulated.actual, leg, "base") for leg in range(3)]
        errors.append([v["value"] for v in values] - np.array(true))
        deviations.append([v["standard_deviation"] for v in values])
    ratio = np.sqrt(np.mean((np.array(errors) / np.array(deviations)) ** 2, axis=(0, 1)))
    assert ratio == pytest.approx([1, 1], abs=0.25)  # three deviations of the scatter
    again = symkin.load_mechanism(tmp_path / "found.toml")
    np.testing.assert_allclose(again.parameters, found.parameters, rtol=1e-12)
    np.testing.assert_allclose(again.deviations, found.deviations, rtol=1e-9)


def read_points(path: Path) -> list[Any]:
    import tomllib

    return [leg["base_point"] for leg in tomllib.loads(path.read_text())["legs"]]


def point_of(mechanism: Any, leg: int, end: str) -> Any:
    names = ends_of(symkin.chain_info(mechanism.chain, mechanism.platform))[end]
    own = mechanism.legs[leg].parameters
    at = cartesian({kind: np.array(own[name]) for kind, name in names.items()})
    return at + np.array(getattr(mechanism.points, end))


def test_a_held_coordinate_has_no_deviation(tmp_path: Path) -> None:
    nominal = loaded(tmp_path, typed(symkin.load_mechanism("linear_delta")))
    simulated = nominal.simulate(nominal.plan(seed=1), seed=1)
    found = nominal.identify(simulated.measurements).mechanism
    found.save(tmp_path / "found.toml")
    heights = [each["standard_deviation"][2] for each in read_points(tmp_path / "found.toml")]
    assert np.isnan(heights).all()
    again = symkin.load_mechanism(tmp_path / "found.toml")
    np.testing.assert_allclose(again.deviations, found.deviations, rtol=1e-9)


def test_one_protocol_from_a_drawing_whose_origin_is_elsewhere(tmp_path: Path) -> None:
    nominal = symkin.load_mechanism("hangprinter")
    plan = nominal.plan(6, seed=1)
    plan.save(tmp_path / "plan.csv")
    with (tmp_path / "plan.csv").open() as file:
        table = np.genfromtxt(file, delimiter=",", names=True)
    assert abs(table["z_m"].mean() - 0.65) < 0.4  # the box of the file, not of the parameters
    read = symkin.read_plan(tmp_path / "plan.csv", nominal)
    np.testing.assert_allclose(read.poses, plan.poses, atol=1e-12)
    simulated = nominal.simulate(plan, seed=1)
    simulated.write(tmp_path / "out")
    measured = symkin.read_measurements(tmp_path / "out" / "measurements.csv", nominal)
    found = nominal.identify(measured)
    assert found.after.position_rms < found.before.position_rms / 3
    actual = symkin.load_mechanism(tmp_path / "out" / "actual.toml")
    np.testing.assert_allclose(actual.parameters, simulated.actual.parameters, rtol=1e-12)


POINT = "base_point = ["


@pytest.mark.parametrize(
    ("old", "new", "key", "error"),
    [
        (POINT, "base_radius = 1 # ", "base_angle", "this key is missing"),
        (POINT, f"base_radius = 1 \n{POINT}", "base_radius", "stands beside base_point"),
        (POINT, "base_point = [0.1, ", "base_point", "has 3 values; expected 2, in m"),
        (POINT, "base_point = '1 m' #", "base_point", "has '1 m', no list"),
        (POINT, "base_point = ['3 deg', 0] #", "base_point", '"3 deg" is an angle'),
        ("base_point", "base_pint", "base_pint", 'unknown key; did you mean "base_point"'),
        (
            POINT,
            "base_radius = 1\nbase_angle = 2 # ",
            "base_radius",
            "leg 2 has base_point; expected it in every leg, or in none",
        ),
        (
            POINT,
            "base_point = {value = [1, 2], standard_deviation = [-1, 0]} # ",
            "base_point",
            "not negative",
        ),
        (
            POINT,
            "base_point = {value = [1, 2], correlation = [2]} # ",
            "base_point",
            "expected -1 to 1",
        ),
        ("[noise]", "[frames]\nbase_centre = [1, 2, 3]\n[noise]", "base_centre", "has 3 values"),
    ],
)
def test_a_wrong_point_is_refused_where_it_stands(
    tmp_path: Path, old: str, new: str, key: str, error: str
) -> None:
    wrong = typed(symkin.load_mechanism("3RRR")).replace(old, new, 1)
    message = refused(tmp_path, wrong)
    assert f".{key}: " in message
    assert error in message
    place = message.split("typed.toml:")[1].split(":")[0]
    line = wrong.splitlines()[int(place) - 1]
    assert line.startswith((key, "[[legs]]"))


@pytest.mark.parametrize(
    ("name", "end", "point", "error"),
    [
        ("3PRR", "base", "[1, 2]", "the base end of [P]RR is a guide, not a point"),
        ("5bar", "platform", "[1, 2]", "the platform is a point itself"),
        ("linear_delta", "platform", "[1, 2, 3]", "less the platform's point"),
    ],
)
def test_an_end_without_a_point_has_no_coordinates(
    tmp_path: Path, name: str, end: str, point: str, error: str
) -> None:
    text = mechanism_text(symkin.load_mechanism(name))
    line = f"[reference_leg]\n{end}_point = {point}\n"
    assert error in refused(tmp_path, text.replace("[reference_leg]\n", line))


def test_a_direction_has_an_azimuth_of_its_own_beside_coordinates(tmp_path: Path) -> None:
    text = typed(symkin.load_mechanism("linear_delta"))
    without = "\n".join(line for line in text.splitlines() if "guide_azimuth" not in line)
    assert "guide_azimuth: this key is missing" in refused(tmp_path, without)


def test_a_centre_goes_with_points_alone(tmp_path: Path) -> None:
    text = mechanism_text(symkin.load_mechanism("3RRR"))
    message = refused(tmp_path, text + "\n[frames]\nbase_centre = [0, 0]\n")
    assert "frames.base_centre: goes with base_point, which no leg has" in message


def test_the_hexapod_of_a_telescope_has_its_published_struts() -> None:
    made = symkin.load_mechanism("lsst_camera_hexapod")
    base = [(227647, 653753, 0), (679990, -129728, 0), (452343, -524025, 0)]
    platform = [(472917, 512146, 403918), (679990, 153485, 403918), (207073, -665631, 403918)]
    struts = np.array(list(zip(base, platform, strict=True))) * 1e-6
    struts = np.concatenate([struts, struts * [-1, 1, 1]])
    ours = np.array(
        [[point_of(made, leg, end) for end in ("base", "platform")] for leg in range(6)]
    )
    apart = np.abs(ours[:, None] - struts).max(axis=(2, 3))
    assert sorted(apart.argmin(axis=1)) == list(range(6))
    assert apart.min(axis=1).max() < 1e-6
    assert made.inverse_kinematics(made.home) == pytest.approx(np.zeros((1, 6)), abs=1e-12)


def test_a_fleet_is_measured_in_the_frames_of_the_drawing() -> None:
    nominal = symkin.load_mechanism("hangprinter")
    simulated = nominal.simulate(nominal.plan(8, seed=1), seed=1)
    fleet = symkin.identify_many(nominal, [simulated.measurements])
    off = np.abs(fleet.parameters[0] - simulated.actual.parameters) / fleet.deviations[0]
    assert off.max() < 4.5


def test_check_says_where_the_parameters_have_their_centre(tmp_path: Path) -> None:
    moved = loaded(tmp_path, typed(symkin.load_mechanism("3RRR"), SHIFTED, workspace=False))
    text = moved.check(seed=1).text()
    assert "about (1.00, -2.00) m of the file's base frame" in text.replace("\N{MINUS SIGN}", "-")
    assert "file's base frame" not in symkin.load_mechanism("lsst_camera_hexapod").check().text()


def test_frames_on_the_command_line_are_those_of_the_drawing() -> None:
    nominal = symkin.load_mechanism("hangprinter")
    given = {"observe": ["pose", "height"], "base": "1 m, 0, 0, 0, 0, 0"}
    seen = Observing(**given, plane="20 mm, 0, 0.1").observed(nominal)
    x, y, z = nominal.points.base
    assert seen.base == pytest.approx((1 + x, y, z, 0, 0, 0))
    assert seen.plane == pytest.approx((0.02 + 0.1 * y - z, 0, 0.1))
    usual = Observing().observed(nominal)
    assert usual.in_frames(nominal.frames) == usual
    assert usual.base == nominal.frames.base


def test_reported_poses_and_frames_that_are_found_are_those_of_the_drawing(tmp_path: Path) -> None:
    nominal = symkin.load_mechanism("hangprinter")
    poses = symkin.sample_workspace(nominal, 12, seed=1).poses
    taken = symkin.Measurements.of(
        as_drawn(nominal, poses) + np.array([1.0, 2.0, 3.0]),
        nominal.inverse_kinematics(poses),
        pose_space="translating",
    )
    symkin.write_measurements(taken, tmp_path / "seen.csv", nominal)
    measured, own, _ = poses_of_mechanism(nominal, tmp_path / "seen.csv")
    found = symkin.align_frames(measured, own, pose_space="translating")
    assert found.frames.base[:3] == pytest.approx((1.0, 2.0, 3.0), abs=1e-6)
    reported = dataclasses.replace(taken, reported=poses)
    symkin.write_measurements(reported, tmp_path / "reported.csv", nominal)
    again = symkin.read_measurements(tmp_path / "reported.csv", nominal)
    np.testing.assert_allclose(again.reported, poses, atol=1e-12)
    _, own, _ = poses_of_mechanism(nominal, tmp_path / "reported.csv")
    np.testing.assert_allclose(own, as_drawn(nominal, poses), atol=1e-12)


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.sampled_from(["hangprinter", "3RRR", "hexapod_jugglebot"]),
    st.integers(0, 2**32),
    st.booleans(),
)
def test_measurements_that_are_saved_with_the_mechanism_read_back(
    tmp_path: Path, name: str, seed: int, partial: bool
) -> None:
    random = np.random.default_rng(seed)
    polar = nominal = symkin.load_mechanism(name)
    if name != "hangprinter":  # whose file has frames of its own
        there = [Transform(np.eye(3), np.array([*random.normal(size=2), 0.0])) for _ in range(2)]
        motions = dict(zip(HERE, there, strict=True))
        nominal = loaded(tmp_path, typed(polar, motions, workspace=False))
    poses = polar.sample_workspace(8, seed=1).poses
    reported = poses[random.permutation(8)]
    if partial:
        reported[random.random(8) < 0.4] = np.nan
    taken = symkin.Measurements.of(
        poses,
        polar.inverse_kinematics(poses),
        reading_unit=nominal.reading_unit,
        pose_space=nominal.pose_space,
        reported=reported,
        reported_deviations=np.abs(random.normal(size=(8, nominal.core.dof))),
    )
    path = taken.save(tmp_path / "saved.csv", nominal, overwrite=True)
    read = symkin.read_measurements(path, nominal)
    np.testing.assert_allclose(read.reported, reported, atol=1e-12)
    exact = {"row_numbers": taken.row_numbers, "source": None, "reported": reported}
    assert dataclasses.replace(read, **exact) == taken
    symkin.write_measurements(taken, tmp_path / "written.csv", nominal, overwrite=True)
    assert (tmp_path / "written.csv").read_bytes() == path.read_bytes()


def test_reported_poses_are_not_saved_without_the_mechanism_that_knows_their_frames(
    tmp_path: Path,
) -> None:
    nominal = symkin.load_mechanism("hangprinter")
    poses = symkin.sample_workspace(nominal, 6, seed=1).poses
    taken = symkin.Measurements.of(
        poses,
        nominal.inverse_kinematics(poses),
        reading_unit=nominal.reading_unit,
        pose_space="translating",
    )
    with pytest.raises(MeasurementError, match="give the mechanism"):
        dataclasses.replace(taken, reported=poses).save(tmp_path / "m.csv")
    other = symkin.load_mechanism("linear_delta")
    with pytest.raises(MeasurementError, match="readings of 4 legs; the mechanism has 3"):
        taken.save(tmp_path / "m.csv", other)
    assert not (tmp_path / "m.csv").exists()
    read = symkin.read_measurements(taken.save(tmp_path / "m.csv"), nominal)
    assert np.array_equal(read.poses, taken.poses)


def test_a_position_that_cannot_be_carried_between_frames_is_refused(tmp_path: Path) -> None:
    motions = {**HERE, "platform": Transform(np.eye(3), np.array([0.1, 0.2, 0.0]))}
    polar = symkin.load_mechanism("3RRR")
    nominal = loaded(tmp_path, typed(polar, motions, workspace=False))
    poses = polar.sample_workspace(6, seed=1).poses
    half = poses.copy()
    half[2, 2] = np.nan
    taken = symkin.Measurements.of(poses, polar.inverse_kinematics(poses), reported=half)
    with pytest.raises(MeasurementError, match="row 3 has a reported position without"):
        taken.save(tmp_path / "m.csv", nominal)
    taken.save(tmp_path / "m.csv", polar)
    with pytest.raises(MeasurementError, match=r"m.csv: row 4 has a reported position without"):
        symkin.read_measurements(tmp_path / "m.csv", nominal)


@pytest.mark.parametrize(("axis", "turn"), [("", [0, 0, 0]), ("x", [0, 1, 0]), ("y", [-1, 0, 0])])
def test_check_says_that_a_drawing_lies_on_its_side_where_that_hides_symmetries(
    axis: str, turn: list[int], tmp_path: Path
) -> None:
    turned = rotations_from_vectors(np.pi / 2 * np.array([turn]))[0]
    motion = Transform(turned, np.array([0.1, -0.2, 0.05]))
    hexapod = symkin.load_mechanism("hexapod_jugglebot")
    text = typed(hexapod, {"base": motion, "platform": motion}, workspace=False)
    sideways = loaded(tmp_path, text)
    assert axis_of_drawing(sideways) == axis
    said = " ".join(symkin.check_mechanism(sideways).text(whole=True).split())
    told = f"the drawing's {axis} axis than about z" in said
    assert told != ("All 6 legs are alike" in said)


def test_a_table_of_the_workspace_is_in_the_frames_of_the_drawing() -> None:
    mechanism = symkin.load_mechanism("hangprinter")
    sample = mechanism.sample_workspace(20, 1)
    back = read_pose_list(dict(sample.columns()), mechanism)
    np.testing.assert_allclose(back, sample.poses, atol=1e-12)
    assert np.abs(as_drawn(mechanism, sample.poses) - sample.poses).max() > 0.1
