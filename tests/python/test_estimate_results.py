# SPDX-License-Identifier: MIT
"""Results of simulation, identification and evaluation are plain values that say the same thing."""

import copy
import html
import json
import pickle
import re
import sys
import types

import numpy as np
import pytest

import symkin
from symkin.estimate import EstimateOptions, Outlier
from symkin.model.settings import ProtocolSettings
from symkin.present import Table
from symkin.results import Result
from symkin.show.rendering import page_html
from symkin.show.wording import bare


@pytest.fixture(scope="module")
def ran(paper):
    settings = ProtocolSettings(pose_count=12, candidates=300, seed=3)
    return symkin.run_protocol(paper.replace(protocol=settings))


@pytest.fixture(scope="module")
def results(ran):
    found = ran.identification.cross_validated(3)
    return {
        "Estimate": found,
        "EstimateOptions": found.options,
        "LegFit": found.legs[1],
        "GoodnessOfFit": found.goodness[0],
        "Outlier": Outlier(3, 5, "closure of leg 2", 1, 4.5, 1e-6),
        "ResidualTest": found.tests[0],
        "CrossValidation": found.cross_validation,
        "Evaluation": found.after,
        "AlignedErrors": found.after.aligned,
        "Simulation": ran.simulation,
        "EstimatorFigures": ran.comparison[0],
        "ProtocolResult": ran,
    }


NAMES = (
    "Estimate",
    "EstimateOptions",
    "LegFit",
    "GoodnessOfFit",
    "Outlier",
    "ResidualTest",
    "CrossValidation",
    "Evaluation",
    "AlignedErrors",
    "Simulation",
    "EstimatorFigures",
    "ProtocolResult",
)
PAGES = ("Estimate", "CrossValidation", "Evaluation", "Simulation", "ProtocolResult")


@pytest.fixture(params=NAMES)
def result(request, results):
    found = results[request.param]
    assert type(found).__name__ == request.param
    return found


@pytest.fixture(params=PAGES)
def told(request, results):
    """A result that has a page."""
    return results[request.param]


def arrays_of(value):
    """All arrays in the fields of a value."""
    return [each for each in vars(value).values() if isinstance(each, np.ndarray)]


def test_a_result_prints_as_a_few_lines(result):
    shown = repr(result)
    assert shown.startswith(type(result).__name__)
    assert shown.count("\n") < 12
    assert len(shown) < 1200


@pytest.mark.parametrize(
    "copied",
    [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))],
    ids=["copy", "pickle"],
)
def test_a_copy_is_equal_and_as_fixed_as_the_original(result, copied):
    again = copied(result)
    assert again is not result
    assert again == result
    assert not any(each.flags.writeable for each in arrays_of(again))
    assert repr(again) == repr(result)


def test_results_that_differ_in_one_number_are_not_equal(results, paper):
    found = results["Estimate"]
    other = symkin.identify(paper, found.measurements, max_iterations=99)
    assert symkin.identify(paper, found.measurements) == symkin.identify(paper, found.measurements)
    assert other != symkin.identify(paper, found.measurements)
    assert results["Evaluation"] != found.before
    assert results["LegFit"] != found.legs[0]


def test_arrays_of_a_result_are_read_only(result):
    for values in arrays_of(result):
        with pytest.raises(ValueError, match="read-only"):
            values.flat[0] = 1


def test_a_result_has_a_json_form(result):
    document = result.to_dict()
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_legs_and_rows_count_from_one_in_the_json_form(results):
    assert [fit.to_dict()["legs"] for fit in results["Estimate"].goodness] == [[1], [2], [3]]
    found = results["Estimate"].to_dict()["identification"]
    assert [leg["leg"] for leg in found["legs"]] == [1, 2, 3]
    assert found["tests"][0]["legs"][0] >= 1


def test_the_parameters_come_as_a_table(results):
    found = results["Estimate"]
    columns = found.columns()
    assert list(columns) == [
        *("name", "unit", "nominal", "value", "change", "standard_deviation"),
        *("tolerance", "prior", "change_in_tolerances", "status"),
    ]
    assert {len(values) for values in columns.values()} == {24}
    assert columns["name"][8] == "leg2.proximal_length"
    np.testing.assert_allclose(columns["nominal"] + columns["change"], columns["value"], atol=1e-15)
    truth = results["ProtocolResult"].columns()
    np.testing.assert_allclose(truth["value"] - truth["true"], truth["error"], atol=1e-15)


def test_errors_come_as_a_table_with_the_rows_of_the_source(results):
    after = results["Evaluation"]
    columns = after.columns()
    assert list(columns["row"]) == list(results["Simulation"].measurements.row_numbers)
    rms = np.sqrt(np.mean(np.square(columns["position_error_m"])))
    assert rms == pytest.approx(after.position_rms)
    unseen = results["CrossValidation"].columns()
    assert list(unseen) == ["row", "closure_1_m", "closure_2_m", "closure_3_m"]


def test_a_frame_has_the_columns(told, monkeypatch):
    pandas = types.SimpleNamespace(DataFrame=lambda columns: ("frame", columns))
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    kind, columns = told.to_frame()
    assert kind == "frame"
    assert list(columns) == list(told.columns())
    assert len({len(values) for values in columns.values()}) == 1


def test_a_frame_without_pandas_says_what_is_missing(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        results["Estimate"].to_frame()


def spoken(text):
    """Text with the characters of a keyboard."""
    return html.unescape(re.sub("<[^>]*>", "", text)).translate(
        {0xA0: " ", ord("\N{MINUS SIGN}"): "-", ord("\N{EN DASH}"): "-"}
    )


def test_text_and_html_say_the_same_numbers(told):
    assert isinstance(told, Result)
    page, text = told.page(), told.text()
    published = spoken(page_html(page))
    said = [value for _, value, _ in page.headlines]
    for each in page.errors:
        known = (each.before, each.after, each.expected, each.bound, each.aligned)
        known += (each.largest, *(each.measured or ()))
        said += [bare(value, each.unit) for value in known if value is not None]
    for section in page.sections:
        for part in section.parts:
            if isinstance(part, Table) and part.brief and not part.brief_rows:
                said += [cell for group in part.groups for row in group.rows for cell in row]
    assert len(said) > 1
    for each in map(spoken, said):
        assert each in " ".join(text.split())
        assert each in published
    for doubt in page.doubts:
        assert f"Doubt: {spoken(doubt)}" in " ".join(text.split())
    end = " ".join(text.split())
    ordered = page.next_command.replace("{folder}", "DIR")
    assert end.endswith(ordered or page.next_step)
    assert page.next_step in end


def test_the_answer_stands_before_everything_else(results):
    page = results["Estimate"].page()
    first = [part for section in page.sections for part in section.parts if isinstance(part, Table)]
    assert [table.caption for table in first[:2]] == [
        "Identified parameters",
        "Rows that fit worst",
    ]
    text = results["Estimate"].text(whole=True)
    assert text.index("nothing speaks against") < text.index("End effector, rms")
    assert text.index("End effector, rms") < text.index("Identified parameters")
    assert text.index("Next: ") > text.index("Identified parameters")


def test_changes_from_the_drawing_are_in_millimetres_degrees_and_percent(results):
    found = results["Estimate"]
    table = found.page().sections[0].parts[0]
    shown = {row[0]: row[-2].replace("\N{MINUS SIGN}", "-") for row in table.groups[0].rows}
    changes = dict(zip(found.nominal.parameter_names, found.changes[0], strict=True))
    for name, unit, factor in (
        ("proximal_length", " mm", 1e3),
        ("base_angle", "\N{DEGREE SIGN}", 180 / np.pi),
        ("sensor_gain", " %", 100),
    ):
        assert shown[name].endswith(unit)
        value = float(shown[name].removesuffix(unit))
        decimals = len(shown[name].removesuffix(unit).partition(".")[2])
        assert value == pytest.approx(factor * changes[name], abs=0.51 * 10.0**-decimals)


def test_the_worst_rows_are_named_by_their_numbers_in_the_file(results, paper):
    measurements = results["Simulation"].measurements
    readings = measurements.readings.copy()
    readings[7, 1] += 0.01
    spoilt = symkin.Measurements(
        measurements.poses, readings, measurements.leg_sets, measurements.row_numbers
    )
    found = symkin.identify(paper, spoilt)
    table = next(
        part
        for part in found.page().sections[1].parts
        if isinstance(part, Table) and part.caption == "Rows that fit worst"
    )
    row = table.groups[0].rows[0]
    assert row[:2] == [str(measurements.row_numbers[7]), "closure of leg 2"]
    assert row[-1] == "does not fit"
    (outlier,) = found.outliers
    assert outlier.row_number == measurements.row_numbers[outlier.row]
    assert outlier.to_dict()["row"] == outlier.row_number
    assert "settle the doubts" in found.text()


@pytest.mark.parametrize(
    ("option", "value"), [("estimator", "joynt"), ("poses", "some"), ("loss", "hubber")]
)
def test_a_wrong_option_names_the_valid_ones(results, paper, option, value):
    said = rf"{option} is '{value}'; expected (\"\w+\",? )+or \"\w+\"$"
    with pytest.raises(symkin.SymkinError, match=said):
        symkin.identify(paper, results["Simulation"].measurements, **{option: value})
    with pytest.raises(symkin.SymkinError, match=option):
        EstimateOptions(**{option: value})


def test_a_sample_is_evaluated_like_its_poses(ran):
    model, actual = ran.nominal, ran.simulation.actual
    of_poses = symkin.evaluate(model, actual=actual, poses=ran.candidates.poses)
    assert symkin.evaluate(model, actual=actual, poses=ran.candidates) == of_poses


def test_matplotlib_is_not_needed_for_a_prompt():
    code = (
        "import sys, symkin; robot = symkin.load_mechanism('3RRR');"
        "settings = symkin.model.settings.ProtocolSettings(pose_count=10, candidates=100);"
        "ran = symkin.run_protocol(robot.replace(protocol=settings));"
        "repr(ran), repr(ran.identification), repr(ran.before);"
        "sys.exit('matplotlib' in sys.modules)"
    )
    import subprocess

    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
