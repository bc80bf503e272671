# SPDX-License-Identifier: MIT
"""Claims of the paper are judged by figures, and any verdict can come out."""

import dataclasses
import math

import pytest

from symkin.study.summaries import Ratio
from symkin_paper import claims
from symkin_paper.claims import judge
from symkin_paper.evidence import Evidence, SliceErrors

SMALLER, LARGER, OPEN = Ratio(0.5, 0.4, 0.6), Ratio(2.0, 1.5, 2.5), Ratio(1.0, 0.8, 1.25)
ALIKE, NEARLY = Ratio(1.0, 0.97, 1.03), Ratio(1.15, 1.12, 1.2)
SAME, CLOSE = Ratio(1.0, 0.97, 1.03), Ratio(1.23, 1.21, 1.25)  # of times
BETTER, WORSE = SliceErrors(0.0, 1e-4, 2e-4, SMALLER), SliceErrors(0.4, 2e-4, 1e-4, LARGER)

# A paper whose every claim holds.
IDEAL = Evidence(
    poses=1000,
    rotations=3,
    reflections=3,
    mismatches=0,
    workspace_elements=("r0", "r1", "r2", "s0", "s1", "s2"),
    reading_elements=("r0", "r1", "r2"),
    reading_deviation=1e-15,
    reading_deviation_all=1e-15,
    slice_areas=(0.6, 0.3, 0.1),
    slice_mismatches=(0, 0, 0),
    conditions_met=12,
    conditions=12,
    offsets_off=0.0,
    mapped_deviation=1e-15,
    printed_deviation=1e-15,
    order_parameter="base_radius",
    order_diagonals=(6.0, 6.0),
    moved_zero_mismatches=0,
    moved_zero_deviation=0.1,
    tilt=1e-3,
    tilted_error=1e-6,
    tilted_out_of_plane=1e-3,
    drawn_error=3e-3,
    turned_planar=0.0,
    turned_spatial=0.0,
    legs=3,
    selection_saving=Ratio(3.0, 2.9, 3.1),
    plan_saving=Ratio(2.8, 2.7, 2.9),
    replacement_saving=Ratio(30.0, 29.0, 31.0),
    exchange_saving=Ratio(3.0, 2.9, 3.1),
    selection_gap=0.0,
    selection_bound=0.004,
    efficiencies=(0.5, 0.95, 0.99),
    printed_steps=(5e-3, 1e-4),
    corrected_steps=(5e-3, 1e-4),
    step_saving=Ratio(3.0, 2.9, 3.1),
    condition_whole=1000.0,
    condition_leg=100.0,
    measured_divided=72,
    measured_traditional=24,
    improvement=(40.0, 40.0),
    against_traditional=(SMALLER, SMALLER),
    against_equal_effort=(SMALLER, SMALLER),
    against_independent=(ALIKE, ALIKE),
    robots=1000,
    slices=(BETTER, BETTER, BETTER),
    replaced=0,
    commanded=72_000,
    unreachable=0,
    evaluated=100_000,
    evaluation_poses=100,
)

PARTLY, NOT, UNDECIDED = "holds partly", "does not hold", "not decided"
CASES = [
    ("workspace_theorem", PARTLY, {"workspace_elements": ("r0", "r1", "r2")}),
    ("workspace_theorem", NOT, {"workspace_elements": ("r0",)}),
    ("workspace_theorem", NOT, {"mismatches": 3}),
    ("structure_group", PARTLY, {"reflections": 0}),
    ("structure_group", NOT, {"rotations": 1, "reflections": 1}),
    ("joint_conjecture", PARTLY, {"reading_deviation_all": 0.1}),
    ("joint_conjecture", NOT, {"reading_deviation": 0.1, "reading_deviation_all": 0.1}),
    ("joint_group", PARTLY, {"reading_elements": ("r0", "r1", "r2", "s0", "s1", "s2")}),
    ("joint_group", NOT, {"reading_elements": ("r0",)}),
    ("workspace_theorem", NOT, {"slice_mismatches": (1, 2, 3)}),
    ("not_sufficient", PARTLY, {"moved_zero_mismatches": 3}),
    ("not_sufficient", NOT, {"moved_zero_deviation": 0.0}),
    ("revolute_defects", PARTLY, {"tilted_error": 1e-3}),
    ("revolute_defects", NOT, {"tilted_error": 4e-3}),
    ("diagonal_of_parameter", PARTLY, {"order_diagonals": (6.0, 4.0)}),
    ("diagonal_of_parameter", NOT, {"order_diagonals": (6.68, 0.112)}),
    ("selection_efficiency", PARTLY, {"exchange_saving": Ratio(0.3, 0.28, 0.32)}),
    ("selection_efficiency", NOT, {"replacement_saving": Ratio(0.5, 0.4, 0.6)}),
    ("selection_efficiency", UNDECIDED, {"exchange_saving": Ratio(1.0, 0.9, 1.1)}),
    ("conditions", PARTLY, {"conditions_met": 11}),
    ("conditions", NOT, {"conditions_met": 0}),
    ("sensor_offsets", PARTLY, {"offsets_off": 1e-4}),
    ("sensor_offsets", NOT, {"offsets_off": 2.0}),
    ("observability", PARTLY, {"printed_deviation": 0.8}),
    ("observability", NOT, {"mapped_deviation": 0.8}),
    ("same_orientations", PARTLY, {"turned_spatial": 0.7}),
    ("same_orientations", NOT, {"turned_planar": 0.7}),
    ("selection_cost", PARTLY, {"selection_saving": Ratio(1.5, 1.45, 1.55)}),
    ("selection_cost", NOT, {"selection_saving": SAME}),
    ("rule_of_thumb", PARTLY, {"efficiencies": (0.99, 0.96, 0.85)}),
    ("rule_of_thumb", NOT, {"efficiencies": (0.2, 0.4, 0.6)}),
    ("optimal_poses", PARTLY, {"selection_gap": 1e-3}),
    ("optimal_poses", NOT, {"selection_gap": 0.1}),
    ("printed_iteration", PARTLY, {"printed_steps": (5e-3, 1e-2, math.nan)}),
    ("printed_iteration", NOT, {"printed_steps": (5e-3, 1.0), "corrected_steps": (5e-3, 1.0)}),
    ("numerical_efficiency", PARTLY, {"condition_leg": 900.0}),
    ("numerical_efficiency", PARTLY, {"step_saving": SAME}),
    ("numerical_efficiency", NOT, {"condition_leg": 900.0, "step_saving": SAME}),
    ("numerical_efficiency", UNDECIDED, {"step_saving": CLOSE}),
    ("numerical_efficiency", UNDECIDED, {"condition_leg": 900.0, "step_saving": CLOSE}),
    ("selection_cost", UNDECIDED, {"selection_saving": CLOSE}),
    ("selection_cost", UNDECIDED, {"selection_saving": Ratio(2.9, 2.3, 3.0)}),
    ("calibration_helps", PARTLY, {"improvement": (40.0, 2.0)}),
    ("calibration_helps", NOT, {"improvement": (40.0, 0.9)}),
    ("better_than_traditional", PARTLY, {"against_traditional": (SMALLER, LARGER)}),
    ("better_than_traditional", NOT, {"against_traditional": (LARGER, LARGER)}),
    ("better_than_traditional", UNDECIDED, {"against_traditional": (SMALLER, OPEN)}),
    ("better_at_equal_effort", PARTLY, {"against_equal_effort": (LARGER, SMALLER)}),
    ("better_at_equal_effort", NOT, {"against_equal_effort": (LARGER, LARGER)}),
    ("better_at_equal_effort", UNDECIDED, {"against_equal_effort": (OPEN, OPEN)}),
    ("symmetrical_selection", PARTLY, {"against_independent": (ALIKE, NEARLY)}),
    ("symmetrical_selection", NOT, {"against_independent": (ALIKE, LARGER)}),
    ("symmetrical_selection", UNDECIDED, {"against_independent": (ALIKE, OPEN)}),
    ("local_errors", PARTLY, {"slices": (BETTER, BETTER, WORSE)}),
    ("local_errors", NOT, {"slices": (WORSE, WORSE, WORSE)}),
    ("local_errors", UNDECIDED, {"slices": (BETTER, SliceErrors(0.6, 1e-4, 1.01e-4, OPEN))}),
    ("poses_can_be_taken", PARTLY, {"unreachable": 1}),
    ("poses_can_be_taken", NOT, {"unreachable": 7000}),
]


@pytest.mark.parametrize("claim", judge(IDEAL), ids=lambda claim: claim.name)
def test_every_claim_can_hold(claim):
    assert claim.verdict == "holds"
    assert claim.quotation
    assert "section" in claim.place
    assert claim.figure in range(6, 11)


@pytest.mark.parametrize(
    ("name", "verdict", "changes"), CASES, ids=[f"{name}: {verdict}" for name, verdict, _ in CASES]
)
def test_other_figures_have_another_verdict(name, verdict, changes):
    found = getattr(claims, name)(dataclasses.replace(IDEAL, **changes))
    assert found.verdict == verdict


def test_every_claim_has_figures_for_every_verdict():
    judged = {function.__name__ for *_, function in claims.CLAIMS}
    for verdict in (PARTLY, NOT):
        assert {name for name, which, _ in CASES if which == verdict} == judged


def test_a_sentence_has_the_figures_that_decided():
    wrong = dataclasses.replace(IDEAL, against_traditional=(SMALLER, LARGER))
    sentence = claims.better_than_traditional(wrong).sentence
    assert "better in position, 0.500 times (0.400 to 0.600)" in sentence
    assert "worse in orientation, 2.00 times (1.50 to 2.50)" in sentence


def test_poses_that_are_measured_do_not_judge_those_over_which_errors_are_taken():
    spared = dataclasses.replace(IDEAL, replaced=7000)
    assert claims.poses_can_be_taken(spared).verdict == "holds"


def test_poses_that_leave_nothing_to_check_do_not_speak_against_the_rule_of_thumb():
    few = dataclasses.replace(IDEAL, efficiencies=(0.99, 0.97, 0.92))
    assert claims.rule_of_thumb(few).verdict == "holds"
