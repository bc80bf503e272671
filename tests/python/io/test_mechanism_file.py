# SPDX-License-Identifier: MIT
from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from symkin.errors import MechanismError, MechanismFileError
from symkin.files.mechanism_file import shipped_mechanisms
from symkin.files.mechanism_writer import save_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.settings import JointLimits, NoiseSettings, ProtocolSettings, Tolerances
from symkin.robot import load_mechanism

Write = Callable[..., Path]
Refused = Callable[..., None]


def test_a_reference_leg_and_a_group_make_a_mechanism(paper: Mechanism) -> None:
    assert paper.name == "3RRR"
    assert paper.working_modes == (-1, -1, -1)
    reference = dict(zip(paper.parameter_names, paper.parameters[0], strict=True))
    assert reference["base_radius"] == 6 / math.sqrt(3)
    assert reference["platform_radius"] == 1.5 / math.sqrt(3)
    turn = np.diff(paper.parameters[:, paper.parameter_names.index("base_angle")])
    assert np.allclose(np.mod(turn, 2 * math.pi), 2 * math.pi / 3)


def test_the_sections_become_settings_in_si(paper: Mechanism) -> None:
    assert paper.noise == NoiseSettings(position=1e-4, orientation=1e-4, reading=0.0)
    assert paper.tolerances == Tolerances(length=1e-3, angle=1e-3, gain=1e-3)
    assert paper.protocol == ProtocolSettings(pose_count=24, candidates=30000, seed=1)
    assert paper.joint_limits == JointLimits()
    assert paper.workspace is not None
    assert paper.workspace.home == (0.0, 0.0, 0.0)
    assert paper.workspace.reach_margin == 0.05
    assert len(paper.workspace.lower) == len(paper.workspace.upper) == 3


def test_the_smallest_file_is_chain_group_and_reference_leg(write: Write, paper_text: str) -> None:
    start, end = paper_text.index("schema = 1"), paper_text.index("# The box")
    smallest = paper_text[start:end].replace('name = "3RRR"\n', "")
    mechanism = load_mechanism(write(smallest, "robot.toml"))
    assert mechanism.name == "robot"
    assert mechanism.workspace is None
    assert mechanism.noise == NoiseSettings()


def test_listed_legs_keep_their_values_modes_and_deviations(write: Write, listed_text: str) -> None:
    mechanism = load_mechanism(write(listed_text))
    assert mechanism.symmetry is None
    assert mechanism.working_modes == (-1, 1, -1)
    assert mechanism.legs[1].parameters["distal_length"] == 1.7
    distal = mechanism.parameter_names.index("distal_length")
    assert mechanism.deviations is not None
    assert mechanism.deviations[1, distal] == 2e-4
    assert np.isfinite(mechanism.deviations).sum() == 1


def test_a_motor_that_winds_a_cable_has_a_gain_in_length_per_angle(hexapod: Mechanism) -> None:
    assert hexapod.reading_unit == "rad"
    gain = hexapod.parameters[:, hexapod.parameter_names.index("sensor_gain")]
    assert np.allclose(gain, 1e-3 / 0.013899513166666667 / (2 * math.pi), rtol=1e-14)


def test_infinite_joint_limits_are_the_default_and_one_sided_ones_are_allowed(
    write: Write, paper_text: str
) -> None:
    text = paper_text + '\n[joint_limits]\nupper = "170 deg"\n'
    limits = load_mechanism(write(text)).joint_limits
    assert limits == JointLimits(-math.inf, math.radians(170))


def test_the_shipped_mechanisms_are_found_by_name() -> None:
    names = shipped_mechanisms()
    assert {"3RRR", "hexapod_jugglebot"} <= set(names)
    for name in names:
        assert load_mechanism(name).name == name


def test_an_unknown_name_is_answered_with_the_nearest_shipped_one() -> None:
    with pytest.raises(MechanismFileError, match=r'`symkin list`.*did you mean "3RRR"'):
        load_mechanism("3rr")


def test_an_absent_file_is_no_name(tmp_path: Path) -> None:
    with pytest.raises(MechanismFileError, match="no such file"):
        load_mechanism(tmp_path / "3RRR.toml")
    with pytest.raises(MechanismFileError, match="no such file"):
        load_mechanism(str(tmp_path / "3RRR"))


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ('chain = "[R]RR"', 'chain = "RRR"', "chain", ["unknown chain", "[R]RR"]),
        ("schema = 1", "schema = 2", "schema", ["is 2", "expected 1"]),
        ("chain =", "chian =", "chian", ["unknown key", 'did you mean "chain"']),
        ("[workspace]", "[workspce]", "workspce", ["unknown key", '"workspace"']),
        ("base_radius =", "base_radus =", "reference_leg.base_radus", ['"base_radius"']),
        ("reach_margin", "reachmargin", "workspace.reachmargin", ['"reach_margin"']),
        ("pose_count", "posecount", "protocol.posecount", ['"pose_count"']),
        ('"1.5 m"', '"-1.5 m"', "reference_leg.proximal_length", ["-1.5 m", "positive"]),
        ('"6 m / sqrt(3)"', "-3.4", "reference_leg.base_radius", ["-3.4", "not negative"]),
        ("sensor_gain = 1", "sensor_gain = 0", "reference_leg.sensor_gain", ["not zero"]),
        ('"6 m / sqrt(3)"', '"6 rad"', "reference_leg.base_radius", ["is an angle", "a length"]),
        ('"pi/6 rad"', '"5 mm"', "reference_leg.sensor_offset", ["is a length", "an angle"]),
        ("sensor_gain = 1", 'sensor_gain = "1 m"', "reference_leg.sensor_gain", ["plain number"]),
        ('"pi/6 rad"', '"pi/6 radd"', "reference_leg.sensor_offset", ["unknown unit", '"rad"']),
        ('"pi/6 rad"', "{ value = 1 }", "reference_leg.sensor_offset", ["is not a number"]),
        ("working_mode = -1", "working_mode = 2", "reference_leg.working_mode", ["-1 or 1"]),
        ("legs = 3", "legs = 4", "symmetry.legs", ["C3", "to 3 legs", "has 4 legs"]),
        ("legs = 3", "legs = 0", "symmetry.legs", ["is 0", "greater than or equal to 1"]),
        ('"C3"', '"X3"', "symmetry.group", ['"X3"', '"C3" or "D3"']),
        ("orientation = 1e-4", "orientation = -1", "noise.orientation", ["not negative"]),
        ('length = "1 mm"', "length = 0", "tolerances.length", ["is 0", "positive"]),
        ("candidates = 30000", "candidates = 1.5", "protocol.candidates", ["is 1.5", "integer"]),
        ('x = ["-0.55 m", "0.55 m"]', "x = [1, -1]", "workspace.x", ["lower bound first"]),
        ('x = ["-0.55 m", "0.55 m"]', "x = [1]", "workspace.x", ["1 values", "expected 2"]),
        ('x = ["-0.55 m", "0.55 m"]', "x = 1", "workspace.x", ["no list", "expected 2"]),
        ('"0 m", "0 rad"]', '"0 m"]', "workspace.home", ["2 values", "expected 3"]),
        ('"0 m", "0 rad"]', '"3 m", "0 rad"]', "workspace.home", ["beyond the reach of leg"]),
        ("conditioning_limit = 20", "conditioning_limit = 0", "workspace.conditioning_limit", []),
        ("[noise]", "[nois]", "nois", ['"noise"']),
        ("[noise]", "[[noise]]", "noise", ["not a table"]),
        ('group = "C3"', 'elements = "r0"\ngroup = "C3"', "symmetry.elements", ["not a list"]),
        ("legs = 3", 'legs = "3"', "symmetry.legs", ["is '3'", "integer"]),
    ],
)
def test_a_wrong_value_is_refused_at_its_line(
    refused: Refused, paper_text: str, old: str, new: str, key: str, words: list[str]
) -> None:
    assert old in paper_text
    refused(paper_text.replace(old, new, 1), new, key, *words)


def test_a_group_of_another_order_does_not_fit_the_number_of_legs(
    refused: Refused, paper_text: str
) -> None:
    text = paper_text.replace('"C3"', '"C5"')
    refused(text, "legs = 3", "symmetry.legs", "group C5", "to 5 legs", "has 3 legs")


@pytest.mark.parametrize(
    ("line", "table", "key"),
    [
        ("schema = 1\n", "# SPDX", "schema"),
        ('chain = "[R]RR"  # joints', "# SPDX", "chain"),
        ("legs = 3\n", "[symmetry]", "symmetry.legs"),
        ('group = "C3"\n', "[symmetry]", "symmetry.group"),
        ('base_angle = "210 deg"\n', "[reference_leg]", "reference_leg.base_angle"),
        ('phi = ["-0.4 rad", "0.9 rad"]\n', "[workspace]", "workspace.phi"),
    ],
)
def test_a_missing_key_is_named_at_its_table(
    refused: Refused, paper_text: str, line: str, table: str, key: str
) -> None:
    assert line in paper_text
    without = paper_text.replace(line, "#" if line.startswith("chain") else "", 1)
    refused(without, table, key, "missing")


def test_a_file_without_legs_says_what_is_missing(refused: Refused) -> None:
    refused('schema = 1\nchain = "[R]RR"\n', "schema", "reference_leg", "so are [[legs]]")


def test_a_reference_leg_needs_a_symmetry(refused: Refused, paper_text: str) -> None:
    text = paper_text.replace("[symmetry]", "[noise]", 1).replace('group = "C3"\nlegs = 3', "")
    text = text[: text.index("# The box")]
    refused(text, "# SPDX", "symmetry", "missing", "generates the other legs")


def test_a_reference_leg_beside_listed_legs_is_refused(
    refused: Refused, paper_text: str, listed_text: str
) -> None:
    text = paper_text + listed_text[listed_text.index("[[legs]]") :]
    refused(text, "[reference_leg]", "reference_leg", "beside [[legs]]")


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("base_angle = -0.5", "base_angel = -0.5", "legs[2].base_angel", ['"base_angle"']),
        ("platform_radius = 0.9", 'platform_radius = "1 deg"', "legs[2].platform_radius", []),
        ("1.7 m", "1.7 s", "legs[2].distal_length", ["unknown unit"]),
        ("1.7 m", "-1.7 m", "legs[2].distal_length", ["positive"]),
        ("0.2 mm", "-0.2 mm", "legs[2].distal_length", ["not negative"]),
        ("0.2 mm", "0.2 rad", "legs[2].distal_length", ["an angle"]),
        ("standard_deviation", "standard_devation", "legs[2].distal_length", ["did you mean"]),
        ("{ value", "{ values", "legs[2].distal_length", ["did you mean"]),
    ],
)
def test_a_fault_in_a_listed_leg_names_the_leg_and_its_line(
    refused: Refused, listed_text: str, old: str, new: str, key: str, words: list[str]
) -> None:
    refused(listed_text.replace(old, new), new, key, *words)


def test_a_group_that_the_listed_legs_do_not_have_is_refused_at_its_declaration(
    refused: Refused, listed_text: str
) -> None:
    text = listed_text.replace("[[legs]]  # left", '[symmetry]\ngroup = "C3"\n\n[[legs]]', 1)
    refused(text, "[symmetry]", "symmetry", "leg 1", "leg 2", "distal_length")


def test_a_group_that_the_listed_legs_have_is_kept(write: Write, paper: Mechanism) -> None:
    legs = ""
    for leg in paper.legs:
        legs += "[[legs]]\n" + "".join(f"{k} = {v}\n" for k, v in leg.parameters.items())
    text = 'schema = 1\nchain = "[R]RR"\n[symmetry]\ngroup = "C3"\n' + legs
    mechanism = load_mechanism(write(text))
    assert mechanism.symmetry is not None
    assert mechanism.symmetry.group == "C3"


def test_a_count_that_differs_from_the_listed_legs_is_refused(
    refused: Refused, listed_text: str
) -> None:
    text = listed_text.replace(
        "[[legs]]  # left", '[symmetry]\ngroup = "C3"\nlegs = 4\n[[legs]]', 1
    )
    refused(text, "legs = 4", "symmetry.legs", "is 4", "lists 3 legs")


def test_elements_must_be_as_many_as_the_legs(refused: Refused, paper_text: str) -> None:
    text = paper_text.replace("legs = 3", 'legs = 3\nelements = ["r0", "r1"]')
    refused(text, "elements", "symmetry.elements", "2 elements", "has 3 legs")


def test_an_element_that_the_group_does_not_have_is_refused(
    refused: Refused, paper_text: str
) -> None:
    text = paper_text.replace("legs = 3", 'legs = 3\nelements = ["r0", "r1", "s0"]')
    refused(text, "[symmetry]", "symmetry", "s0")


def test_a_home_that_is_left_out_is_the_origin_and_is_checked_too(
    refused: Refused, paper_text: str
) -> None:
    text = paper_text.replace('home = ["0 m"', '# home = ["0 m"').replace('"1.5 m"', '"1 m"')
    refused(text, "[workspace]", "workspace.home", "(0, 0, 0)", "legs 1, 2, 3")


@pytest.mark.parametrize(
    ("section", "line", "key", "words"),
    [
        ("lower = 1\nupper = 0", "lower", "joint_limits.lower", ["less than the upper limit"]),
        ("lower = 3", "[joint_limits]", "joint_limits", ["home pose", "legs 1, 2, 3"]),
        ('lower = "3 mm"', "lower", "joint_limits.lower", ["is a length"]),
        ("lower = [0, 1]", "lower", "joint_limits.lower", ["2 joint limits for 3 legs"]),
        ("lower = [-9, 8, -9]\nupper = 7", "lower", "joint_limits.lower", ["of leg 2 is 8"]),
    ],
)
def test_impossible_joint_limits_are_refused(
    refused: Refused, paper_text: str, section: str, line: str, key: str, words: list[str]
) -> None:
    text = f"{paper_text}\n[joint_limits]\n{section}\n".replace("# The box encloses every", "#")
    if line == "lower":
        text = text.replace('"lower', "")
    refused(text, line, key, *words)


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ('position_unit = "mm"', 'position_unit = "deg"', "measurements", ["position_unit"]),
        ('reading_unit = "rev"', 'reading_unit = "mm"', "measurements", ["reading_unit"]),
        ('"position_x", ', "", "measurements", ["position", "2 columns", "expected 3"]),
        ('  "leg_length_3",\n', "", "measurements", ["readings", "5 columns", "expected 6"]),
        (
            "quaternion = [",
            'rotation_vector = ["a", "b", "c"]\nquaternion = [',
            "measurements",
            ["orientation by quaternion and rotation_vector"],
        ),
        (
            "quaternion = [",
            'angle = "phi"\nquaternion = [',
            "measurements",
            ["angle", "expected 0"],
        ),
        ("quaternion =", "quaternions =", "measurements.quaternions", ['"quaternion"']),
        ('reading_unit = "rad"', 'reading_unit = "deg"', "reading_unit", ["'rad' or 'm'"]),
        ('reading_unit = "rad"', "", "reference_leg.sensor_gain", ["a plain number"]),
    ],
)
def test_a_wrong_sensor_or_column_mapping_is_refused(
    write: Write, old: str, new: str, key: str, words: list[str]
) -> None:
    text = (Path(__file__).parents[3] / "mechanisms" / "hexapod_jugglebot.toml").read_text()
    assert old in text
    with pytest.raises(MechanismFileError) as error:
        load_mechanism(write(text.replace(old, new, 1)))
    assert error.value.key == key
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize("name", ["3RRR", "3RRR/"])
def test_a_folder_does_not_hide_a_shipped_mechanism(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "3RRR").mkdir()
    monkeypatch.chdir(tmp_path)
    assert load_mechanism(name).name == "3RRR"


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("schema = 1", "schema = true", "schema", ["is true; expected a whole number"]),
        ("schema = 1", "schema = 1.0", "schema", ["is 1.0; expected a whole number"]),
        ("schema = 1", 'schema = "' + "1" * 9999 + '"', "schema", ["expected 1"]),
        ("working_mode = -1", "working_mode = true", "reference_leg.working_mode",
         ["is true"]),
        ('group = "C3"', f'group = "C{"9" * 5000}"', "symmetry.group", ["at most 64"]),
        ('group = "C3"', 'group = "C65"', "symmetry.group", ["at most 64 rotations"]),
        ('group = "C3"', 'group = "C\u0663"', "symmetry.group", ["expected C"]),
        ("legs = 3", "legs = 1000", "symmetry.legs", ["less than or equal to 64"]),
        ('"1.5 m"', "1" + "0" * 400, "reference_leg.proximal_length", ["finite"]),
        ('"1.5 m"', '"(-1)**0.5"', "reference_leg.proximal_length", ["not real"]),
        ('"210 deg"', "210", "reference_leg.base_angle", ['write "210 deg"']),
        ('"pi/6 rad"', "30", "reference_leg.sensor_offset", ['write "30 deg"']),
        ('["-0.4 rad", "0.9 rad"]', "[-20, 50]", "workspace.phi", ['write "-20 deg"']),
        ("seed = 1", f"seed = {2**64}", "protocol.seed", ["less than or equal to"]),
        ("candidates = 30000", f"candidates = {10**400}", "protocol.candidates",
         ["less than or equal to"]),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused_at_its_line(
    refused: Refused, paper_text: str, old: str, new: str, key: str, words: list[str]
) -> None:
    assert old in paper_text
    text = paper_text.replace(old, new, 1)
    refused(text, new, key, *words)


@pytest.mark.parametrize("name", [r"a\u001b[31mb", r"a\nb", r"a\u202eb", r"a\u0000b"])
def test_a_name_that_a_terminal_would_not_show_as_it_is_is_refused(
    refused: Refused, paper_text: str, name: str
) -> None:
    old = next(line for line in paper_text.splitlines() if line.startswith("name ="))
    refused(paper_text.replace(old, f'name = "{name}"'), "name =", "name", "can be printed")


def test_a_mechanism_without_a_name_is_named_by_its_file_in_printed_characters(
    write: Write, listed_text: str
) -> None:
    assert load_mechanism(write(listed_text, "a\x1bb.toml")).name == r"a\x1bb"


def test_a_name_that_cannot_be_printed_is_refused_in_code_too(paper: Mechanism) -> None:
    with pytest.raises(MechanismError, match=r'the name "a\\nb" has characters'):
        paper.replace(name="a\nb")


def test_a_file_that_never_ends_is_refused(tmp_path: Path, paper_text: str) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    long = tmp_path / "long.toml"
    long.write_text(paper_text + "#" * 1_000_000)
    loop = tmp_path / "loop.toml"
    loop.symlink_to(loop)
    for path, words in (
        (pipe, "a device or a pipe"),
        (Path("/dev/zero"), "a device or a pipe"),
        (long, "expected at most 1000000"),
        (loop, "cannot be read: Too many levels"),
        (tmp_path / ("x" * 300), "cannot be read: File name too long"),
    ):
        with pytest.raises(MechanismFileError, match=words):
            load_mechanism(path)


def test_each_leg_may_have_limits_of_its_own(paper_text: str, write: Write, tmp_path: Path) -> None:
    text = paper_text + '\n[joint_limits]\nlower = [-3, "-170 deg", -inf]\nupper = "170 deg"\n'
    robot = load_mechanism(write(text))
    upper = np.radians(170)
    expected = [[-3.0, -upper, -np.inf], [upper, upper, upper]]
    np.testing.assert_allclose(robot.reading_limits, expected)
    save_mechanism(robot, tmp_path / "again.toml")
    assert load_mechanism(tmp_path / "again.toml").joint_limits == robot.joint_limits
    least = robot.sample_workspace(2000, seed=1).readings.min(axis=0)
    others = JointLimits((-np.inf, least[1] + 0.2, -np.inf))
    found = robot.replace(joint_limits=others).sample_workspace(2000, seed=1).readings.min(axis=0)
    assert found[1] > least[1] + 0.2
    assert found[0] < least[0] + 0.2
