# SPDX-License-Identifier: MIT
"""Legs of different chains in one mechanism."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import symkin
from symkin.chains import ABSENT
from symkin.errors import MechanismError, MechanismFileError
from symkin.io.template import mechanism_template
from symkin.mechanism import Leg, Mechanism
from symkin.observability import parameter_tolerances
from symkin.settings import DeclaredSymmetry, ProtocolSettings
from symkin.symmetry import generate_orbits


@pytest.fixture(scope="module")
def planar() -> Mechanism:
    """The mechanism with two kinds of legs that is shipped."""
    return symkin.load_mechanism("2RRR_PRP")


@pytest.fixture(scope="module")
def spatial(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """Three struts and three sliders, without symmetry."""
    path = tmp_path_factory.mktemp("spatial") / "hexapod.toml"
    path.write_text(mechanism_template("3 U[P]S + 3 [P]US"), encoding="utf-8")
    return symkin.load_mechanism(path)


def small(mechanism: Mechanism) -> Mechanism:
    """With few candidates, and readings that have a noise."""
    protocol = ProtocolSettings(mechanism.protocol.pose_count, candidates=1500, seed=1)
    return mechanism.replace(protocol=protocol)


def test_a_leg_has_its_own_names_roles_and_units(planar: Mechanism) -> None:
    names = planar.parameter_names
    assert planar.chains == ("[R]RR", "[R]RR", "[P]RP")
    assert planar.chain == "2 [R]RR + 1 [P]RP"
    assert planar.mixed
    assert set(planar.legs[2].parameters) < set(names)
    absent = ~planar.has_parameter
    assert [names[i] for i in np.flatnonzero(absent[2])] == ["proximal_length", "distal_length"]
    assert not absent[:2].any()
    assert (planar.parameters[absent] == 0).all()
    roles = dict(zip(names, planar.parameter_roles(2), strict=True))
    assert roles["proximal_length"] == ABSENT
    assert roles["base_radius"] == ("base", "direction_distance")
    assert planar.parameter_roles(0)[names.index("base_radius")] == ("base", "radius")
    units = [dict(zip(names, planar.parameter_units(leg), strict=True)) for leg in (0, 2)]
    assert (units[0]["sensor_gain"], units[1]["sensor_gain"]) == ("", "m/rad")
    assert (units[0]["sensor_offset"], units[1]["sensor_offset"]) == ("rad", "m")
    assert planar.estimated_counts == (8, 8, 6)
    assert planar.least_poses == 8
    assert "distal_length" not in planar.estimated_names(2)


def test_the_core_has_the_columns_of_the_mechanism(planar: Mechanism) -> None:
    for leg, chain in enumerate(planar.straight.chains):
        told = [(each.end.name, each.kind.name) for each in chain.parameters]
        assert [each.name for each in chain.parameters] == list(planar.parameter_names)
        assert told == list(planar.parameter_roles(leg))
    assert (parameter_tolerances(planar)[~planar.has_parameter] == 0).all()


# --- The model refuses what it cannot mean ---


RRR = {
    "proximal_length": 0.4, "distal_length": 0.4, "base_radius": 0.5, "base_angle": 3.7,
    "platform_radius": 0.12, "platform_angle": 4.7, "sensor_gain": 1, "sensor_offset": 0,
}  # fmt: skip
PRP = {
    "base_radius": 0.2, "base_angle": 1.5, "platform_radius": 0, "platform_angle": 0,
    "sensor_gain": 1, "sensor_offset": 0,
}  # fmt: skip


def crank(turn: float) -> Leg:
    turned = {name: RRR[name] + turn for name in ("base_angle", "platform_angle")}
    return Leg("[R]RR", RRR | turned)


def test_a_mixture_of_angles_and_lengths_wants_the_unit_of_the_sensors() -> None:
    legs = [crank(0), crank(2), Leg("[P]RP", PRP)]
    expected = r"rad in leg 1 \(\[R\]RR\) and in m in leg 3 \(\[P\]RP\); expected reading_unit"
    with pytest.raises(MechanismError, match=expected):
        Mechanism("mixed", legs)
    assert Mechanism("mixed", legs, reading_unit="m").parameter_units(0)[-2:] == ("rad/m", "rad")


def test_legs_of_one_joint_unit_read_it() -> None:
    other = Leg("R[R]R", RRR)
    assert Mechanism("mixed", [crank(0), crank(2), other]).reading_unit == "rad"


def test_legs_of_other_platforms_are_refused() -> None:
    strut = symkin.load_mechanism("hexapod_jugglebot").legs[0]
    with pytest.raises(
        MechanismError, match=r"leg 3 \(U\[P\]S\) carries a spatial platform, leg 1"
    ):
        Mechanism("mixed", [crank(0), crank(2), strut], reading_unit="rad")


def test_legs_that_bind_the_platform_are_not_mixed() -> None:
    bound = symkin.load_mechanism("3RPS").legs[0]
    sliding = symkin.load_mechanism("3PRS").legs[0]
    with pytest.raises(MechanismError, match="legs that bind the platform are not mixed"):
        Mechanism("mixed", [bound, bound, sliding])


def test_a_robot_with_legs_in_another_order_is_another(planar: Mechanism) -> None:
    legs = planar.legs
    other = planar.replace(legs=[legs[0], legs[2], legs[1]], symmetry=None)
    with pytest.raises(MechanismError, match=r"\[R\]RR, \[P\]RP, \[R\]RR.*expected the same"):
        symkin.evaluate(planar, actual=other, poses=planar.home[None])


# --- Files ---


def read(tmp_path: Path, text: str) -> Mechanism:
    path = tmp_path / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return symkin.load_mechanism(path)


def shipped_text(planar: Mechanism) -> str:
    assert planar.source is not None
    return planar.source.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_a_mixed_mechanism_reads_back_from_what_is_written(
    tmp_path: Path, name: str, request: pytest.FixtureRequest
) -> None:
    mechanism = request.getfixturevalue(name)
    mechanism.save(tmp_path / "again.toml")
    assert symkin.load_mechanism(tmp_path / "again.toml") == mechanism
    text = (tmp_path / "again.toml").read_text()
    assert text.count("chain = ") == (2 if name == "planar" else 6)
    assert ("[[reference_legs]]  # leg 3" in text) == (name == "planar")


@given(data=st.data())
@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_calibrated_mixed_legs_read_back(data: Any, tmp_path: Path, planar: Mechanism) -> None:
    chains = data.draw(st.permutations(["[R]RR", "[R]RR", "[P]RP"]))
    values = st.floats(0.01, 2).map(lambda value: round(value, 6))
    legs = [
        Leg(
            chain,
            {name: data.draw(values) for name in symkin.chain_info(chain).parameter_names},
            data.draw(st.sampled_from([-1, 1])),
        )
        for chain in chains
    ]
    shape = 3, len(planar.parameter_names)
    deviations = np.full(shape, np.nan)
    if data.draw(st.booleans()):
        deviations = np.array(data.draw(st.lists(st.floats(0, 1e-2), min_size=24, max_size=24)))
    curved = data.draw(st.sampled_from([None, [[0, 0, 0], [1e-3, 0, 2e-4], [0, 1e-3, 0]]]))
    made = Mechanism(
        "mixed", legs, reading_unit=data.draw(st.sampled_from(["rad", "m"])), curvature=curved,
        deviations=None if np.isnan(deviations).all() else deviations.reshape(shape),
    )  # fmt: skip
    path = tmp_path / "mixed.toml"
    made.save(path, overwrite=True)
    again = symkin.load_mechanism(path)
    assert again == made
    assert again.chains == tuple(chains)


def test_the_chain_at_the_top_is_that_of_legs_without(tmp_path: Path, planar: Mechanism) -> None:
    text = shipped_text(planar).replace('chain = "[R]RR"  # joints', "# joints")
    text = text.replace("schema = 1", 'schema = 1\nchain = "[R]RR"')
    assert read(tmp_path, text).legs == planar.legs


def test_a_group_of_more_elements_makes_orbits_of_different_length() -> None:
    tripod = generate_orbits(
        [crank(0), Leg("[P]RP", PRP | {"base_angle": math.pi / 2})],
        DeclaredSymmetry("D3", axis=math.pi / 2),
    )
    assert [leg.chain for leg in tripod] == ["[R]RR"] * 6 + ["[P]RP"] * 3
    angles = [leg.parameters["base_angle"] for leg in tripod[6:]]
    np.testing.assert_allclose(np.diff(np.unwrap(angles)), 2 * math.pi / 3)


def test_two_orbits_of_one_chain_are_written_as_they_were_read(tmp_path: Path) -> None:
    first, second = crank(0), Leg("[R]RR", RRR | {"distal_length": 0.5})
    legs = generate_orbits([first, second], DeclaredSymmetry("C3"))
    made = Mechanism("two orbits", legs, symmetry=DeclaredSymmetry("C3"))
    made.save(tmp_path / "orbits.toml")
    assert (tmp_path / "orbits.toml").read_text().count("[[reference_legs]]") == 2
    assert symkin.load_mechanism(tmp_path / "orbits.toml") == made


@pytest.mark.parametrize(
    ("found", "instead", "message"),
    [
        ('chain = "[P]RP"', 'chain = "[P]RR"', r"reference_legs\[2\].distal_length: this key is"),
        ('chain = "[P]RP"', 'chain = "[P]RQ"', r"reference_legs\[2\].chain: .*\[P\]RP"),
        ('chain = "[P]RP"', "chain = 3", r"reference_legs\[2\].chain: is 3; expected text"),
        ('chain = "[P]RP"\n', "", r"reference_legs\[2\].chain: this key is missing"),
        ('chain = "[P]RP"', 'chain = "U[P]S"', "carries a spatial platform"),
        ('reading_unit = "rad"', "", "reading_unit: .*in rad in leg 1.* in m in leg"),
        ("[[reference_legs]]", "[[legs]]", r"symmetry: .*does not have the group D_1"),
        ('group = "D1"', 'group = "D1"\nlegs = 4', "is 4; the reference legs have 3 images"),
        ("platform_radius = 0", 'proximal_length = "1 m"', r"reference_legs\[2\].proximal_length"),
    ],
)
def test_a_fault_names_the_key_and_the_leg(
    tmp_path: Path, planar: Mechanism, found: str, instead: str, message: str
) -> None:
    text = shipped_text(planar)
    assert found in text
    with pytest.raises(MechanismFileError, match=message):
        read(tmp_path, text.replace(found, instead))


def test_points_beside_a_guide_are_given_about_the_origin(
    tmp_path: Path, planar: Mechanism
) -> None:
    text = shipped_text(planar).replace('base_radius = "0.4 m"\nbase_angle = "235 deg"', "{}")
    radius, angle = 0.4, math.radians(235)
    at = [radius * math.cos(angle), radius * math.sin(angle)]
    made = read(tmp_path, text.replace("{}", f"base_point = {at}"))
    np.testing.assert_allclose(made.parameters[0], planar.parameters[0] + 0.0, atol=1e-12)
    assert made.points is not None
    assert made.points.base == (0.0, 0.0)
    calibrated = made.replace(symmetry=None, deviations=np.full(made.parameters.shape, 1e-4))
    calibrated.save(tmp_path / "calibrated.toml")
    again = symkin.load_mechanism(tmp_path / "calibrated.toml")
    np.testing.assert_allclose(again.parameters, made.parameters, atol=1e-12)
    assert (tmp_path / "calibrated.toml").read_text().count("base_point") == 2
    centred = text.replace("{}", f"base_point = {at}") + "[frames]\nbase_centre = [0.1, 0]\n"
    with pytest.raises(MechanismFileError, match=r"base_centre: .*leg 2 \(\[P\]RP\) has a guide"):
        read(tmp_path, centred)


def test_a_column_mapping_is_found_in_a_file_without_a_chain_at_the_top(
    tmp_path: Path, planar: Mechanism
) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(shipped_text(planar) + '[measurements]\nposition = ["x", "y"]\nangle = "a"\n'
                    'readings = ["1", "2", "3"]\n')  # fmt: skip
    assert symkin.io.mechanism_file.load_columns(path).readings == ("1", "2", "3")
