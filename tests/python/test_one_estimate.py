# SPDX-License-Identifier: MIT
"""One class for every estimator and question: the same names, shapes, units, files and figures."""

import copy
import dataclasses
import json
import pickle

import numpy as np
import pytest
from matplotlib.figure import FigureBase

import symkin
from symkin import plot
from symkin.errors import ResultsError
from symkin.estimate import Estimate, examined
from symkin.estimate.closures import closure_rows

QUESTIONS = {
    "by_leg": {"estimator": "implicit"},
    "joint": {"estimator": "joint"},
    "shared": {"shared": ["sensor_gain"]},
    "positions": {},
    "robust": {"loss": "huber"},
}


@pytest.fixture(scope="module")
def simulated(paper):
    return paper.simulate(paper.plan(12, seed=3), 5)


@pytest.fixture(scope="module")
def estimates(paper, simulated):
    taken = simulated.measurements
    poses = taken.poses.copy()
    poses[:, 2] = np.nan
    positions = dataclasses.replace(taken, poses=poses)
    return {
        name: paper.identify(positions if name == "positions" else taken, **options)
        for name, options in QUESTIONS.items()
    }


@pytest.fixture(params=QUESTIONS)
def found(request, estimates):
    return estimates[request.param]


def keys_of(document, prefix=""):
    """Dotted keys of nested mappings, without what stands in lists."""
    for key, value in document.items():
        yield f"{prefix}{key}"
        if isinstance(value, dict):
            yield from keys_of(value, f"{prefix}{key}.")


def test_every_question_is_answered_by_the_same_class_with_the_same_keys(estimates):
    first, *others = estimates.values()
    # What may be None is one key; what is there depends on the question.
    missing = (
        "identification.influence",
        "identification.expected_accuracy",
        "evaluation",
    )
    keys = {key for key in keys_of(first.to_dict()) if not key.startswith(missing)}
    for each in others:
        assert type(each) is Estimate
        assert {key for key in keys_of(each.to_dict()) if not key.startswith(missing)} == keys
        assert list(each.columns()) == list(first.columns())
        assert list(each.latent_columns())[:7] == list(first.latent_columns())[:7]
        assert list(each.residual_columns()) == list(first.residual_columns())


def test_every_estimate_writes_the_same_files(found, tmp_path, monkeypatch):
    monkeypatch.setattr(FigureBase, "savefig", lambda *_, **__: None, raising=False)
    found.write(tmp_path / "out")
    assert {each.name for each in (tmp_path / "out").iterdir()} == set(Estimate.FILES)


def test_parameters_by_name_are_those_of_the_mechanism(found):
    robot = found.mechanism
    for leg in range(3):
        for index, name in enumerate(robot.parameter_names):
            each = found.params[f"leg{leg + 1}.{name}"]
            assert each.value == robot.parameters[leg, index]
            assert each.deviation == pytest.approx(robot.deviations[leg, index], rel=1e-9)
            assert each.nominal == found.nominal.parameters[leg, index]
            assert each.unit == robot.parameter_units(leg)[index]
    of_parameters = found.parameter_covariance
    np.testing.assert_allclose(np.sqrt(np.diag(of_parameters)), robot.deviations.ravel(), rtol=1e-9)
    assert found.covariance.shape == (len(found.names),) * 2
    for column, each in enumerate(found.first_unknowns):
        assert found.covariance[column, column] == pytest.approx(each.deviation**2)


def test_chi_square_is_a_total_with_its_degrees_of_freedom(estimates):
    by_leg = estimates["by_leg"]
    assert by_leg.chi_square == pytest.approx(sum(fit.chi_square for fit in by_leg.goodness))
    assert by_leg.degrees_of_freedom == 3 * (36 - 8)
    assert by_leg.limit == pytest.approx(sum(fit.limit for fit in by_leg.goodness))
    assert estimates["joint"].degrees_of_freedom == 84
    assert estimates["shared"].degrees_of_freedom == 86
    for each in estimates.values():
        assert each.chi_square_ratio == pytest.approx(each.chi_square / each.degrees_of_freedom)
        assert 0.6 < each.chi_square_ratio < 1.5
        assert each.least < each.chi_square < each.limit


def test_the_fast_and_the_general_way_to_fit_all_legs_find_the_same(paper, simulated):
    fast = paper.identify(simulated.measurements, "joint")
    general = paper.identify(simulated.measurements, gauge="nominal")
    assert fast.legs
    assert not general.legs
    assert fast.names == general.names
    deviations = np.sqrt(np.diag(fast.covariance))
    moved = (general.mechanism.parameters - fast.mechanism.parameters).ravel() / deviations
    assert np.abs(moved).max() < 1e-4
    np.testing.assert_allclose(general.covariance, fast.covariance, rtol=1e-5, atol=1e-16)
    assert fast.chi_square == pytest.approx(general.chi_square, rel=1e-6)
    for name in ("moves", "residual"):
        one, other = (getattr(each.influence, name) for each in (fast, general))
        np.testing.assert_allclose(one, other, rtol=1e-5)
    np.testing.assert_allclose(fast.rows.t, general.rows.t, rtol=1e-4, atol=1e-6)
    assert fast.expected.position == pytest.approx(general.expected.position, rel=1e-5)


def test_every_figure_is_drawn_of_every_estimate(found, simulated):
    for figure in (plot.residuals(found), plot.dependence(found)):
        assert len(figure.axes) == 3
        assert all(axes.lines for axes in figure.axes)
    assert plot.t_values(found).lines
    assert len(plot.parameter_errors(found, simulated.actual).axes) == 3


def test_a_closure_over_what_it_varies_by_is_standard_normal(paper, simulated):
    t = [
        paper.identify(paper.simulate(simulated.plan, seed).measurements, estimator).rows.t
        for seed in range(12)
        for estimator in ("implicit", "paper", "joint")
    ]
    assert np.std(np.concatenate(t)) == pytest.approx(1, abs=0.05)


def test_what_is_whitened_is_what_the_estimator_whitened(estimates):
    by_leg = estimates["by_leg"]
    rows = closure_rows(by_leg)
    for leg, fit in enumerate(by_leg.legs):
        own = rows.index == leg
        order = np.argsort(rows.pose[own])
        np.testing.assert_array_equal(rows.pose[own][order], fit.rows)
        np.testing.assert_allclose(rows.residual[own][order], fit.residuals, atol=1e-12)
        # Less what the closure itself moved the parameters by: never more than t.
        assert (np.abs(fit.standardised) <= np.abs(rows.t[own][order]) + 1e-9).all()


def test_leaving_a_pose_out_moves_an_estimate_by_legs_as_far_as_is_said(paper, simulated):
    taken = simulated.measurements.for_all_legs()
    found = paper.identify(taken)
    inverse = np.linalg.inv(found.covariance)
    for pose in np.argsort(-found.influence.moves)[:4].tolist():
        kept = np.delete(np.arange(len(taken.poses)), pose)
        without = paper.identify(taken.subset(kept))
        moved = (without.mechanism.parameters - found.mechanism.parameters).ravel()
        # To first order: a pose that moves the estimate by two deviations bends the closures.
        far = np.sqrt(moved @ inverse @ moved)
        assert far == pytest.approx(found.influence.moves[pose], rel=0.25)
        name = found.influence.unknown[pose]
        single = moved[found.names.index(name)] / found.params[name].deviation
        assert abs(single) == pytest.approx(found.influence.by[pose], rel=0.4)


def test_what_takes_long_is_computed_once_and_kept(paper, simulated, monkeypatch):
    counted = []

    def count(name):
        function = getattr(examined, name)

        def counting(*given, **named):
            counted.append(name)
            return function(*given, **named)

        monkeypatch.setattr(examined, name, counting)

    count("noticed")
    count("judged")
    for options in ({}, {"shared": ["sensor_gain"]}):
        found = paper.identify(simulated.measurements, **options)
        repr(found)
        assert counted == []
        assert found.doubts == ()
        first = list(counted)
        assert len(first) == len(set(first))
        for again in (
            found,
            dataclasses.replace(found),
            copy.deepcopy(found),
            pickle.loads(pickle.dumps(found)),
            dataclasses.replace(copy.copy(found), cross_validation=None),
            found.cross_validated(2),
        ):
            assert again.doubts == ()
            assert "no doubts" in repr(again)
        assert counted == first
        assert found.before is found.before
        other = dataclasses.replace(found, mechanism=found.nominal)
        assert other.after.position_rms > found.after.position_rms
        counted.clear()


def test_a_robust_fit_names_what_it_rejects(paper, simulated):
    taken = simulated.measurements.for_all_legs()
    readings = taken.readings.copy()
    readings[4, 1] += 0.02
    found = paper.identify(dataclasses.replace(taken, readings=readings), loss="cauchy")
    assert (4, "closure of leg 2") in found.rejected
    assert found.interval > 1.96
    assert found.outliers[0].what == "closure of leg 2"
    assert found.influence is None


def test_an_estimate_loads_back_equal_and_can_be_asked_everything(found, tmp_path):
    again = symkin.read_estimate(found.save(tmp_path / "results.json"))
    assert again == found
    assert type(again) is Estimate
    assert type(again.mechanism) is symkin.Robot
    assert not again.covariance.flags.writeable
    assert again.to_dict() == found.to_dict()
    assert again.text(whole=True) == found.text(whole=True)
    assert again.expected_accuracy() == found.expected_accuracy()


def test_a_calibration_in_frames_loads_back_with_its_priors_and_its_cross_validation(tmp_path):
    delta = symkin.load_mechanism("linear_delta")
    made = delta.simulate(delta.plan(8, seed=1), 2, observe="height")
    found = delta.identify(
        made, frames=["plane"], prior={"*_length": "0.1 mm", "sensor_offset": 0.01}
    )
    found = found.cross_validated(3)
    found.write(tmp_path / "out")
    again = symkin.read_estimate(tmp_path / "out")
    assert again == found
    assert again.heights == found.heights
    assert again.options.prior == found.options.prior


def test_a_run_has_its_estimate_in_its_folder(paper, tmp_path):
    ran = paper.replace(
        protocol=dataclasses.replace(paper.protocol, pose_count=9, candidates=200)
    ).run(seed=2)
    ran.save(tmp_path / "results.json")
    assert symkin.read_estimate(tmp_path) == ran.identification


def test_an_estimate_as_it_stood_in_files_before_is_read(found, tmp_path):
    path = found.save(tmp_path / "results.json")
    document = json.loads(path.read_text())
    result = document.pop("result")
    path.write_text(json.dumps({**document, "estimate": {"version": 1, **result["fields"]}}))
    assert symkin.read_estimate(tmp_path) == found


def test_results_without_an_estimate_of_this_version_are_refused_with_what_to_do(found, tmp_path):
    path = found.save(tmp_path / "results.json")
    document = json.loads(path.read_text())
    result = document.pop("result")
    for state, has in ((None, "no result"), ({"version": 7}, "a result of version 7")):
        path.write_text(json.dumps({**document, "estimate": state}))
        with pytest.raises(
            ResultsError, match=rf"results\.json: has {has}.* run the command again"
        ):
            symkin.read_estimate(tmp_path)
    result["fields"]["goodness"][0]["limit"] = "much"
    path.write_text(json.dumps({**document, "result": result}))
    with pytest.raises(ResultsError, match=r"results\.json: is no Estimate"):
        symkin.read_estimate(path)
