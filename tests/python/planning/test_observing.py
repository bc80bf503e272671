# SPDX-License-Identifier: MIT
"""Plans for what will be observed and what is unknown."""

import dataclasses
import json

import numpy as np
import pytest

import symkin
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.observability import mechanism_rows
from symkin.observed import Observed
from symkin.planning import Survey, predict_accuracy
from symkin.settings import Frames

PRIORS = {"observe": "position", "prior": "tolerances"}


@pytest.fixture(scope="module")
def sample(paper):
    return symkin.sample_workspace(paper, 800, seed=1)


@pytest.fixture(scope="module")
def plan(paper, sample):
    return symkin.make_plan(paper, sample, 30, design="mechanism", spares=0, **PRIORS)


def promised_and_found(mechanism, plan, **unknowns):
    """Standard deviations before and after measuring a robot that is as drawn."""
    survey = plan.basis.survey
    taken = symkin.simulate(mechanism, plan, 1, mechanism, observe=survey.observed)
    found = symkin.identify(mechanism, taken.measurements, "joint", **unknowns)
    assert found.names == survey.unknowns
    promised = [each.deviation for each in plan.unknowns]
    return np.array(promised), np.sqrt(np.diag(found.covariance)), found


def test_full_poses_and_all_parameters_are_the_rows_of_the_mechanism(paper, sample):
    survey = Survey.of(paper, sample.poses, "pose", {})
    rows, usual = survey.rows(sample.poses), mechanism_rows(paper, sample, "noise_aware")
    mine, theirs = (np.einsum("nri,nrj->nij", each, each) for each in (rows, usual))
    scale = np.sqrt(np.einsum("nii->i", theirs))
    assert np.abs((mine - theirs) / np.outer(scale, scale)).max() < 1e-9


def test_rows_out_of_reach_are_nan_and_the_others_as_without_them(paper, sample):
    survey = Survey.of(paper, sample.poses, "position", {})
    poses = np.array(sample.poses[:3])
    poses[1, :2] = 100.0
    rows = survey.rows(poses)
    assert np.isnan(rows[1]).all()
    assert np.array_equal(rows[[0, 2]], survey.rows(poses[[0, 2]]))


def test_positions_alone_promise_what_they_keep(paper, plan):
    promised, found, result = promised_and_found(paper, plan, prior="tolerances")
    assert promised == pytest.approx(found, rel=0.03)
    assert plan.unseen == result.unseen


def test_a_five_bar_with_shared_and_held_parameters_promises_what_it_keeps():
    mechanism = symkin.load_mechanism("5bar")
    sample = symkin.sample_workspace(mechanism, 500, seed=1)
    unknowns = {"fixed": ["base_*", "sensor_gain"], "shared": ["proximal_length"]}
    plan = symkin.make_plan(mechanism, sample, 20, design="mechanism", spares=0, **unknowns)
    promised, found, _ = promised_and_found(mechanism, plan, **unknowns)
    assert "proximal_length" in plan.basis.survey.unknowns
    assert promised == pytest.approx(found, rel=0.05)


def test_heights_over_an_unknown_bed_promise_what_they_keep(hexapod):
    sample = symkin.sample_workspace(hexapod, 400, seed=1)
    unknowns = {"free": ["sensor_offset"], "frames": ["plane"], "prior": "tolerances"}
    observe = Observed(("height",), target=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0), plane=(0.1, 0.02, 0.01))
    hexapod = hexapod.replace(frames=Frames(target=observe.target, plane=observe.plane))
    plan = symkin.make_plan(
        hexapod, sample, 30, design="mechanism", spares=0, observe=observe, **unknowns
    )
    promised, found, _ = promised_and_found(hexapod, plan, **unknowns)
    assert promised == pytest.approx(found, rel=0.05)


def test_poses_chosen_for_positions_beat_those_for_full_poses_where_these_are_measured(
    paper, sample, plan
):
    full = symkin.make_plan(paper, sample, 30, design="mechanism", spares=0)
    expected = predict_accuracy(paper, full, sample, **PRIORS)
    assert predict_accuracy(paper, plan, sample).position < expected.position
    survey = plan.basis.survey
    dets = [
        np.linalg.slogdet(np.einsum("nri,nrj->ij", rows, rows) + survey.prior_information)[1]
        for rows in (survey.rows(each.poses) for each in (plan, full))
    ]
    assert dets[0] > dets[1]


def test_the_expected_error_of_a_curved_sensor_is_that_of_curved_robots(paper, sample):
    # Against finite differences of forward kinematics, through the covariance of all unknowns.
    unknowns = {"sensor": "quadratic", "prior": "tolerances"}
    plan = symkin.make_plan(paper, sample, 30, design="mechanism", spares=0, **unknowns)
    survey, places = plan.basis.survey, sample.poses[:4]
    covariance = survey.covariance([survey.rows(plan.poses)])
    readings, step = paper.inverse_kinematics(places), 1e-6
    columns = []
    for name in survey.unknowns:
        leg, parameter = int(name[3]) - 1, name.partition(".")[2]
        changed = [np.array(paper.parameters), np.zeros((3, 3))]
        if parameter == "sensor_quadratic":
            changed[1][leg, 0] = step
        else:
            changed[0][leg, paper.parameter_names.index(parameter)] += step
        moved = paper.with_parameters(changed[0]).replace(symmetry=None, curvature=changed[1])
        poses = moved.forward_kinematics(readings, places)[0]
        columns.append((poses - places)[:, :2] / step)
    by_unknowns = np.stack(columns, axis=-1)
    squares = np.einsum("nij,jk,nik->n", by_unknowns, covariance, by_unknowns)
    expected = survey.expected(places, covariance).position
    assert expected == pytest.approx(np.sqrt(squares.mean()), rel=1e-3)


def test_what_is_measured_already_counts(paper, sample, plan):
    taken = symkin.simulate(paper, plan, 1, observe="position").measurements
    more = symkin.make_plan(
        paper, sample, 6, design="mechanism", spares=2, measured=taken, **PRIORS
    )
    assert more.expected.position < plan.expected.position
    alone = dataclasses.replace(more, measured=None)
    assert more.expected.position < alone.expected.position


def test_what_nothing_shows_is_named_with_what_would_hold_it(paper, sample, plan):
    with pytest.raises(NotIdentifiableError, match=r"leg1\.platform_angle.*--prior tolerances"):
        symkin.make_plan(paper, sample, 30, design="mechanism", observe="position")
    with pytest.raises(NotIdentifiableError, match=r"leg1\.platform_angle.*--prior tolerances"):
        predict_accuracy(paper, plan, sample, observe="position")
    with pytest.raises(NotIdentifiableError, match="say nothing"):
        symkin.make_plan(paper, sample, 30, design="mechanism", observe="readings")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"observe": "position"}, 'choose the design "mechanism"'),
        ({"free": ["sensor_offset"], "design": "orbits"}, 'choose the design "mechanism"'),
        ({"observe": "position", "design": "mechanism", "rows": "paper"}, "noise_aware"),
        ({"free": ["sensor_ofset"], "design": "mechanism"}, "sensor_offset"),
        ({"observe": Observed(missing=0.2), "design": "mechanism"}, "nobody knows beforehand"),
        ({"observe": "height", "design": "mechanism"}, "planar"),
    ],
)
def test_options_that_do_not_go_together_are_refused(paper, sample, options, words):
    with pytest.raises(SymkinError, match=words):
        symkin.make_plan(paper, sample, 30, **options)


def test_an_estimator_that_looks_at_legs_alone_is_refused(paper, sample, plan):
    with pytest.raises(SymkinError, match='expected "joint"'):
        predict_accuracy(paper, plan, sample, "inverse")


def test_a_plan_and_its_files_say_what_will_be_observed_and_what_is_unknown(plan):
    document = json.loads(json.dumps(plan.to_dict()))
    survey = document["selection"]["survey"]
    assert survey["observed"]["kinds"] == ["position"]
    assert survey["unknowns"] == [each["name"] for each in document["unknowns"]]
    (unseen,) = document["unseen"]
    assert "leg1.platform_angle" in unseen
    text = " ".join(words for section in plan.page().sections for words in section.paragraphs)
    assert "Observed will be the readings and position of the target" in text
    assert "Priors of 24 of them" in text


def test_counts_are_for_what_is_observed(paper, sample):
    asked = {"design": "mechanism", **PRIORS}
    curve = symkin.pose_count_curve(paper, sample, [20, 40], **asked)
    plan = symkin.make_plan(paper, sample, 40, spares=0, **asked)
    expected = predict_accuracy(paper, plan, sample)
    assert curve.position[-1] == pytest.approx(expected.position, rel=1e-9)
    assert curve.settings["estimator"] == "joint"
    assert curve.to_dict()["settings"]["observe"] == "position"
    needed = curve.for_accuracy(float(curve.position.mean()))
    assert 20 < needed.count <= 40
    with pytest.raises(SymkinError, match='expected "joint"'):
        symkin.pose_count_curve(paper, sample, [20], estimator="inverse", **asked)
