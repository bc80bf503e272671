# SPDX-License-Identifier: MIT
"""Results are handled as those of other packages are: rows, names, figures, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError


@pytest.fixture(scope="module")
def robot() -> symkin.Robot:
    return symkin.load("3RRR")


@pytest.fixture(scope="module")
def measured(robot):
    return robot.simulate(robot.plan(10, candidates=300), seed=1).measurements


def test_measurements_have_rows_that_are_counted_and_chosen(measured):
    assert len(measured) == 30
    np.testing.assert_array_equal(measured[:4].readings, measured.readings[:4])
    np.testing.assert_array_equal(measured[[5, -1]].row_numbers, measured.row_numbers[[5, -1]])
    first = measured[measured.leg_sets == 0]
    assert len(first) == 10
    assert (first.leg_sets == 0).all()


@pytest.mark.parametrize("rows", [np.ones(4, bool), [99], "leg 1", [0.5], [[1]]])
def test_rows_that_there_are_not_are_refused(measured, rows):
    with pytest.raises(SymkinError):
        measured[rows]


def test_a_fleet_is_asked_for_a_robot_by_its_name_or_its_place(robot, measured):
    fleet = symkin.identify_many(robot, {"a": measured, "b": measured[::-1]})
    assert len(fleet) == 2
    assert fleet["a"]["robot"] == "a"
    assert fleet["b"]["verdict"] == fleet.verdicts[1]
    with pytest.raises(SymkinError, match='no robot is called "c"'):
        fleet["c"]
    assert fleet[0] == fleet["a"]
    assert fleet[-1] == fleet[np.intp(1)] == fleet["b"]
    assert list(fleet) == [fleet[0], fleet[1]]
    for wrong in (2, -3, 0.5, None, slice(2)):
        with pytest.raises(SymkinError, match="expected a name, or a place from 0 to 1"):
            fleet[wrong]


def test_the_errors_to_expect_at_the_poses_are_computed_once_for_a_page(robot, measured):
    found = robot.identify(measured)
    assert found.expected_at_poses is found.accuracy_at_poses
    assert found.expected_at_poses == found.expected_accuracy()
    supposed = robot.identify(measured, fixed=["sensor_gain"], assume={"sensor_gain": 1e-4})
    assert supposed.expected_at_poses == supposed.expected_accuracy()
    assert supposed.expected_at_poses.position > supposed.accuracy_at_poses.position


def test_a_result_draws_the_figures_of_its_page(robot, measured):
    found = robot.identify(measured)
    names = list(symkin.present.figures_of(found.page()))
    assert "residuals" in names
    assert found.plot("residuals") is not None
    assert found.plot() is not None
    assert robot.plot() is not None
    with pytest.raises(SymkinError, match=f"expected one of {names[0]}, "):
        found.plot("nothing of the kind")


def test_a_summary_is_read_as_text(robot, measured):
    text = str(robot.identify(measured).summary())
    assert text.splitlines()[0] == "3RRR: identification from measurements"
    assert "Position error" in text


def test_files_that_no_program_would_read_by_their_name_are_not_written(
    robot, measured, tmp_path: Path
):
    found = robot.identify(measured)
    for save in (found.save, robot.save, measured.save, robot.plan(10, candidates=300).save):
        with pytest.raises(SymkinError, match=r'name\.xlsx: "\.xlsx" is not what is written'):
            save(tmp_path / "name.xlsx")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("3RR", "3RRR"),
        ("hexapd", "hexa"),
        ("hexapod", "hexapod_jugglebot"),
        ("nope", ""),
        ("my_robot", ""),
    ],
)
def test_a_name_is_proposed_only_when_it_is_near(name, meant):
    with pytest.raises(SymkinError) as refused:
        symkin.load(name)
    said = str(refused.value)
    assert said.endswith(f'did you mean "{meant}"?') if meant else "did you mean" not in said
