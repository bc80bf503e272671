# SPDX-License-Identifier: MIT
"""What all results of planning can do: be shown, compared, copied, stored and tabulated."""

import copy
import csv
import dataclasses
import json
import pickle
import sys
import types

import numpy as np
import pytest

import symkin
from symkin.analysis.observability import (
    analyse_observability,
    error_weight,
    expected_accuracy,
    mechanism_rows,
    observability_rows,
)
from symkin.planning import pose_count_curve, travel_length


@pytest.fixture(scope="module")
def plan(paper):
    return symkin.make_plan(paper, symkin.sample_workspace(paper, 600, seed=1), 9, spares=2)


@pytest.fixture(scope="module")
def measurements(paper, plan):
    return symkin.simulate(paper, plan, seed=1, actual=paper).measurements


@pytest.fixture(scope="module")
def results(paper, plan, measurements):
    sample = symkin.sample_workspace(paper, 400, seed=1)
    curve = pose_count_curve(paper, sample, [8, 10])
    choice = plan.basis.choices[0]
    return {
        "Plan": plan,
        "PlanBasis": plan.basis,
        "Clearance": plan.basis.clearance,
        "ChosenPoses": choice,
        "Selection": choice.selection,
        "Certificate": choice.selection.certificate,
        "ExpectedAccuracy": plan.expected,
        "Observability": plan.observability[0],
        "PoseCountCurve": curve,
        "NeededPoses": curve.for_accuracy(curve.position[-1]),
        "Measurements": measurements,
    }


NAMES = (
    *("Plan", "PlanBasis", "Clearance", "ChosenPoses", "Selection", "Certificate"),
    *("ExpectedAccuracy", "Observability", "PoseCountCurve", "NeededPoses", "Measurements"),
)
PAGES = ("Plan", "Observability", "PoseCountCurve", "NeededPoses", "Measurements")


@pytest.mark.parametrize("name", NAMES)
def test_a_result_is_equal_to_its_copies_and_to_nothing_else(results, name):
    result = results[name]
    for other in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert other is not result
        assert other == result
    compared = [field.name for field in dataclasses.fields(result) if field.compare]
    last = [name for name in compared if getattr(result, name) is not None][-1]
    assert dataclasses.replace(result, **{last: "other"}) != result
    assert result != name


@pytest.mark.parametrize("name", NAMES)
def test_a_result_is_shown_in_a_few_lines(results, name):
    shown = repr(results[name])
    assert shown.startswith(name)
    assert len(shown) < 1200
    assert shown.count("\n") < 10


@pytest.mark.parametrize("name", NAMES)
def test_a_result_is_plain_values(results, name):
    document = results[name].to_dict()
    assert json.loads(json.dumps(document, allow_nan=False)) == document


@pytest.mark.parametrize("name", PAGES)
def test_text_and_page_say_the_same(results, name, tmp_path):
    result = results[name]
    page = result.report(tmp_path / "new" / "page.html").read_text(encoding="utf-8")
    for label, value, _ in result.page().headlines:
        assert f"{label} " in result.text()
        assert value.replace("\N{NO-BREAK SPACE}", " ") in result.text()
        assert value in page
    assert result.page().title in page
    with pytest.raises(symkin.SymkinError, match="exists"):
        result.report(tmp_path / "new" / "page.html")


def test_arrays_of_results_do_not_change(results):
    for array in (results["Plan"].poses, results["Measurements"].rows_of(0)):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_legs_count_from_1_where_people_read(plan):
    document = plan.to_dict()
    assert [leg["leg"] for leg in document["legs"]] == [1, 2, 3]
    assert [leg["spares"] for leg in document["legs"]] == [2, 2, 2]
    (choice,) = document["selection"]["choices"]
    assert choice["legs"] == [1, 2, 3]
    assert plan.basis.choices[0].legs == (0, 1, 2)


@pytest.fixture
def framed(monkeypatch):
    """Makes a table, which is a dictionary here, whether pandas is installed or not."""

    def framed(result):
        with monkeypatch.context() as patched:
            patched.setitem(sys.modules, "pandas", types.SimpleNamespace(DataFrame=dict))
            return result.to_frame()

    return framed


@pytest.mark.parametrize("name", ["Plan", "Measurements"])
@pytest.mark.parametrize("extension", ["csv", "parquet"])
def test_a_table_of_a_result_is_its_file(results, name, extension, framed, tmp_path):
    result = results[name]
    path = result.save(tmp_path / f"table.{extension}")
    if extension == "csv":
        heading, *rows = csv.reader(path.read_text().splitlines())
        frame = framed(result)
        assert list(frame) == heading
        for column, cells in zip(frame.values(), zip(*rows, strict=True), strict=True):
            kind = type(column[0])
            assert list(column) == [kind(cell) for cell in cells]
    reader = {"Plan": symkin.read_plan, "Measurements": symkin.read_measurements}[name]
    found = reader(path, results["Plan"].mechanism)
    off = 5.0001e-10 if name == "Plan" else 0.0  # plans are written to nanometres
    for field in ("poses", "readings", "leg_sets"):
        np.testing.assert_allclose(getattr(found, field), getattr(result, field), rtol=0, atol=off)
    with pytest.raises(symkin.SymkinError, match="exists"):
        result.save(path)


def test_the_table_of_a_curve_has_a_row_a_count(results, framed):
    frame = framed(results["PoseCountCurve"])
    assert frame["poses_per_leg"].tolist() == [8, 10]
    assert frame["poses"].tolist() == [24, 30]
    errors = ["position_rms_m", "orientation_rms_rad"]
    bounds = ["position_bound_rms_m", "orientation_bound_rms_rad"]
    assert list(frame)[2:] == [*errors, *bounds, "efficiency"]
    assert list(framed(results["NeededPoses"])) == list(frame)


def test_the_columns_of_an_observability_name_its_parameters(results, paper):
    columns = results["Observability"].columns()
    assert tuple(columns["parameter"]) == paper.parameter_names
    assert results["Observability"].to_dict()["r_diagonal"]["base_angle"] > 0


def test_a_plan_from_a_file_can_be_shown(plan, paper, tmp_path):
    read = symkin.read_plan(plan.save(tmp_path / "plan.csv"), paper)
    assert "which does not say how they were chosen" in repr(read)
    assert read.to_dict()["selection"] is None
    assert "Observability" in read.report(tmp_path / "plan.html").read_text()


def test_measurements_of_one_set_and_without_a_unit(measurements, paper, tmp_path):
    whole = measurements.for_all_legs()
    assert set(whole.leg_sets.tolist()) == {-1}
    assert "leg" not in whole.columns()
    bare = symkin.Measurements.of(whole.poses, whole.readings)
    assert list(bare.columns())[-1] == "psi_3"
    with pytest.raises(symkin.SymkinError, match="give their reading_unit"):
        bare.save(tmp_path / "bare.csv")
    known = symkin.Measurements.of(whole.poses, whole.readings, reading_unit="rad")
    assert symkin.read_measurements(known.save(tmp_path / "m.csv"), paper).reading_unit == "rad"


def test_a_sample_is_taken_wherever_poses_are(paper):
    sample = symkin.sample_workspace(paper, 300, seed=1)
    plan = symkin.make_plan(paper, sample, 9, spares=0)
    for call in (
        lambda poses: observability_rows(paper, 0, poses),
        lambda poses: mechanism_rows(paper, poses),
        lambda poses: error_weight(paper, poses),
        lambda poses: expected_accuracy(paper, poses, np.eye(24)).position,
        lambda poses: analyse_observability(paper, 1, poses).r_diagonal,
        lambda poses: symkin.predict_accuracy(paper, plan, poses).position,
        lambda poses: symkin.make_plan(paper, poses, 9).poses,
        lambda poses: pose_count_curve(paper, poses, [9]).position,
        lambda poses: travel_length(paper, poses),
    ):
        np.testing.assert_array_equal(call(sample), call(sample.poses))
