# SPDX-License-Identifier: MIT
"""Every known chain, written joint by joint, is the same leg."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.model.chains import chain_info
from symkin.model.declared import declare, declared_chain

ITEMS = {
    "R": '"R"',
    "P": '"P y"',
    "Px": '"P x"',
    "[R]": '"q: [R]"',
    "[P]": '"q: [P] y"',
    "[Px]": '"q: [P] x"',
    "l": '{ name = "proximal", x = "0.9 m" }',
    "L": '{ name = "distal", x = "1.3 m" }',
    "e": '{ name = "guide", x = "0.2 m" }',
}
# The path of each, the sense in which the declared joint turns, and its zero in the known one's:
# the latter counts directions from x of the base or the platform.
LEGS = {
    "[R]RR": ("[R] l R L R", 1, "base"),
    "R[R]R": ("R l [R] L R", 1, ""),
    "RR[R]": ("R L R l [R]", -1, "platform, behind"),
    "[R]PR": ("[R] e P R", 1, "base"),
    "R[P]R": ("R [Px] R", 1, ""),
    "RP[R]": ("R P e [R]", -1, "platform, behind"),
    "[P]RR": ("[P] R L R", 1, ""),
    "P[R]R": ("P [R] L R", 1, "base"),
    "PR[R]": ("P R L [R]", -1, "platform, behind"),
    "[R]RP": ("[R] l R P", 1, "base"),
    "R[R]P": ("R l [R] P", -1, "platform"),
    "RR[P]": ("R L R [P]", -1, ""),
    "[P]RP": ("[P] R P", 1, ""),
    "PR[P]": ("P R [P]", -1, ""),
    "[P]PR": ("[Px] P R", 1, ""),
    "P[P]R": ("P [Px] R", 1, ""),
    "R[P]P": ("R [Px] P", -1, ""),
    "RP[P]": ("R P [Px]", -1, ""),
}
DRAWN = {
    "proximal_length": 0.9, "distal_length": 1.3, "guide_offset": 0.2, "base_radius": 1.1,
    "base_angle": 3.5, "platform_radius": 0.4, "platform_angle": 4.3, "sensor_gain": 1.0,
    "sensor_offset": 0.0,
}  # fmt: skip
OWN = {
    "proximal_length": "proximal_x", "distal_length": "distal_x", "guide_offset": "guide_x",
    "base_radius": "base_x", "base_angle": "base_azimuth", "platform_radius": "platform_x",
    "platform_angle": "platform_azimuth", "sensor_gain": "sensor_gain",
    "sensor_offset": "sensor_offset",
}  # fmt: skip
ONE_ROOT = {"R[P]R", "[P]RP", "PR[P]", "[P]PR", "P[P]R", "R[P]P", "RP[P]"}
HOME = np.array([[0.05, 0.1, 0.1]])
FILE = """\
schema = 1
name = "declared"
chain = "leg"
platform = "{platform}"
[chains.leg]
path = [{path}]
home = {{ q = {home} }}
[symmetry]
group = "C3"
legs = 3
[workspace]
{box}
"""


def known_leg(chain: str, platform: str, values: dict[str, float], mode: int) -> symkin.Mechanism:
    names = chain_info(chain, platform).parameter_names
    leg = symkin.Leg(chain, {name: values[name] for name in names}, mode)
    return symkin.Mechanism(chain, [leg] * 3, platform=platform)


def own_values(chain: str, values: dict[str, float]) -> dict[str, float]:
    """The known leg's values as the declared one has them."""
    _, sense, zero = LEGS[chain]
    own = {OWN[name]: value for name, value in values.items()}
    own["sensor_gain"] *= sense
    turned = own["platform_azimuth"] if zero.startswith("platform") else 0.0
    turned -= own["base_azimuth"] if zero == "base" else 0.0
    own["sensor_offset"] = sense * own["sensor_offset"] + turned - np.pi * zero.endswith("behind")
    return own


def declared_leg(chain: str, platform: str, mode: int, folder: Path) -> symkin.Mechanism:
    dof = 3 if platform == "rigid" else 2
    reading = known_leg(chain, platform, DRAWN, mode).inverse_kinematics(HOME[:, :dof])[0, 0]
    own = own_values(chain, DRAWN)
    path = [ITEMS[each] for each in LEGS[chain][0].split()]
    names = chain_info(chain, platform).parameter_names
    for end in ("base", "platform"):
        if f"{end}_angle" in names:
            radius = f", x = {DRAWN[f'{end}_radius']}" if f"{end}_radius" in names else ""
            item = f'{{ name = "{end}", azimuth = {DRAWN[f"{end}_angle"]}{radius} }}'
            path.insert(0 if end == "base" else len(path), item)
    coordinates = ("x", "y", "phi")[:dof]
    box = "".join(f"{each} = [-0.2, 0.2]\n" for each in coordinates)
    joint = own["sensor_gain"] * reading + own["sensor_offset"]
    file = folder / "declared.toml"
    file.write_text(
        FILE.format(
            platform=platform, path=", ".join(path), home=float(joint),
            box=f"{box}home = {[float(each) for each in HOME[0, :dof]]}",
        )
    )  # fmt: skip
    mechanism = symkin.load_mechanism(file)
    declared = declared_chain(mechanism.chains[0])
    assert declared is not None
    name = declare(dataclasses.replace(declared, recognise=False))
    legs = [symkin.Leg(name, each.parameters, each.working_mode) for each in mechanism.legs]
    return mechanism.replace(legs=legs, symmetry=None)


CASES = [
    (chain, platform, mode)
    for platform in ("rigid", "point")
    for chain in symkin.chains(platform)
    if chain_info(chain, platform).pose_space in ("planar", "point")
    for mode in (1, -1)[: 1 + (chain not in ONE_ROOT)]
]


def test_every_known_chain_of_the_plane_is_written_here() -> None:
    assert {chain for chain, *_ in CASES} == {*LEGS}


@pytest.mark.parametrize(("chain", "platform", "mode"), CASES)
def test_a_chain_written_joint_by_joint_has_its_zeros_and_its_rows(
    chain: str, platform: str, mode: int, tmp_path: Path
) -> None:
    drawn = declared_leg(chain, platform, mode, tmp_path)
    random = np.random.default_rng(3)
    poses = HOME + random.uniform(-0.1, 0.1, (8, 3))
    at = poses if platform == "rigid" else poses[:, :2]
    for _ in range(3):
        values = {name: value * random.uniform(0.95, 1.05) for name, value in DRAWN.items()}
        values["sensor_offset"] = random.uniform(-0.3, 0.3)
        compare(chain, platform, mode, drawn, values, at)


def compare(
    chain: str,
    platform: str,
    mode: int,
    drawn: symkin.Mechanism,
    values: dict[str, float],
    poses: np.ndarray,
) -> None:
    """Hold readings and derivatives of the two legs equal."""
    known, own = known_leg(chain, platform, values, mode), own_values(chain, values)
    columns = {name: drawn.parameter_names.index(OWN[name]) for name in known.parameter_names}
    parameters = drawn.parameters.copy()
    for name, column in columns.items():
        parameters[:, column] = own[OWN[name]]
    leg = drawn.with_parameters(parameters)
    expected, found = (each.inverse_kinematics(poses)[:, 0] for each in (known, leg))
    apart, gain = found - expected, values["sensor_gain"]
    turns = 2 * np.pi / gain * (chain_info(chain, platform).reading_unit == "rad")
    whole = np.round(apart / turns) * turns if turns else 0.0
    np.testing.assert_allclose(apart, whole, atol=1e-12)
    np.testing.assert_allclose(
        leg.pose_jacobian(poses)[:, 0], known.pose_jacobian(poses)[:, 0], atol=1e-11
    )
    # The declared leg's by the known one's parameters.
    rows, by_own = known.parameter_jacobian(0, poses), leg.parameter_jacobian(0, poses)
    _, sense, zero = LEGS[chain]
    for index, (name, column) in enumerate(columns.items()):
        by_name = by_own[:, column] * (sense if name.startswith("sensor") else 1)
        by_name = by_name + apart / gain * (name == "sensor_gain")
        if zero and name == f"{zero.split(',')[0]}_angle":
            by_name += by_own[:, -1] * (-1 if zero == "base" else 1)
        np.testing.assert_allclose(by_name, rows[:, index], atol=1e-10, err_msg=name)


BASE = '{ name = "base", azimuth = 0, x = "0.5 m", y = 0, z = 0 }'
END = '"S", { name = "platform", azimuth = 0, x = "0.5 m", y = 0, z = 0 }'
TILTS = 'z = [{low}, {high}]\nrx = [-0.2, 0.2]\nry = [-0.2, 0.2]\nfree = ["z", "rx", "ry"]\n'
POINTS = {
    "base_radius": "base_x", "base_azimuth": "base_y", "base_height": "base_z",
    "platform_radius": "platform_x", "platform_azimuth": "platform_y",
    "platform_height": "platform_z",
}  # fmt: skip
# Legs in space that test_recognised_chains has not, as the shipped mechanism has its first: path,
# home, box, and the declared leg's names of the known parameters.
IN_SPACE = {
    "3RPS": (
        f'{BASE}, "R y", "q: [P] z", {END}',
        TILTS.format(low=1.5, high=2) + "home = [1.75, 0, 0]",
        POINTS,
    ),
    "3PRS": (
        f'{BASE}, "q: [P] x", "R y", {{ name = "rod", x = "0.7 m" }}, {END}'.replace("0.5", "0.3"),
        TILTS.format(low=0.42, high=0.6) + "home = [0.52, 0, 0]",
        POINTS | {"distal_length": "rod_x"},
    ),
    "agile_eye": (
        '{ name = "base", azimuth = 0, pitch = "acos(1 / sqrt(3))", ry = 0 }, "q: [R] z", '
        '{ name = "proximal", pitch = "90 deg", ry = 0 }, "R z", '
        '{ name = "distal", pitch = "90 deg", ry = 0 }, "R z", '
        '{ name = "platform", azimuth = "120 deg", pitch = "acos(1 / sqrt(3))", ry = 0 }',
        "".join(f"{each} = [-0.4, 0.4]\n" for each in ("rx", "ry", "rz")) + "home = [0, 0, 0]",
        {
            "base_polar_angle": "base_ry", "proximal_arc": "proximal_ry",
            "distal_arc": "distal_ry", "platform_polar_angle": "platform_ry",
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(IN_SPACE))
def test_a_leg_in_space_has_the_readings_and_the_row_space_of_its_chain(
    name: str, tmp_path: Path
) -> None:
    path, box, names = IN_SPACE[name]
    known = symkin.load_mechanism(name)
    home = known.inverse_kinematics(known.home[None])[0, 0]
    platform = known.platform
    file = tmp_path / "declared.toml"
    file.write_text(FILE.format(platform=platform, path=path, home=float(home), box=box))
    leg = symkin.load_mechanism(file)
    poses = symkin.sample_workspace(known, 20, seed=2).poses
    readings = known.inverse_kinematics(poses)
    np.testing.assert_allclose(leg.inverse_kinematics(poses)[:, 0], readings[:, 0], atol=1e-12)
    rows, by_own = (_core.linearise(each.core, 0, poses, readings[:, 0]) for each in (known, leg))
    drawn = known.legs[0].parameters
    theirs, ours = [rows.by_pose, rows.by_reading], [by_own.by_pose, by_own.by_reading]
    for each, own in (names | {each: each for each in ("sensor_gain", "sensor_offset")}).items():
        turned = drawn[each.replace("azimuth", "radius")] if each.endswith("azimuth") else 1.0
        theirs.append(np.asarray(rows.by_parameters)[:, known.parameter_names.index(each)] / turned)
        ours.append(np.asarray(by_own.by_parameters)[:, leg.parameter_names.index(own)])
    first, second = (np.column_stack(each) for each in (theirs, ours))
    closures = known.closures
    assert closures == leg.closures
    for one, other in zip(
        first.reshape(len(poses), closures, -1), second.reshape(len(poses), closures, -1),
        strict=True,
    ):  # fmt: skip
        mixed = other @ np.linalg.pinv(one)
        assert np.linalg.cond(mixed) < 1e3
        np.testing.assert_allclose(mixed @ one, other, atol=1e-10)
