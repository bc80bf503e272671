# SPDX-License-Identifier: MIT
"""Plans for what will be observed and what is unknown."""

import dataclasses
import json

import numpy as np
import pytest

import symkin
from symkin.analysis.observability import expected_accuracy, mechanism_rows
from symkin.analysis.observed import Observed
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.model.poses import (
    Transform,
    frame,
    rotations_from_vectors,
    transforms,
    vectors_from_rotations,
)
from symkin.model.settings import (
    Frames,
    IdentificationSettings,
    NoiseSettings,
    ProtocolSettings,
)
from symkin.planning import Survey, predict_accuracy

FEW = ProtocolSettings(pose_count=12, candidates=300)
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


@pytest.mark.parametrize(
    ("name", "base", "target"),
    [
        ("3RRR", (1.0, -0.5, 2.0), (0.1, 0.05, 0.3)),
        ("hexapod_jugglebot", (1.0, -0.5, 0.2, 0.3, 0.2, 2.0), (0.1, 0.0, 0.05, 0.0, 0.4, 0.3)),
    ],
)
def test_the_expected_error_is_that_of_robots_with_errors(name, base, target):
    # Against differences of forward kinematics, for every unknown of legs, sensors and frames.
    nominal = symkin.load_mechanism(name)
    nominal = nominal.replace(symmetry=None, frames=Frames(base=base, target=target))
    places = symkin.sample_workspace(nominal, 200, seed=1).poses[:3]
    asked = {"sensor": "quadratic", "frames": ["base", "target"]}
    survey = Survey.of(nominal, places, "pose", asked)
    readings, step = nominal.inverse_kinematics(places), 1e-6
    seen = device_poses(nominal, places)
    effects = []
    for unknown in survey.unknowns:
        block, _, own = unknown.partition(".")
        changed = nominal
        if block.startswith("leg"):
            leg, parameters = int(block[3:]) - 1, np.array(nominal.parameters)
            curvature = np.zeros((len(parameters), 3))
            if own == "sensor_quadratic":
                curvature[leg, 0] = step
            else:
                parameters[leg, nominal.parameter_names.index(own)] += step
            changed = nominal.with_parameters(parameters).replace(curvature=curvature)
        moved = device_poses(changed, changed.forward_kinematics(readings, places)[0])
        if block in ("base", "target"):
            tangent = np.zeros(6)
            tangent[("x", "y", "z", "rx", "ry", "rz").index({"phi": "rz"}.get(own, own))] = step
            moved = device_poses(nominal, places, **{block: tangent})
        turned = moved.rotation @ np.swapaxes(seen.rotation, 1, 2)
        shift = moved.translation - seen.translation
        effects.append(np.hstack([shift, vectors_from_rotations(turned)]) / step)
    effect = np.stack(effects, axis=-1)
    covariance = np.cov(np.random.default_rng(1).normal(size=(len(effects), 99)))
    squares = np.einsum("nij,jk,nik->ni", effect, covariance, effect)
    expected = survey.expected(places, covariance)
    position, orientation = squares[:, :3].sum(axis=1), squares[:, 3:].sum(axis=1)
    assert expected.position == pytest.approx(np.sqrt(position.mean()), rel=1e-3)
    assert expected.orientation == pytest.approx(np.sqrt(orientation.mean()), rel=1e-3)


def device_poses(mechanism, poses, base=(0.0,) * 6, target=(0.0,) * 6):
    """Where the device sees the target, with frames that are moved by small tangents."""
    space, frames = mechanism.pose_space, mechanism.frames

    def shifted(values, tangent):
        own = frame(space, values)
        turn = rotations_from_vectors(np.array([tangent[3:]]))[0]
        return Transform(turn @ own.rotation, own.translation + tangent[:3])

    return shifted(frames.base, base) @ transforms(space, poses) @ shifted(frames.target, target)


def test_full_poses_and_all_parameters_expect_the_usual_error(paper, sample):
    survey = Survey.of(paper, sample.poses, "pose", {})
    covariance = np.cov(np.random.default_rng(1).normal(size=(24, 99)))
    usual = expected_accuracy(paper, sample, covariance)
    mine = survey.expected(sample, covariance)
    assert mine.position == pytest.approx(usual.position, rel=1e-9)
    assert mine.orientation == pytest.approx(usual.orientation, rel=1e-9)
    assert mine.evaluated == usual.evaluated


def test_what_is_measured_already_counts(paper, sample, plan):
    taken = symkin.simulate(paper, plan, 1, observe="position").measurements
    more = symkin.make_plan(
        paper, sample, 6, design="mechanism", spares=2, measured=taken, **PRIORS
    )
    assert more.expected.position < plan.expected.position
    alone = dataclasses.replace(more, measured=None)
    assert more.expected.position < alone.expected.position


def test_what_nothing_shows_is_named_with_what_would_hold_it(paper, sample, plan):
    with pytest.raises(NotIdentifiableError, match=r"leg1\.platform_angle.*prior \"tolerances\""):
        symkin.make_plan(paper, sample, 30, design="mechanism", observe="position")
    with pytest.raises(NotIdentifiableError, match=r"leg1\.platform_angle.*prior \"tolerances\""):
        predict_accuracy(paper, plan, sample, observe="position")
    with pytest.raises(NotIdentifiableError, match="say nothing"):
        symkin.make_plan(paper, sample, 30, design="mechanism", observe="readings")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"observe": "position", "design": "legs"}, 'choose the design "mechanism"'),
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


def test_a_plan_whose_observations_do_not_see_what_moves_the_platform_is_no_good_one(paper, plan):
    page, held = plan.page(), plan.held
    assert page.verdict == "doubtful"
    assert "are known from the drawing's tolerances, hardly from the observations" in page.judgement
    (doubt,) = page.doubts
    assert "of the expected orientation error of" in doubt
    assert "position" not in doubt
    assert plan.to_dict()["held_by_priors"]["combinations"] == list(held.combinations)
    # Whatever the noise, the platform's angle against the drawing's is not seen.
    precise = paper.replace(noise=NoiseSettings(1e-9, 1e-9, 0))
    exact = symkin.make_plan(precise, plan.candidates, 30, design="mechanism", spares=0, **PRIORS)
    assert len(exact.held.combinations) == len(exact.unseen) == 1
    assert exact.held.orientation == pytest.approx(exact.expected.orientation, rel=1e-3)
    assert exact.held.orientation < held.orientation < plan.expected.orientation


def test_what_priors_hold_is_a_part_of_what_is_not_known(sample, plan):
    survey = plan.basis.survey
    covariance = survey.covariance([survey.rows(plan.poses)])
    expected, held = survey.expected(sample, covariance), survey.held(sample, covariance)
    assert 0 < held.position < expected.position
    assert 0 < held.orientation < expected.orientation
    unknown = survey.held(sample, np.diag(survey.priors**2))  # as long as nothing is measured
    assert len(unknown.combinations) == len(survey.unknowns)
    drawn = survey.expected(sample, np.diag(survey.priors**2))
    assert unknown.position == pytest.approx(drawn.position, rel=1e-9)
    assert unknown.orientation == pytest.approx(drawn.orientation, rel=1e-9)


def test_what_priors_hold_and_nothing_moves_with_is_said_but_does_no_harm(paper, sample):
    asked = {"observe": "pose", "prior": "tolerances", "frames": ["base", "target"]}
    plan = symkin.make_plan(paper, sample, 60, design="mechanism", spares=0, **asked)
    assert len(plan.unseen) == 6
    page = plan.page()
    assert (page.verdict, list(page.doubts)) == ("good", [])
    assert "known from the drawing's tolerances" in page.judgement
    assert "hardly move the end-effector" in page.judgement


@pytest.mark.parametrize(("name", "prior"), [("5bar", "tolerances"), ("3RRR", None)])
def test_a_plan_that_shows_everything_is_a_good_one(name, prior):
    mechanism = symkin.load_mechanism(name)
    sample = symkin.sample_workspace(mechanism, 500, seed=1)
    asked = {"observe": "pose", "design": "mechanism", "prior": prior}
    plan = symkin.make_plan(mechanism, sample, 40, spares=0, **asked)
    assert plan.held is None
    assert plan.page().verdict == "good"
    assert plan.page().judgement == "The poses come with a certificate"


def test_less_noise_is_no_remedy_for_what_priors_hold(paper, sample):
    curve = symkin.pose_count_curve(paper, sample, [30, 60], design="mechanism", **PRIORS)
    assert curve.page().verdict == "doubtful"
    assert curve.held.orientation < curve.orientation[-1]
    needed = curve.for_accuracy(orientation=3e-4)
    page = needed.page()
    assert page.verdict == "bad"
    first, second = page.doubts
    assert "which the priors do not leave" in first
    assert "the noise would have to be" not in first
    assert "hardly help" in second
    assert curve.for_accuracy(orientation=1e-2).page().verdict == "doubtful"


def test_a_curve_of_a_delta_that_probes_its_bed_knows_that_the_plane_is_unknown():
    delta = symkin.load_mechanism("linear_delta")
    sample = symkin.sample_workspace(delta, 500, seed=1)
    asked = {"observe": "height", "design": "mechanism"}
    curve = symkin.pose_count_curve(delta, sample, [30], **asked)
    plan = symkin.make_plan(delta, sample, 30, **asked)
    assert curve.survey.unknowns == plan.basis.survey.unknowns
    assert "plane.c0" in curve.survey.unknowns
    assert "tolerances" in curve.page().judgement


@pytest.mark.parametrize("beside", [(), ("distance",), ("points",)])
def test_what_is_unknown_beside_heights_is_what_identify_takes_for_unknown(beside):
    robot = symkin.load_mechanism("linear_delta")
    anchors, points = ((0.4, 0.0, 0.2), (-0.2, 0.3, 0.2)), ((0.02, 0.0, 0.0), (0.0, 0.03, 0.0))
    seen = Observed(
        ("height", *beside),
        anchors=anchors if "distance" in beside else (),
        points=points if "points" in beside else (),
    )
    drawn = robot.replace(frames=Frames(anchors=seen.anchors, points=seen.points))
    poses = symkin.sample_workspace(robot, 60, seed=1).poses
    exact = symkin.Measurements.of(
        poses, robot.inverse_kinematics(poses), reading_unit="m", pose_space="translating"
    )
    found = symkin.identify(drawn, seen.measure(exact, robot.noise, 1))
    assert Survey.of(drawn, poses, seen, {}).options.frames == found.options.frames


def test_counts_are_for_what_is_observed(paper, sample):
    asked = {"design": "mechanism", **PRIORS}
    curve = symkin.pose_count_curve(paper, sample, [20, 40], **asked)
    plan = symkin.make_plan(paper, sample, 40, spares=0, **asked)
    expected = predict_accuracy(paper, plan, sample)
    assert curve.position[-1] == pytest.approx(expected.position, rel=1e-9)
    assert curve.settings["estimator"] == "joint"
    assert curve.to_dict()["settings"]["observe"] == "position"
    needed = curve.for_accuracy(float(curve.position_bound.mean()))
    assert 20 < needed.count <= 40
    with pytest.raises(SymkinError, match='expected "joint"'):
        symkin.pose_count_curve(paper, sample, [20], estimator="inverse", **asked)


def test_a_reading_that_is_not_taken_brings_one_condition_less(paper, sample):
    survey = Survey.of(paper, sample.poses, "pose", {})
    read = np.array([[True, True, True], [True, False, True]])
    rows = survey.rows(sample.poses[:2], read)
    assert np.array_equal(rows[0], survey.rows(sample.poses[:1])[0])
    assert np.linalg.matrix_rank(rows[1]) == 2
    assert not rows[1, :, 8:16].any()  # of the second leg


def test_a_delta_probes_its_bed_where_heights_show_most():
    delta = symkin.load_mechanism("linear_delta")
    sample = symkin.sample_workspace(delta, 500, seed=1)
    plan = symkin.make_plan(delta, sample, 24, observe="height", spares=0, minimum_distance=0.004)
    assert not plan.poses[:, 2].any()
    assert plan.basis.design == "mechanism"
    unknowns = {each.name: each for each in plan.unknowns}
    assert "plane.c1" in unknowns
    assert unknowns["leg1.distal_length"].prior == delta.tolerances.length
    survey = plan.basis.survey
    taken = symkin.simulate(delta, plan, 1, delta, observe=Observed("height"))
    found = symkin.identify(delta, taken.measurements)
    promised = [each.deviation for each in plan.unknowns]
    assert promised == pytest.approx(np.sqrt(np.diag(found.covariance)), rel=0.05)
    random = np.random.default_rng(1)
    choices = [plan.poses, *(random.permutation(plan.candidates)[:24] for _ in range(20))]
    value, *others = (
        np.linalg.slogdet(np.einsum("nri,nrj->ij", rows, rows) + survey.prior_information)[1]
        for rows in map(survey.rows, choices)
    )
    assert value > max(others) + 1


def test_a_bed_beyond_the_workspace_is_refused():
    delta = symkin.load_mechanism("rotary_delta")
    sample = symkin.sample_workspace(delta, 300, seed=1)
    with pytest.raises(SymkinError, match=r"outside of the workspace's -1\.15 to -0\.85 m"):
        symkin.make_plan(delta, sample, 24, observe="height")
    there = symkin.make_plan(
        delta, sample, 24, observe=Observed("height", plane=(-1.0, 0.0, 0.0)), spares=0
    )
    assert (there.poses[:, 2] == -1).all()


def test_a_plan_is_for_what_the_mechanisms_file_says_is_unknown(paper, sample):
    asked = {"shared": ("sensor_gain",), "prior": "tolerances"}
    said = paper.replace(identification=IdentificationSettings(**asked))
    by_file, by_hand = (
        symkin.make_plan(said, sample, 12),
        symkin.make_plan(paper, sample, 12, **asked),
    )
    assert by_file.basis.design == by_hand.basis.design == "mechanism"
    assert np.array_equal(by_file.poses, by_hand.poses)
    assert [each.name for each in by_file.unknowns] == [each.name for each in by_hand.unknowns]
    assert by_file.expected == by_hand.expected
    with pytest.raises(SymkinError, match='choose the design "mechanism"'):
        symkin.make_plan(said, sample, 12, design="legs")
    curves = [
        symkin.pose_count_curve(each, sample, [12, 14], **options)
        for each, options in ((said, {}), (paper, asked))
    ]
    assert np.array_equal(curves[0].position, curves[1].position)
    assert curves[0].settings["design"] == "mechanism"


def test_a_plan_that_was_read_promises_what_its_mechanisms_file_says(paper, sample, tmp_path):
    asked = {"shared": ("sensor_gain",), "prior": "tolerances"}
    said = paper.replace(identification=IdentificationSettings(**asked))
    made = symkin.make_plan(said, sample, 12)
    made.save(tmp_path / "plan.csv")
    read = symkin.read_plan(tmp_path / "plan.csv", said)
    promised = predict_accuracy(said, read, sample)
    assert promised.position == pytest.approx(predict_accuracy(said, made, sample).position)
    assert promised.position < predict_accuracy(paper, read, sample).position


def test_a_run_identifies_every_leg_whatever_the_file_says(paper):
    said = paper.replace(identification=IdentificationSettings(shared=("sensor_gain",)))
    plans = [each.replace(protocol=FEW).run().plan for each in (said, paper)]
    assert np.array_equal(plans[0].poses, plans[1].poses)


def test_poses_are_chosen_in_pairs_for_what_calipers_measure_between_them():
    robot = symkin.load_mechanism("linear_delta").with_device("caliper on prints")
    chosen, dealt = (
        symkin.plan(robot, 23, candidates=300, seed=1, method=method)
        for method in ("exchange", "random")
    )
    assert np.flatnonzero(chosen.spare).tolist() == list(range(24, 36))
    np.testing.assert_allclose(chosen.poses[:, 2], 0, atol=1e-12)  # on the bed
    lengths = np.linalg.norm(np.diff(chosen.poses[:24, :2], axis=0), axis=1)[::2]
    assert chosen.expected.up_to_frames
    assert chosen.expected.position < 0.9 * dealt.expected.position
    assert lengths.min() > 0.02  # m: as far apart as a bed of 0.12 m lets most of them be
    taken = symkin.simulate(robot, chosen, 1).measurements
    np.testing.assert_array_equal(taken.partners[1::2, 0], taken.row_numbers[::2])
    found = symkin.identify(robot, taken)
    assert found.least < found.chi_square < found.limit
    # As drawn, what is promised is what an estimate has.
    drawn = symkin.Measurements.of(
        chosen.poses[:24], chosen.readings[:24], pose_space="translating", reading_unit="m"
    )
    exact = symkin.identify(robot, chosen.basis.survey.observed.exact(drawn))
    promised = {each.name: each.deviation for each in chosen.unknowns}
    np.testing.assert_allclose(
        [promised[name] for name in exact.names],
        np.sqrt(np.diag(exact.model_covariance)),
        rtol=1e-3,
    )
    # A pair of which one pose is out of the robot's reach is replaced by another pair.
    poses = chosen.poses.copy()
    poses[5] = [0.5, 0.5, 0.0]
    broken = dataclasses.replace(chosen, poses=poses, basis=None)
    again = symkin.simulate(robot, broken, 1)
    assert again.replaced == (2,)
    expected = np.delete(chosen.readings[:26], [4, 5], axis=0)
    np.testing.assert_allclose(again.measurements.readings, expected, atol=1e-3)
    with pytest.raises(SymkinError, match="no minimum distance"):
        symkin.plan(robot, 10, candidates=100, minimum_distance=0.01)
    curve = symkin.pose_count_curve(robot, chosen.candidates, [11, 24], seed=1)
    assert curve.counts.tolist() == [12, 24]
    np.testing.assert_allclose(curve.position[1], chosen.expected.position, rtol=0.02)
    needed = curve.for_accuracy(position=1.2 * curve.position_bound[1])
    assert 12 < needed.count <= 24
    assert needed.count % 2 == 0
