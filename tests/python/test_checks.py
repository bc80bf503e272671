# SPDX-License-Identifier: MIT
"""What a check says first, and what its results and those of symmetry and workspaces can do."""

import ast
import copy
import html
import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.checks import check_mechanism
from symkin.analysis.conditions import check_conditions
from symkin.analysis.workspace.study import study_workspace
from symkin.model.settings import IdentificationSettings, NoiseSettings, WorkspaceSettings
from symkin.model.symmetry import SymmetryGroup, compare_symmetry, detect_symmetry, map_poses
from symkin.planning.simulation import disturb
from symkin.values import Value


def changed(mechanism, **changes):
    """The mechanism, undeclared, with parameters of its leg 2 changed by so much."""
    parameters = mechanism.parameters.copy()
    for name, change in changes.items():
        parameters[1, mechanism.parameter_names.index(name)] += change
    return mechanism.replace(symmetry=None).with_parameters(parameters)


def nearly(paper):
    return disturb(paper, seed=2).replace(symmetry=None)


MAKERS = {
    "check": check_mechanism,
    "check of a robot as made": lambda paper: check_mechanism(nearly(paper)),
    "check without a workspace": lambda paper: check_mechanism(paper.replace(workspace=None)),
    "check of a singular home": lambda _: check_mechanism(
        symkin.load_mechanism("3RPR").replace(
            workspace=WorkspaceSettings(lower=(-0.2, -0.2, 0.4), upper=(0.2, 0.2, 1.5)),
        )
    ),
    "sample": lambda paper: symkin.sample_workspace(paper, 50),
    "study": lambda paper: study_workspace(paper, count=300, resolution=15, both_modes=True),
    "study of a point": lambda _: study_workspace(
        symkin.load_mechanism("5bar"), count=300, resolution=15
    ),
    "conditions": lambda paper: check_conditions(paper, count=200),
    "conditions of a robot as made": lambda paper: check_conditions(nearly(paper), count=200),
    "comparison": lambda paper: compare_symmetry(nearly(paper)),
    "detection": detect_symmetry,
}
PARTS = {
    "group": lambda _: SymmetryGroup("D3", 0.4),
    "group found": lambda made: made["detection"].structure,
    "group nearly there": lambda made: made["comparison"].reference,
    "element": lambda _: SymmetryGroup("D3").elements[4],
    "frame": lambda made: made["detection"].structure.frame,
    "named group": lambda made: made["check"].groups[0],
    "element check": lambda made: made["study"].elements[3],
    "deviation": lambda made: made["comparison"].deviations[0],
    "condition": lambda made: made["conditions"].conditions[6],
    "leg origin": lambda made: made["check"].origins[1],
    "home pose": lambda made: made["check"].home,
    "slice": lambda made: made["study"].slices[1],
    "slice of a point": lambda made: made["study of a point"].slices[0],
    "slices of a mode": lambda made: made["study"].modes[1],
}


@pytest.fixture(scope="module")
def made(paper):
    results = {name: make(paper) for name, make in MAKERS.items()}
    return results | {name: take(results) for name, take in PARTS.items()}


@pytest.mark.parametrize("name", [*MAKERS, *PARTS])
def test_a_copy_and_what_was_pickled_equal_the_original(made, name):
    original = made[name]
    for other in (
        copy.copy(original),
        copy.deepcopy(original),
        pickle.loads(pickle.dumps(original)),
    ):
        assert other == original
        assert repr(other) == repr(original)
        assert type(other) is type(original)
    others = [value for key, value in made.items() if key != name]
    assert original not in others


@pytest.mark.parametrize("name", MAKERS)
def test_what_is_computed_again_is_equal(made, paper, name):
    assert MAKERS[name](paper) == made[name]


@pytest.mark.parametrize("name", [*MAKERS, *PARTS])
def test_a_result_is_shown_in_a_few_lines(made, name):
    shown = repr(made[name])
    assert len(shown) < 1200
    assert shown.count("\n") < 12
    assert " at 0x" not in shown


@pytest.mark.parametrize("name", MAKERS)
def test_a_notebook_shows_the_summary_and_text_the_page(made, name):
    result = made[name]
    title = result.page().title
    assert title in html.unescape(result._repr_html_())
    assert result.text().startswith(title)
    whole = result.text(whole=True)
    assert all(section.title.upper() in whole for section in result.page().sections)
    assert len(whole) >= len(result.text())


def stays(value):
    """Whether nothing in a value can be changed, looking into all that it holds."""
    if isinstance(value, np.ndarray):
        return not value.flags.writeable
    if isinstance(value, tuple):
        return all(map(stays, value))
    if isinstance(value, dict):
        with pytest.raises(TypeError, match="does not change"):
            value["new"] = 1
        with pytest.raises(TypeError, match="does not change"):
            value.clear()
    if isinstance(value, Value):
        name = next(iter(vars(value)))
        with pytest.raises(AttributeError):
            setattr(value, name, None)
        return all(stays(each) for key, each in vars(value).items() if key != "core")
    return not isinstance(value, list)


@pytest.mark.parametrize("name", MAKERS)
def test_a_result_and_its_copies_are_immutable_all_the_way(made, name):
    for each in (made[name], copy.deepcopy(made[name]), pickle.loads(pickle.dumps(made[name]))):
        assert stays(each)


@pytest.mark.parametrize("name", [*MAKERS, *PARTS])
def test_plain_values_are_json(made, name):
    if name != "element":  # its label says it all
        document = made[name].to_dict()
        text = json.dumps(document, allow_nan=False)
        assert json.loads(text) == document
        assert len(text) < 40_000  # no poses and no grids


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("check", ["leg", "base_angle", "home_reading_rad", "rank"]),
        ("check without a workspace", ["leg", "base_angle", "home_reading_rad"]),
        ("sample", ["x_m", "y_m", "phi_rad", "psi_1_rad", "psi_3_rad", "condition"]),
        ("study", ["working_modes", "orientation_rad", "usable_area_m2"]),
        ("conditions", ["section", "number", "holds", "figure"]),
        ("comparison", ["leg", "parameter", "deviation", "unit"]),
    ],
)
def test_a_table_has_columns_of_one_length_with_units_in_their_names(made, name, columns):
    table = made[name].columns()
    assert set(columns) <= set(table)
    assert len({len(column) for column in table.values()}) == 1


def test_a_table_is_a_frame_where_pandas_is(made):
    pandas = pytest.importorskip("pandas")
    frame = made["sample"].to_frame()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == list(made["sample"].columns())


def test_a_sample_is_taken_for_its_poses(paper, made):
    sample = made["sample"]
    np.testing.assert_array_equal(np.asarray(sample), sample.poses)
    np.testing.assert_array_equal(paper.inverse_kinematics(sample), sample.readings)
    np.testing.assert_array_equal(
        map_poses(paper, "r1", sample), map_poses(paper, "r1", sample.poses)
    )
    assert symkin.analysis.workspace.inside_workspace(paper, sample).all()
    assert len(sample) == 50


def test_the_group_of_a_pickle_carries_poses_as_the_one_that_was_found(paper):
    made = detect_symmetry(changed(paper, distal_length=1e-3), tolerance=0.01)
    again = pickle.loads(pickle.dumps(made)).structure
    assert again.name == "D_3"
    assert again.frame == made.structure.frame
    for element in again.elements:
        images = [
            symkin._core.transform_poses(group.core, element, paper.core, paper.home[None])
            for group in (again, made.structure)
        ]
        np.testing.assert_array_equal(*images)


def test_groups_in_other_places_differ():
    assert SymmetryGroup("D3") == SymmetryGroup("D3", 0.0)
    assert SymmetryGroup("D3") != SymmetryGroup("D3", 0.1)
    assert SymmetryGroup("D3") != SymmetryGroup("C3")
    assert len({SymmetryGroup("D3"), SymmetryGroup("D3")}) == 1
    with pytest.raises(AttributeError, match="does not change"):
        SymmetryGroup("D3").core = None


def test_alike_legs_need_poses_for_one(paper):
    result = check_mechanism(paper)
    assert result.verdict == "All 3 legs are alike: poses chosen for one serve all."
    assert (result.least_poses, result.shortest_design) == (8, "orbits")


def test_the_recommended_design_is_what_plan_takes_by_itself(paper):
    result = check_mechanism(paper)
    assert result.next_step == "symkin plan 3RRR --out planned"
    assert symkin.plan(paper, candidates=2000).basis.design == result.design == "legs"
    assert "72 poses; fewer by --design orbits" in result.text()


@pytest.mark.parametrize(
    "robot",
    [
        symkin.load_mechanism("linear_delta").with_device("bed probe"),
        symkin.load_mechanism("3RRR").replace(
            identification=IdentificationSettings(prior="tolerances")
        ),
        symkin.load_mechanism("3RRR_encoders"),  # two readings of a leg
        symkin.load_mechanism("3RRR").replace(
            noise=NoiseSettings(position=1e-4, orientation=1e-4, per_metre=1e-4)
        ),
    ],
)
def test_no_design_for_full_poses_is_recommended_where_others_are_observed_or_unknown(robot):
    result = check_mechanism(robot)
    assert (result.design, result.shortest_design) == ("mechanism", "mechanism")
    assert symkin.plan(robot, candidates=500).basis.design == "mechanism"
    assert "orbits" not in result.text()


def test_sensors_that_differ_are_named_beside_alike_legs(paper):
    parameters = paper.parameters.copy()
    parameters[:, -1] = 0
    result = check_mechanism(paper.with_parameters(parameters))
    assert result.verdict.startswith("All 3 legs are alike but for sensor_offset: ")
    assert "the structure has the symmetry, the sensors do not" in " ".join(result.text().split())
    assert result.page().verdict == "doubtful"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"distal_length": 0.0012}, "leg 2 differs, distal_length by 1.2 mm (1.2 tolerances)."),
        ({"base_angle": 0.003}, "leg 2 differs, base_angle by 0.17 degrees (3 tolerances)."),
    ],
)
def test_the_leg_that_is_off_is_named_in_the_units_of_a_workshop(paper, change, words):
    result = check_mechanism(changed(paper, **change))
    # Legs 1 and 3 are still images of each other, by a mirror that flips the working modes.
    assert result.verdict == f"The legs are alike within tolerances, not exactly: {words}"
    assert result.shortest_design == "mechanism"
    assert "Where the legs differ" in result.text()


def test_legs_of_two_kinds_are_listed(hexapod):
    legs = list(hexapod.legs)
    central = dict(legs[0].parameters, base_radius=0.0, platform_radius=0.0)
    legs.append(symkin.Leg(legs[0].chain, central, legs[0].working_mode))
    result = check_mechanism(hexapod.replace(legs=legs, symmetry=None, workspace=None))
    assert result.verdict == (
        "The legs are of 2 kinds (legs 1, 2, 3, 4, 5, 6; leg 7): poses for one of each."
    )
    assert result.shortest_design == "mechanism"


def test_the_page_has_the_theory_last_and_folded(made):
    page = made["check of a robot as made"].page()
    folded = [section.anchor for section in page.sections if section.details]
    assert folded == ["symmetry", "conditions"]
    assert [section.anchor for section in page.sections][-2:] == folded
    assert page.sections[0].anchor == "differences"


def test_a_condition_that_fails_alone_is_named():
    result = check_mechanism(symkin.load_mechanism("4RRR"))
    (note,) = result.page().notes
    assert "(4(1), as many legs as degrees of freedom) does not hold" in note
    assert result.page().verdict == "good"


@pytest.mark.parametrize("name", ["3RRR", "3RRR_asymmetric", "4RRR", "5bar"])
def test_the_design_that_is_recommended_can_be_planned(name):
    robot = symkin.load_mechanism(name)
    for each in (robot, disturb(robot, seed=1).replace(symmetry=None)):
        design = check_mechanism(each).shortest_design
        plan = symkin.make_plan(each, symkin.sample_workspace(each, 200).poses, 16, design=design)
        assert np.count_nonzero(~plan.spare) >= 16


def test_a_parameter_that_no_pose_shows_makes_the_check_bad_and_more_poses_no_remedy(paper):
    still = WorkspaceSettings(
        lower=(-0.2, -0.2, -1e-9), upper=(0.2, 0.2, 1e-9), characteristic_length=0.9
    )
    result = check_mechanism(paper.replace(workspace=still, source=None))
    assert result.blind
    assert result.page().verdict == "bad"
    assert "more poses do not help" in result.next_step
    assert any("no pose shows" in doubt for doubt in result.page().doubts)


def test_a_mechanism_of_no_file_is_planned_in_python(paper):
    result = check_mechanism(paper.replace(source=None))
    assert result.next_step == "symkin.plan(mechanism)"


def test_the_rooms_form_no_circle():
    package = Path(symkin.__file__).parent
    lower = {
        "symmetry": ("workspace", "conditions", "checks", "planning", "identification"),
        "workspace": ("conditions", "checks", "planning", "identification"),
    }
    for room, above in lower.items():
        for path in (package / room).glob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                name = node.module if isinstance(node, ast.ImportFrom) else None
                assert not (name or "").startswith(tuple(f"symkin.{each}" for each in above)), path


def test_legs_a_dozen_tolerances_apart_are_not_alike():
    result = check_mechanism(symkin.load_mechanism("hangprinter"))
    assert result.verdict == (
        "The legs are not alike: leg 3 differs most, base_radius by 65 mm (13 tolerances)."
    )


def test_tables_of_a_check_count_legs_from_1(paper):
    columns = check_mechanism(paper).columns()
    assert columns["leg"] == [1, 2, 3]
    assert columns["reference"] == [1, 1, 1]


@pytest.mark.parametrize(
    ("radius", "names"), [(0.5, set()), (0.44, {"base_height", "base_radius"})]
)
def test_what_a_drawing_knows_better_is_told_before_anything_is_measured(radius, names):
    """Between circles of unlike radii a base's height is almost the offset of the sensors."""
    robot = symkin.load_mechanism("3RPS")
    parameters = robot.parameters.copy()
    parameters[:, robot.parameter_names.index("platform_radius")] = radius
    found = check_mechanism(robot.with_parameters(parameters))
    assert set(found.weak) == names | ({"sensor_offset"} if names else set())
    assert all(times > 10 for times in found.weak.values())
    told = found.to_dict()["measuring"]["deviations_in_tolerances"]
    assert told == pytest.approx(dict(found.weak))
    assert ("3 worse than the drawing" in found.text()) == bool(names)
    assert any("--prior tolerances" in note for note in found.page().notes) == bool(names)


def test_what_is_expected_of_parameters_is_what_is_found_of_them():
    robot = symkin.load_mechanism("3RPS")
    parameters = robot.parameters.copy()
    parameters[:, robot.parameter_names.index("platform_radius")] = 0.44
    drawn = robot.with_parameters(parameters)
    weak = check_mechanism(drawn).weak
    plan = drawn.plan(candidates=1000, design="legs")
    found = symkin.identify(drawn, symkin.simulate(drawn, plan, 1))
    assert found.trustworthy
    height = found.params["leg1.base_height"]
    assert 0.1 < height.deviation / height.tolerance / weak["base_height"] < 3
