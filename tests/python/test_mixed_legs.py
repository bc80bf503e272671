# SPDX-License-Identifier: MIT
"""Legs of different chains in one mechanism."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import symkin
from symkin.analysis.observability import analyse_observability
from symkin.errors import FailedFitError, MechanismError, MechanismFileError, SymkinError
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import core_setup, layout_of
from symkin.exports.reading import import_mechanism
from symkin.files.mechanism_file import load_columns
from symkin.files.mechanism_schema import mechanism_schema
from symkin.files.template import mechanism_template
from symkin.model.chains import ABSENT
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.settings import DeclaredSymmetry, ProtocolSettings
from symkin.model.symmetry import generate_orbits, leg_carriers, map_poses
from symkin.model.tolerances import parameter_tolerances
from symkin.show.mechanism import movable_data


@pytest.fixture(scope="module")
def planar() -> Mechanism:
    """The mechanism with two kinds of legs that is shipped."""
    return symkin.load_mechanism("2RRR_PRP")


@pytest.fixture(scope="module")
def spatial(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """Three struts and three sliders, without symmetry."""
    path = tmp_path_factory.mktemp("spatial") / "hexapod.toml"
    path.write_text(mechanism_template("3 U[P]S + 3 [P]US"), encoding="utf-8")
    drawn = symkin.load_mechanism(path)
    values = drawn.parameters.copy()
    values[:, drawn.parameter_names.index("base_radius")] += [0, 0.01, 0.03, 0, 0.02, 0.05]
    made = drawn.with_parameters(values)
    assert leg_carriers(made)[1][0] == 1
    return made


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
    symkin.save_mechanism(made, path, overwrite=True)
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
    symkin.save_mechanism(made, tmp_path / "orbits.toml")
    assert (tmp_path / "orbits.toml").read_text().count("[[reference_legs]]") == 2
    assert symkin.load_mechanism(tmp_path / "orbits.toml") == made


@pytest.mark.parametrize(
    ("found", "instead", "message"),
    [
        ('chain = "[P]RP"', 'chain = "[P]RR"', r"reference_legs\[2\].distal_length: this key is"),
        ('chain = "[P]RP"', 'chain = "[P]RQ"', r"reference_legs\[2\].chain: unknown chain"),
        ('chain = "[P]RP"', "chain = 3", r"reference_legs\[2\].chain: is 3; expected text"),
        ('chain = "[P]RP"\n', "", r"reference_legs\[2\].chain: this key is missing"),
        ('chain = "[P]RP"', 'chain = "U[P]S"', r"reference leg 2 .* carries a spatial platform"),
        (
            'reading_unit = "rad"',
            "",
            "reading_unit: .*in reference leg 1.* in m in reference leg 2",
        ),
        ("[[reference_legs]]", "[[legs]]", "legs: .*has 2 legs; a planar platform has 3"),
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


def turned(apart: np.ndarray[Any, np.dtype[np.float64]]) -> Any:
    """Differences, angles by the shortest turn; no length is near a turn."""
    return np.remainder(apart + 1, 2 * math.pi) - 1


def test_points_beside_a_guide_are_given_about_the_origin(
    tmp_path: Path, planar: Mechanism
) -> None:
    text = shipped_text(planar).replace('base_radius = "0.4 m"\nbase_angle = "230 deg"', "{}")
    radius, angle = 0.4, math.radians(230)
    at = [radius * math.cos(angle), radius * math.sin(angle)]
    made = read(tmp_path, text.replace("{}", f"base_point = {at}"))
    np.testing.assert_allclose(turned(made.parameters - planar.parameters), 0, atol=1e-12)
    assert made.points is not None
    assert made.points.base == (0.0, 0.0)
    calibrated = made.replace(symmetry=None, deviations=np.full(made.parameters.shape, 1e-4))
    calibrated.save(tmp_path / "calibrated.toml")
    again = symkin.load_mechanism(tmp_path / "calibrated.toml")
    np.testing.assert_allclose(turned(again.parameters - made.parameters), 0, atol=1e-12)
    assert (tmp_path / "calibrated.toml").read_text().count("base_point = ") == 2
    centred = text.replace("{}", f"base_point = {at}") + "[frames]\nbase_centre = [0.1, 0]\n"
    with pytest.raises(MechanismFileError, match=r"base_centre: .*leg 2 \(\[P\]RP\) has a guide"):
        read(tmp_path, centred)


def test_a_column_mapping_is_found_in_a_file_without_a_chain_at_the_top(
    tmp_path: Path, planar: Mechanism
) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(shipped_text(planar) + '[measurements]\nposition = ["x", "y"]\nangle = "a"\n'
                    'readings = ["1", "2", "3"]\n')  # fmt: skip
    assert load_columns(path).readings == ("1", "2", "3")


def test_the_leg_on_the_mirror_gets_poses_of_its_own(planar: Mechanism) -> None:
    robot = small(planar)
    assert [(leg, element.label) for leg, element in leg_carriers(robot)] == [
        (0, "r0"), (0, "s0"), (2, "r0"),
    ]  # fmt: skip
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot), 12)
    assert plan.basis is not None
    told = [(choice.legs, choice.elements) for choice in plan.basis.choices]
    assert told == [((0, 1), ("r0", "s0")), ((2,), ("r0",))]
    sets = [plan.poses[plan.rows_of(leg)] for leg in range(3)]
    np.testing.assert_allclose(map_poses(robot, "s0", sets[0]), sets[1], atol=1e-12)
    # Eq. 10: what the mapped poses show of leg 2 is what those of leg 1 show of that.
    first, second = (analyse_observability(robot, leg, sets[leg]) for leg in (0, 1))
    np.testing.assert_allclose(first.r_diagonal, second.r_diagonal, rtol=1e-9)


def test_a_mirror_that_turns_a_leg_into_its_other_mode_carries_no_poses() -> None:
    slider = {"distal_length": 0.3, "base_radius": 0.2, "base_angle": math.pi / 2}
    slider |= {"platform_radius": 0, "platform_angle": 0, "sensor_gain": 1, "sensor_offset": 0}
    mirror = DeclaredSymmetry("D1", axis=math.pi / 2)
    legs = generate_orbits([crank(0), Leg("[P]RR", slider)], mirror)
    assert len(legs) == 3
    robot = Mechanism("2RRR_PRR", legs, reading_unit="rad", symmetry=mirror)
    found = symkin.detect_symmetry(robot)
    assert (found.structure.name, found.with_modes.name) == ("D_1", "C_1")
    assert [(leg, element.label) for leg, element in leg_carriers(robot)] == [
        (0, "r0"), (1, "r0"), (2, "r0"),
    ]  # fmt: skip


def test_no_orbit_of_poses_serves_legs_of_different_chains(planar: Mechanism) -> None:
    robot = small(planar)
    sample = symkin.sample_workspace(robot)
    with pytest.raises(SymkinError, match="legs that are not images of leg 1"):
        symkin.make_plan(robot, sample, 12, design="orbits")
    plan = symkin.make_plan(robot, sample, 12, design="mechanism")
    assert plan.basis is not None
    chosen = plan.basis.choices[0].selection
    assert len(plan.poses[~plan.spare]) == 12
    assert np.isfinite(chosen.log_det)


def test_the_check_says_that_the_legs_are_of_two_kinds(planar: Mechanism) -> None:
    result = small(planar).check()
    assert result.comparison.verdict == "exact"
    assert result.orbits == ((0, 1), (2,))
    assert "of 2 kinds (legs 1, 2; leg 3)" in result.verdict
    assert not result.blind
    assert result.conditions is not None
    conditions = {(each.section, each.number): each for each in result.conditions.conditions}
    assert [key for key, each in conditions.items() if not each.holds] == [(4, 2)]
    assert conditions[4, 2].figure == "3 legs, 2 [R]RR + 1 [P]RP"
    text = result.text()
    assert "proximal_length" in text
    leg = json.loads(json.dumps(result.to_dict()))["legs"][2]
    assert leg["chain"] == "[P]RP"
    assert leg["parameters"].keys() == planar.legs[2].parameters.keys()


@pytest.mark.parametrize("estimator", ["paper", "inverse", "implicit", "joint"])
@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_every_estimator_finds_the_robot(
    name: str, estimator: Any, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    nominal = small(request.getfixturevalue(name))
    plan = symkin.make_plan(nominal, symkin.sample_workspace(nominal), seed=1)
    made = symkin.simulate(nominal, plan, seed=3)
    found = symkin.identify(nominal, made.measurements, estimator)
    assert found.trustworthy
    after = symkin.evaluate(found.mechanism, actual=made.actual, poses=plan.poses[::7])
    before = symkin.evaluate(nominal, actual=made.actual, poses=plan.poses[::7])
    assert after.position_rms < before.position_rms / 3
    absent = ~nominal.has_parameter
    assert (found.mechanism.parameters[absent] == 0).all()
    assert [leg for leg, _ in leg_carriers(nominal)] == (
        [0, 0, 2] if name == "planar" else list(range(6))
    )
    assert (made.actual.parameters[absent] == 0).all()
    assert found.mechanism.deviations is not None
    assert np.isnan(found.mechanism.deviations[absent]).all()
    found.write(tmp_path / "found")
    again = symkin.load_mechanism(tmp_path / "found" / "calibrated.toml")
    assert again.chains == nominal.chains
    np.testing.assert_allclose(again.parameters, found.mechanism.parameters, rtol=1e-12)


def test_a_table_of_parameters_has_no_row_for_one_that_a_leg_lacks(planar: Mechanism) -> None:
    nominal = small(planar)
    plan = symkin.make_plan(nominal, symkin.sample_workspace(nominal), seed=1)
    made = symkin.simulate(nominal, plan, seed=3)
    found = symkin.identify(nominal, made.measurements, "implicit")
    columns = found.columns()
    named = columns["name"]
    assert "leg1.proximal_length" in named
    assert "leg3.proximal_length" not in named
    assert len(named) == 8 + 8 + 6
    units = dict(zip(named, columns["unit"], strict=True))
    assert (units["leg1.sensor_gain"], units["leg3.sensor_gain"]) == ("", "m/rad")
    many = symkin.identify_many(nominal, [made.measurements])
    assert "proximal_length_1_m" in many.columns()
    assert "proximal_length_3_m" not in many.columns()
    assert many.verdicts == ("fits",)


def test_positions_alone_identify_both_kinds_of_legs(planar: Mechanism) -> None:
    nominal = small(planar)
    plan = symkin.make_plan(
        nominal, symkin.sample_workspace(nominal), 40, design="mechanism", observe="position",
        prior="tolerances",
    )  # fmt: skip
    made = symkin.simulate(nominal, plan, seed=5, observe="position")
    found = symkin.identify(nominal, made.measurements, prior="tolerances")
    assert found.trustworthy
    names = set(found.names)
    assert "leg1.distal_length" in names
    assert "leg3.distal_length" not in names
    before = symkin.evaluate(nominal, actual=made.actual, poses=plan.poses)
    after = symkin.evaluate(found.mechanism, actual=made.actual, poses=plan.poses)
    assert after.position_rms < before.position_rms / 3


def layout(mechanism: Mechanism, **options: Any) -> Any:
    readings = mechanism.inverse_kinematics(mechanism.home[None])
    return layout_of(
        mechanism, core_setup(mechanism), EstimateOptions(**options),
        readings,
    )  # fmt: skip


def test_what_is_shared_means_the_same(planar: Mechanism, spatial: Mechanism) -> None:
    names = layout(planar, shared=("*",)).names
    assert "proximal_length" in names
    assert {"leg1+leg2.base_radius", "leg3.base_radius"} <= set(names)
    assert {"leg1+leg2.sensor_gain", "leg3.sensor_gain"} <= set(names)
    # A radius beside a polar angle is another one than beside a height.
    names = layout(spatial, shared=("platform_radius",)).names
    assert {"leg1+leg2+leg3.platform_radius", "leg4+leg5+leg6.platform_radius"} <= set(names)


def test_what_no_leg_has_is_no_unknown(planar: Mechanism) -> None:
    with pytest.raises(SymkinError, match=r'"leg3.proximal_length" matches no unknown'):
        layout(planar, fixed=("leg3.proximal_length",))


def test_columns_in_the_wrong_order_are_recognised(planar: Mechanism) -> None:
    nominal = small(planar)
    plan = symkin.make_plan(nominal, symkin.sample_workspace(nominal), seed=1)
    made = symkin.simulate(nominal, plan, seed=3).measurements
    swapped = dataclasses.replace(made, readings=made.readings[:, [0, 2, 1]])
    with pytest.raises(FailedFitError, match="readings of legs 2, 3 are in the columns of legs 3"):
        symkin.identify(nominal, swapped, "implicit")


def test_exports_say_what_a_leg_does_not_have(planar: Mechanism) -> None:
    document = json.loads(symkin.export(planar, "json").text)
    assert [leg["chain"] for leg in document["legs"]] == list(planar.chains)
    assert "proximal_length" not in document["legs"][2]["parameters"]
    assert document["legs"][2]["parameters"]["sensor_gain"]["unit"] == "m/rad"
    header = symkin.export(planar, "c-header").text
    assert "#include <math.h>" in header
    assert "2RRR_PRP_proximal_length[3] = {0.22, 0.22, NAN};" in header
    assert '_chain[3] = {"[R]RR", "[R]RR", "[P]RP"};' in header
    assert re.search(r"sensor_gain\[3\] = .*/\* 1, 1, m/rad \*/", header)
    other = planar.replace(legs=[*planar.legs[:2], symkin.load_mechanism("3RRP").legs[0]])
    with pytest.raises(SymkinError, match=r'not written for chain "\[R\]RP" \(leg 3\)'):
        symkin.export(other, "urdf")


def test_a_model_has_each_leg_by_its_own_chain(spatial: Mechanism, tmp_path: Path) -> None:
    for kind in ("mjcf", "urdf"):
        path = tmp_path / f"robot.{kind}"
        path.write_text(symkin.export(spatial, kind).text)
        again = import_mechanism(path).mechanism
        assert again.chains == spatial.chains
        poses = symkin.sample_workspace(spatial, 50).poses
        np.testing.assert_allclose(
            again.inverse_kinematics(poses), spatial.inverse_kinematics(poses), atol=1e-9
        )
    assert symkin.export(spatial, "sdf").text


def test_pages_leave_cells_empty_where_a_leg_has_no_parameter(
    planar: Mechanism, tmp_path: Path
) -> None:
    nominal = small(planar)
    result = symkin.run_protocol(nominal)
    page = result.report(tmp_path / "report.html").read_text(encoding="utf-8")
    assert "2 [R]RR + 1 [P]RP" in page
    lines = [line.split() for line in nominal.check().text().splitlines()]
    assert ["proximal_length,", "mm", "220", "220", "-"] in lines


def test_legs_may_have_different_numbers_of_inner_joints(spatial: Mechanism) -> None:
    data = movable_data(spatial)
    assert data["inner"] == [0, 0, 0, 1, 1, 1]
    assert [len(each) for each in data["joints"]] == [3] * 6
    nodes = math.prod(len(axis["values"]) for axis in data["axes"])
    assert len(data["nodes"]) == nodes * (3 + 2 * 3 * 3)


@pytest.mark.parametrize(
    "chains",
    [
        "2 [R]RR + 1 [P]RP",
        "2 [R]RR + [P]RR",
        "1 R[P]R + 2 [R]RR + [P]RR",
        "3 U[P]S + 3 [P]US",
        "4 [R]US + 2 U[P]S",
    ],
)
def test_a_mixed_template_is_a_mechanism_with_a_workspace(tmp_path: Path, chains: str) -> None:
    mechanism = read(tmp_path, mechanism_template(chains))
    assert mechanism.mixed
    assert mechanism.protocol.pose_count == 3 * max(mechanism.estimated_counts)
    assert not mechanism.check().blind


def test_the_numbers_of_a_template_are_said_once() -> None:
    assert mechanism_template("3 [R]RR") == mechanism_template("[R]RR", 3)
    with pytest.raises(MechanismError, match="has 3 legs, not 4"):
        mechanism_template("3 [R]RR", 4)
    with pytest.raises(MechanismError, match="expected no other number"):
        mechanism_template("2 [R]RR + [P]RR", 3)
    with pytest.raises(MechanismError, match="2 legs for a planar platform; expected 3 to 64"):
        mechanism_template("[R]RR + [P]RR")
    with pytest.raises(MechanismError, match="twice"):
        mechanism_template("2 [R]RR + [R]RR")


def test_a_mixed_leg_of_the_schema_names_its_chain() -> None:
    mixed = [each for each in mechanism_schema()["anyOf"] if "enum" in each["properties"]["chain"]]
    legs = mixed[0]["properties"]["legs"]["items"]["anyOf"]
    own = itertools.chain(*(leg.get("anyOf", [leg]) for leg in legs))
    chains = {leg["properties"]["chain"]["const"] for leg in own}
    assert {"[R]RR", "[P]RP"} <= chains
