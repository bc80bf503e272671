"""Studies of what symmetry saves, and of how much of it is needed."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.model.symmetry import verify_declared
from symkin.study import CostResult, StudyDefinition, StudyResult, run_study
from symkin.study.asymmetry import Curve
from symkin.study.cost import TASKS, _power, with_legs
from symkin.study.mapping import mapped_candidates, mapped_efficiency


def test_times_are_measured_for_every_number_of_legs_that_holds_the_platform() -> None:
    result = run_study(
        StudyDefinition(
            kind="cost", mechanisms=("3RRR",), legs=(2, 3, 4, 6), repetitions=2, candidates=2000
        )
    )
    assert isinstance(result, CostResult)
    assert result.legs("3RRR").tolist() == [3, 4, 6]
    assert all((result.times("3RRR", task) > 0).all() for task in TASKS)
    assert len(result.exponents) == len(TASKS)
    assert "growth with the number of legs" in result.text()
    assert result.to_dict()["times"]["legs"] == [3, 4, 6]


def test_the_exponent_of_a_power_is_found() -> None:
    legs = np.arange(2, 13)
    noise = np.exp(np.random.default_rng(1).normal(0, 0.02, len(legs)))
    slope, low, high = _power(legs, 3e-3 * legs**1.5 * noise)
    assert low < 1.5 < high
    assert abs(slope - 1.5) < 0.05


def test_legs_are_repeated_by_rotations_and_two_by_a_reflection(paper: symkin.Mechanism) -> None:
    assert with_legs(paper, 3).parameters == pytest.approx(paper.parameters)
    two = with_legs(symkin.load_mechanism("5bar"), 2)
    assert two.symmetry is not None
    assert two.symmetry.group == "D1"
    verify_declared(two)


def test_a_study_of_cost_stays_in_one_process() -> None:
    with pytest.raises(symkin.SymkinError, match="runs in one process"):
        run_study(StudyDefinition(kind="cost", mechanisms=("3RRR",)), workers=2)


def test_too_few_legs_are_refused() -> None:
    with pytest.raises(symkin.SymkinError, match="at least as many as degrees of freedom"):
        run_study(StudyDefinition(kind="cost", mechanisms=("3RRR",), legs=(2,)))


def test_mapped_poses_lose_nothing_on_a_symmetric_robot_and_something_on_a_crooked_one(
    paper: symkin.Mechanism,
) -> None:
    poses = symkin.sample_workspace(paper, 2000).poses
    plan = symkin.make_plan(paper, poses)
    candidates = mapped_candidates(plan, poses)
    assert mapped_efficiency(paper, plan, candidates) == pytest.approx(1, abs=1e-9)
    crooked = symkin.planning.simulation.disturb(
        paper.replace(tolerances=symkin.model.settings.Tolerances(0.05, 0.05, 0.05)), 1
    )
    assert mapped_efficiency(crooked, plan, candidates) < 0.999


def test_half_of_the_information_is_half_of_the_efficiency_whatever_is_held() -> None:
    """Seven of a leg's nine parameters are identified, and half of the poses show nothing."""
    delta = symkin.load_mechanism("linear_delta")
    assert delta.estimated_counts == (7, 7, 7)
    plan = symkin.make_plan(delta, symkin.sample_workspace(delta, 500, seed=1), 20, spares=0)
    poses, candidates = plan.poses.copy(), []
    for leg in range(3):
        shown, lost = np.split(plan.rows_of(leg), 2)
        candidates.append(np.repeat(poses[shown], 2, axis=0))
        poses[lost] = 100.0
    halved = dataclasses.replace(plan, poses=poses)
    assert mapped_efficiency(delta, halved, tuple(candidates)) == pytest.approx(0.5)


def test_levels_are_read_between_those_that_were_tried() -> None:
    levels, none = np.array([1.0, 10.0, 100.0]), np.zeros(3)
    curve = Curve("", "", "", levels, np.array([1.0, 0.98, 0.9]), none, none.astype(int))
    assert curve.reaches(0.01) == pytest.approx(np.sqrt(10))
    assert curve.reaches(0.06) == pytest.approx(np.sqrt(1000))
    assert np.isnan(curve.reaches(0.2))


def test_a_study_of_symmetry_answers_its_questions() -> None:
    result = run_study(
        StudyDefinition(
            kind="symmetry",
            mechanisms=("3RRR",),
            candidates=1000,
            evaluation_poses=100,
            robots=10,
            reading_noises=(1e-6, 1e-2),
            cell=({"tolerance_levels": (1, 30)}, {"noise_levels": (0.1, 10)}),
        )
    )
    assert isinstance(result, StudyResult)
    (asymmetry,), (readings,) = result.curves["asymmetry"], result.curves["readings"]
    assert asymmetry.values[0] > 0.999 > asymmetry.values[1]
    assert readings.values[0] > 0.999 > readings.values[1]
    (noise,) = result.curves["noise"]
    assert noise.levels.tolist() == [0.1, 1, 10]
    assert noise.values == pytest.approx(1, abs=0.01)
    assert noise.errors.max() < 0.01
    (errors,) = result.curves["errors"]
    assert abs(errors.values[1] - 1) > 0.02
    anchors = [section.anchor for section in result.page().sections]
    assert anchors == ["asymmetry", "readings", "noise", "errors", "cells"]
    assert "How much joint noise" in result.text()
