# SPDX-License-Identifier: MIT
"""Parameters that follow others: equations of them, with factors and sums."""

import dataclasses
import json
import re

import numpy as np
import pytest

import symkin
from symkin.cli import main
from symkin.data.reading import write_measurements
from symkin.errors import SymkinError
from symkin.estimate.ties import Equation, equation_of, solved
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup
from symkin.model.settings import IdentificationSettings, NoiseSettings
from symkin.planning.simulation import disturb
from symkin.show.estimate import parameter_section

UNITS = {"leg1.a": "m", "leg2.a": "m", "leg1.k": "m/rad", "leg2.k": "m/rad", "leg1.g": "rad"}


@pytest.fixture
def reference(shared_reference):
    return json.loads((shared_reference / "observations.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def robot():
    return symkin.load_mechanism("3RRR")


@pytest.fixture(scope="module")
def measured(robot):
    poses = symkin.sample_workspace(robot, 40, seed=3).poses
    actual = disturb(robot, 5)
    random = np.random.default_rng(1)
    readings = actual.inverse_kinematics(poses)
    return symkin.Measurements.of(
        poses + random.normal(0, [1e-5, 1e-5, 1e-5], poses.shape),
        readings + random.normal(0, 1e-5, readings.shape),
        reading_unit="rad",
    )


@pytest.mark.parametrize(
    ("text", "factors", "constant", "is_sum"),
    [
        ("leg1.a = leg2.a", (1, -1), 0, False),
        ("leg1.a = 2 leg2.a", (1, -2), 0, False),
        ("leg1.a = leg2.a / 2 + 3 mm", (1, -0.5), 0.003, True),
        ("2 * (leg1.a - leg2.a) = 10 um", (2, -2), 1e-5, True),
        ("leg1.a + leg2.a = 0.2 m", (1, 1), 0.2, True),
        ("leg1.k = leg2.k", (1, -1), 0, False),
    ],
)
def test_a_tie_is_read_with_its_factors_and_its_constant(text, factors, constant, is_sum):
    tie = equation_of(text, UNITS)
    np.testing.assert_allclose(list(tie.factors.values()), factors, rtol=1e-12)
    np.testing.assert_allclose(tie.constant, constant, rtol=1e-9, atol=1e-15)
    assert tie.measured == is_sum


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("leg1.a", "is no equation"),
        ("leg1.a = leg3.a", 'leg3.a is no unknown; did you mean "leg'),
        ("leg1.a = leg1.g", "is of unknowns in m and rad"),
        ("a = 2 m", "a of which leg"),
        ("leg1.a * leg2.a = 1", "a side"),
        ("1 / leg1.k = 3", "a side|not linear"),
        ("0.1 m = 100 mm", "names no unknown"),
        ("leg1.a = leg1.a", "says nothing"),
    ],
)
def test_a_tie_that_cannot_be_is_refused_in_a_sentence(text, why):
    with pytest.raises(SymkinError, match=why):
        equation_of(text, UNITS)


@pytest.mark.parametrize("number", range(6))
def test_ties_leave_what_the_reference_says_or_are_refused_by_name(number, reference):
    case = reference["tie_cases"][number]
    ties = [
        Equation(f"tie {i}", {name: by for by, name in tie["terms"]}, tie["constant"], False)
        for i, tie in enumerate(case["ties"])
    ]
    if "contradiction" in case:
        with pytest.raises(SymkinError, match="contradict") as refused:
            solved(ties, case["free"], case["scalars"])
        named = re.findall(r"tie (\d)", str(refused.value))
        assert [int(each) for each in named] == case["contradiction"]
        return
    found = solved(ties, case["free"], case["scalars"])
    assert [name for name in case["free"] if name not in found.by] == case["independent"]
    by = {name: {name: 1.0} for name in case["independent"]} | found.by
    rows = [[by[name].get(other, 0.0) for other in case["independent"]] for name in case["free"]]
    np.testing.assert_allclose(rows, case["Theta"], atol=1e-12)
    constants = [found.constants.get(name, 0.0) for name in case["free"]]
    np.testing.assert_allclose(constants, case["constant"], atol=1e-12)


def test_a_five_bar_with_ties_is_identified_as_by_explicit_least_squares(reference):
    (case,) = (each for each in reference["cases"] if each["name"] == "five_bar_ties")
    drawn, names = symkin.load_mechanism("5bar"), symkin.load_mechanism("5bar").parameter_names
    legs = tuple(
        dataclasses.replace(
            leg,
            parameters={name: case["scalars"][f"{name}_{number}"] for name in names},
            working_mode=case["working_modes"][number - 1],
        )
        for number, leg in enumerate(drawn.legs, 1)
    )
    taken = case["measurements"]
    noise = NoiseSettings(taken["position_sd"][0], 0.0, taken["reading_sd"])
    home = dataclasses.replace(drawn.workspace, home=tuple(case["start_poses"][0]))
    robot = drawn.replace(legs=legs, symmetry=None, noise=noise, workspace=home)
    measured = symkin.Measurements.of(
        taken["position"], taken["readings"], reading_unit="rad", pose_space="point"
    )
    ties = [re.sub(r"([a-z_]+)_(\d)", r"leg\2.\1", tie["text"]) for tie in case["ties"]]
    found = symkin.identify(robot, measured, tie=ties, fixed=["sensor_gain"])
    expected = case["expected"]
    assert found.chi_square == pytest.approx(expected["chi_square"], rel=1e-8)
    assert found.degrees_of_freedom == expected["degrees_of_freedom"]
    assert found.rank == expected["rank"]
    for name, value, deviation in zip(
        case["free"], expected["estimate"], expected["sd"], strict=True
    ):
        parameter, _, leg = name.rpartition("_")
        unknown = found.params[f"leg{leg}.{parameter}"]
        assert unknown.value == pytest.approx(value, abs=1e-6 * deviation)
        assert unknown.deviation == pytest.approx(deviation, rel=1e-6)
    variances = np.diag(found.parameter_covariance).reshape(2, -1)
    np.testing.assert_allclose(variances[0, :3], variances[1, :3])


def test_a_tie_of_equal_parameters_does_what_sharing_them_does(robot, measured):
    tied = symkin.identify(robot, measured, tie=["leg1.distal_length = leg2.distal_length"])
    shared = symkin.identify(robot, measured, shared=["leg[12].distal_length"])
    np.testing.assert_allclose(tied.mechanism.parameters, shared.mechanism.parameters, rtol=1e-9)
    np.testing.assert_allclose(tied.parameter_covariance, shared.parameter_covariance, rtol=1e-6)
    assert tied.params["leg2.distal_length"].status == "tied"
    assert tied.params["leg2.distal_length"].shown


def test_a_drawing_that_breaks_a_tie_is_where_the_fit_starts_from(robot, measured):
    names = robot.parameter_names
    parameters = robot.parameters.copy()
    parameters[1, names.index("distal_length")] += 4e-4
    drawn = robot.with_parameters(parameters, symmetry=None)
    found = symkin.identify(drawn, measured, tie=["leg1.distal_length = leg2.distal_length"])
    lengths = found.mechanism.parameters[:, names.index("distal_length")]
    assert found.converged
    assert lengths[0] == pytest.approx(lengths[1], abs=1e-15)


def test_parameters_that_are_equal_are_one_draw_and_of_a_stated_sum_both_are(robot, measured):
    tolerance = robot.tolerances.length
    names = ("leg1.proximal_length", "leg1.distal_length")
    total = sum(robot.legs[0].parameters[name.partition(".")[2]] for name in names)
    equal, stated = f"{names[1]} = leg2.distal_length", f"{names[0]} + {names[1]} = {total!r} m"
    for tie, prior, meant in (
        (equal, tolerance, ", one draw"),
        (stated, tolerance / np.sqrt(2), ", measured"),
        (f"{equal}, measured", tolerance / np.sqrt(2), ""),
        (f"{stated}, one draw", tolerance, ""),
    ):
        found = symkin.identify(robot, measured, tie=[tie], prior="tolerances")
        first = tie.partition(" ")[0]
        assert found.params[first].prior == pytest.approx(prior)
        said = parameter_section(found).paragraphs
        assert f"Tied: {tie}{meant}." in said


def test_a_tie_within_a_deviation_and_a_sum_of_three_are_priors_of_several_unknowns(robot):
    tolerance = robot.tolerances.length
    lengths = [f"leg{leg}.distal_length" for leg in (1, 2, 3)]

    def laid_out(**given):
        return Layout.of(robot, core_setup(robot), prior="tolerances", **given)

    def known(layout, *names):
        columns = [layout.names.index(name) for name in names]
        return np.linalg.inv(layout.prior_information)[np.ix_(columns, columns)]

    near = laid_out(tie=["distal_length by role within 10 um"])
    assert (near.relations != 0).sum(axis=1).tolist() == [2, 2]
    covariance = known(near, *lengths[:2])
    difference = [1, -1] @ covariance @ [1, -1]
    assert difference == pytest.approx(1 / (1e-5**-2 + (2 * tolerance**2) ** -1), rel=1e-6)
    total = sum(robot.legs[0].parameters["distal_length"] for _ in lengths)
    three = laid_out(tie=[f"{' + '.join(lengths)} = {total + 3e-4!r} m"])
    # Each draw is as likely off as the others, and their sum is known.
    np.testing.assert_allclose(
        known(three, *lengths[:2]), tolerance**2 * (np.eye(2) - 1 / 3), rtol=1e-9
    )
    shift = dict(zip(three.scalars, three.shift, strict=True))
    np.testing.assert_allclose([shift[name] for name in lengths], 1e-4)
    with pytest.raises(SymkinError, match="says nothing of what is free"):
        laid_out(tie=[f"{lengths[0]} = {lengths[1]} within 1 mm"], fixed=["distal_length"])
    with pytest.raises(SymkinError, match="width of tie"):
        laid_out(tie=[f"{lengths[0]} = {lengths[1]} within 1 rad"])


def test_a_tie_within_a_deviation_is_weighed_against_all_else(robot, measured):
    pair = ("leg1.distal_length", "leg2.distal_length")
    free = symkin.identify(robot, measured, prior="tolerances")
    a, b = (free.params[name].value for name in pair)
    places = [free.names.index(name) for name in pair]
    spread = np.sqrt([1, -1] @ free.covariance[np.ix_(places, places)] @ [1, -1])
    for more, doubted in ((0.0, False), (5e-3, True)):
        tie = f"{' = '.join(pair)} + {more} m within 10 um"
        found = symkin.identify(robot, measured, prior="tolerances", tie=[tie])
        (strain,) = found.strains
        # All else is the estimate without the tie.
        others = a - b - more
        assert strain.others == pytest.approx(others, rel=1e-2)
        assert strain.others_deviation == pytest.approx(spread, rel=1e-2)
        assert strain.statistic == pytest.approx(others / np.hypot(spread, 1e-5), rel=1e-2)
        assert ("tie-strained" in {each.code for each in found.doubts}) == doubted
        assert any("of its deviations; all else has" in each
                   for each in parameter_section(found).paragraphs)  # fmt: skip


def test_ties_are_said_in_the_file_and_on_the_command_line_and_load_back(robot, measured, tmp_path):
    tie = "leg1.platform_radius = leg3.platform_radius, measured"
    settings = IdentificationSettings(tie=(tie,))
    robot.replace(identification=settings).save(tmp_path / "robot.toml")
    again = symkin.load_mechanism(tmp_path / "robot.toml")
    assert again.identification == settings
    write_measurements(measured, tmp_path / "measured.csv", robot)
    main([
        "identify", "3RRR", str(tmp_path / "measured.csv"), "--tie", tie, "--no-report",
        "--out", str(tmp_path / "found"),
    ])  # fmt: skip
    text = (tmp_path / "found" / "results.json").read_text(encoding="utf-8")
    assert json.dumps(tie) in text
    assert '"tied"' in text


def test_what_is_shared_and_tied_and_what_contradicts_is_refused(robot, measured):
    tie = "leg1.distal_length = leg2.distal_length"
    with pytest.raises(SymkinError, match="is shared and tied"):
        symkin.identify(robot, measured, tie=[tie], shared=["distal_length"])
    other = "leg2.distal_length - leg1.distal_length = 1 mm"
    with pytest.raises(SymkinError, match=f'"{tie}" and "{other}" contradict each other'):
        symkin.identify(robot, measured, tie=[tie, other])
    pair = r"of two names: --tie 'leg1\.proximal_length = leg1\.distal_length'"
    with pytest.raises(SymkinError, match=pair):
        symkin.identify(robot, measured, shared=["leg1.*_length"])
