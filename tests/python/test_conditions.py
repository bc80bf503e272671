# SPDX-License-Identifier: MIT
"""The paper's conditions, tested numerically."""

from pathlib import Path

import pytest

import symkin
from symkin.analysis.conditions import check_conditions
from symkin.planning.simulation import disturb

DECLARED = Path(__file__).parents[2] / "mechanisms/declared"


def failing(conditions):
    return [(item.section, item.number) for item in conditions.conditions if not item.holds]


def test_the_paper_mechanism_meets_all_conditions(paper):
    conditions = check_conditions(paper, count=3000)
    assert failing(conditions) == []
    assert conditions.structure == "D_6"
    assert conditions.with_modes == "C_3"
    assert conditions.carriers == ("leg 1 by r0", "leg 1 by r1", "leg 1 by r2")
    assert [(item.section, item.number) for item in conditions.conditions] == [
        *((4, number) for number in range(1, 6)),
        *((5, number) for number in range(1, 8)),
    ]


def test_the_hexapod_meets_all_conditions_with_its_reflections(hexapod):
    conditions = check_conditions(hexapod, count=2000)
    assert failing(conditions) == []
    assert conditions.with_modes == "D_6"


def test_more_legs_than_degrees_of_freedom_fail_the_first_condition_alone():
    assert failing(check_conditions(symkin.load_mechanism("4RRR"), count=2000)) == [(4, 1)]


def test_an_asymmetric_mechanism_fails_the_conditions_on_symmetry():
    failed = failing(check_conditions(symkin.load_mechanism("3RRR_asymmetric"), count=500))
    assert {(4, 4), (5, 1), (5, 2), (5, 7)} <= set(failed)
    assert (4, 1) not in failed


def test_unequal_gains_and_offsets_are_found(paper):
    parameters = paper.parameters.copy()
    parameters[1, -2] = 1.01
    unequal = paper.replace(symmetry=None).with_parameters(parameters)
    assert (5, 6) in failing(check_conditions(unequal, count=500))


def test_the_figures_of_a_nearly_symmetric_mechanism_tell_how_far_it_is_off(paper):
    made = disturb(paper, seed=2).replace(symmetry=None)
    conditions = check_conditions(made, count=2000)
    assert {(4, 4), (4, 5), (5, 1), (5, 2), (5, 6), (5, 7)} == set(failing(conditions))
    assert conditions.group.paper_name == "D_6"
    figures = {(item.section, item.number): item.figure for item in conditions.conditions}
    assert "nearly D_6" in figures[4, 4]
    mismatches, _, tested, *_ = figures[5, 2].split()
    assert 0 < int(mismatches) < 200
    assert tested == "10000"
    assert 1e-4 < float(figures[5, 7].split()[3]) < 0.1


def test_encoders_that_all_have_their_zero_along_x_fail_the_conditions_on_sensors_alone(paper):
    parameters = paper.parameters.copy()
    parameters[:, -1] = 0
    conditions = check_conditions(paper.with_parameters(parameters), count=500)
    assert failing(conditions) == [(4, 5), (5, 7)]
    assert (conditions.structure, conditions.with_modes) == ("D_6", "C_3")
    assert conditions.carriers == ("leg 1 by r0", "leg 1 by r1", "leg 1 by r2")
    for condition in conditions.conditions:
        if not condition.holds:
            assert condition.figure.endswith("; only sensor_offset differs")


def test_unequal_gains_fail_the_conditions_on_sensors_alone(paper):
    parameters = paper.parameters.copy()
    parameters[:, -2] = 1, 1.1, 1.2
    conditions = check_conditions(paper.with_parameters(parameters), count=500)
    assert failing(conditions) == [(4, 5), (5, 6), (5, 7)]
    assert conditions.structure == "D_6"


def test_conditions_that_no_mechanism_can_fail_say_so(paper):
    for mechanism in (paper, symkin.load_mechanism("5bar")):
        figures = {
            (item.section, item.number)
            for item in check_conditions(mechanism, count=100).conditions
            if "by construction" in item.figure
        }
        assert figures == {(4, 2), (5, 3), (5, 4), (5, 5)}


def test_conditions_fail_for_legs_that_are_not_what_they_ask_for():
    """Two closures a leg, and points in frames that a declared leg has of its own."""
    own = symkin.load_mechanism(DECLARED / "3RRR_four_bar.toml")
    for robot, failed in ((symkin.load_mechanism("3RPS"), {3}), (own, {4, 5})):
        found = [
            each for each in check_conditions(robot, count=100).conditions if each.section == 5
        ]
        assert {each.number for each in found if not each.holds} & {3, 4, 5} == failed
        for each in found:
            assert ("by construction" in each.figure) == (each.number in {3, 4, 5} - failed)
    (text,) = (
        each.text
        for each in check_conditions(symkin.load_mechanism("linear_delta"), count=100).conditions
        if (each.section, each.number) == (5, 4)
    )
    assert text == "base points in cylindrical coordinates"


def test_a_structure_whose_every_symmetry_flips_the_modes_has_no_symmetric_readings(paper):
    parameters = paper.parameters.copy()
    parameters[1, 1] += 0.4  # leaves the reflection that carries leg 2 onto itself
    mirrored = paper.replace(symmetry=None).with_parameters(parameters)
    conditions = check_conditions(mirrored, count=200).conditions
    found = {(item.section, item.number): item for item in conditions}
    assert found[4, 4].holds
    assert not found[5, 7].holds
    assert "no element but the identity keeps the working modes" in found[5, 7].figure


def test_a_larger_group_that_is_near_does_not_spoil_the_one_that_is_exact(paper):
    offset = paper.parameter_names.index("sensor_offset")
    parameters = paper.parameters.copy()
    # The same on every leg: the sensors keep C3, which keeps the modes, and lose the mirrors.
    parameters[:, offset] += 0.001
    turned = paper.with_parameters(parameters)
    assert symkin.detect_symmetry(turned).structure.name == "D_3"
    assert failing(check_conditions(turned, count=1000)) == []


def test_a_workspace_is_needed(paper):
    with pytest.raises(symkin.SymkinError, match="workspace"):
        check_conditions(paper.replace(workspace=None))
