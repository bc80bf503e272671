# SPDX-License-Identifier: MIT
"""Workspaces: their shape, singularities and symmetry."""

import dataclasses
import io
import json
import math
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

import symkin
from symkin.analysis.workspace.study import (
    _connected_regions,
    check_elements,
    constant_orientations,
    mode_slices,
    other_working_modes,
    singular_orientations,
    study_workspace,
)
from symkin.cli import main
from symkin.errors import SymmetryError
from symkin.model.settings import JointLimits
from symkin.model.symmetry import SymmetryGroup
from symkin.plot import active_joints, workspace


@pytest.fixture(scope="module")
def study(paper):
    return study_workspace(paper, count=3000, resolution=61)


@pytest.fixture(scope="module")
def five_bar():
    return symkin.load_mechanism("5bar")


def test_the_reachable_area_is_that_of_three_overlapping_discs(paper):
    # A leg reaches b within l + L of its base point, so at one orientation the platform's origin
    # within a disc about A - Rot(phi) b.
    for found in constant_orientations(paper, resolution=301):
        x, y = np.meshgrid(found.x, found.y)
        inside = np.ones_like(x, dtype=bool)
        for leg in paper.legs:
            p = leg.parameters
            base = p["base_radius"] * np.exp(1j * p["base_angle"])
            turned = found.orientation + p["platform_angle"]
            centre = base - p["platform_radius"] * np.exp(1j * turned)
            inside &= np.abs(x + 1j * y - centre) <= p["proximal_length"] + p["distal_length"]
        np.testing.assert_array_equal(found.reach_margin >= 0, inside)


def test_the_papers_three_workspaces_lie_on_one_side_of_the_singularities(paper, study):
    assert [found.orientation for found in study.slices] == [0.0, 0.4, 0.6]
    for found in study.slices:
        assert set(np.unique(found.side)) == {0, 1}
        assert found.usable.any()
    other = constant_orientations(other_working_modes(paper), resolution=61)
    assert [set(np.unique(found.side)) for found in other] == [{0, 1}, {0, -1}, {0, -1}]


def test_a_parallel_singularity_lies_between_them_in_the_other_working_mode(paper):
    assert singular_orientations(paper) == pytest.approx([-0.359], abs=1e-3)
    other = other_working_modes(paper)
    found = singular_orientations(other)
    assert found == pytest.approx([0.359], abs=1e-3)
    poses = np.array([[0, 0, found[0] + step] for step in (-1e-4, 1e-4)])
    _, parallel, _ = other.singularity_measures(poses)
    assert parallel[0] * parallel[1] < 0


def test_similar_triangles_at_one_orientation_are_singular():
    found = singular_orientations(symkin.load_mechanism("3RPR"))
    assert found == pytest.approx([0, math.pi], abs=1e-9)


def test_the_serial_measure_vanishes_where_the_reach_ends(study):
    found = study.slices[0]
    rim = np.abs(found.reach_margin) < 0.01
    inside = rim & (found.reach_margin >= 0)
    assert np.nanmax(found.serial[inside]) < 0.3 * np.nanmax(found.serial)
    assert np.isnan(found.serial[found.reach_margin < 0]).all()


def test_regions_are_connected_through_sides_and_numbered_by_size():
    side = np.array(
        [
            [1, 1, 0, -1, -1],
            [1, 0, 0, 0, -1],
            [1, 1, 1, 0, -1],
            [0, 0, 1, 0, -1],
            [-1, 0, 1, 1, 1],
        ],
        dtype=np.int8,
    )
    expected = [
        [1, 1, 0, 2, 2],
        [1, 0, 0, 0, 2],
        [1, 1, 1, 0, 2],
        [0, 0, 1, 0, 2],
        [3, 0, 1, 1, 1],
    ]
    np.testing.assert_array_equal(_connected_regions(side), expected)


def test_a_winding_region_is_one():
    side = np.ones((41, 41), dtype=np.int8)
    for column in range(1, 41, 4):
        side[:-1, column] = 0
    for column in range(3, 41, 4):
        side[1:, column] = 0
    labels = _connected_regions(side)
    np.testing.assert_array_equal(labels, side.astype(int))


def test_aspect_areas_are_negative_beyond_a_parallel_singularity(five_bar):
    (found,) = constant_orientations(other_working_modes(five_bar), resolution=101)
    areas = found.aspect_areas
    assert areas[0] > 0 > areas[1]
    assert np.abs(areas).sum() == pytest.approx(found.cell_area * (found.side != 0).sum())
    assert found.usable_area < areas[0]


def test_the_workspace_is_carried_onto_itself_by_rotations_alone(study):
    assert study.workspace_group == ("r0", "r1", "r2")
    assert [check.keeps_modes for check in study.elements] == 3 * [True] + 3 * [False]
    assert all(check.mismatches == 0 for check in study.elements)
    assert max(check.reading_deviation for check in study.elements) <= 1e-12


def test_a_reflection_may_keep_the_modes_but_not_the_side_of_the_singularities():
    mechanism = symkin.load_mechanism("3RPR")
    group = symkin.detect_symmetry(mechanism).structure
    checks = check_elements(mechanism, group, 1000, 1)
    assert all(check.keeps_modes for check in checks)
    assert [check.keeps_aspect for check in checks] == 3 * [True] + 3 * [False]


def test_joint_limits_that_are_not_mirrored_break_the_workspace_theorem(five_bar):
    limited = five_bar.replace(joint_limits=JointLimits(-2.0, 1.0))
    study = study_workspace(limited, count=2000, resolution=21)
    assert study.workspace_group == ("r0",)
    (mirror,) = (check for check in study.elements[1:] if check.keeps_modes)
    assert mirror.mismatches > 0
    assert mirror.reading_deviation <= 1e-12


def test_an_element_that_the_legs_do_not_have_is_refused(paper):
    parameters = paper.parameters.copy()
    parameters[1, 4] += 1e-3
    broken = paper.replace(symmetry=None).with_parameters(parameters)
    with pytest.raises(SymmetryError, match="r1"):
        check_elements(broken, SymmetryGroup("C3"), 100, 1)


def test_a_point_platform_has_one_workspace_without_orientation(five_bar):
    (found,) = constant_orientations(five_bar, [0.0, 0.4], resolution=21)
    assert math.isnan(found.orientation)
    assert singular_orientations(five_bar).size == 0


def test_a_spatial_platform_is_cut_at_the_height_of_home(hexapod):
    slices = constant_orientations(hexapod, [0.0, math.pi / 2], resolution=21)
    assert (slices[0].side == 1).all()
    assert np.isinf(slices[0].reach_margin).all()
    assert np.abs(slices[1].parallel).max() < 1e-9  # turned by 90 degrees it is singular
    assert (slices[1].side == 0).all()


def test_a_chain_with_one_root_has_no_other_modes():
    assert other_working_modes(symkin.load_mechanism("3RPR")) is None


def test_the_same_seed_gives_the_same_study(paper, study):
    again = study_workspace(paper, count=3000, resolution=61)
    np.testing.assert_array_equal(again.sample.poses, study.sample.poses)
    assert again.elements == study.elements


def test_impossible_studies_are_refused(paper):
    with pytest.raises(symkin.SymkinError, match="at least 2 cells"):
        constant_orientations(paper, resolution=1)
    with pytest.raises(symkin.SymkinError, match="no workspace"):
        study_workspace(paper.replace(workspace=None))
    singular = symkin.load_mechanism("3RPR")
    at_zero = dataclasses.replace(singular.workspace, home=(0.0, 0.0, 0.0))
    with pytest.raises(symkin.SymkinError, match=r"home pose .* is singular"):
        constant_orientations(singular.replace(workspace=at_zero), resolution=5)


def test_figures_have_a_panel_for_each_workspace(paper, study):
    other = mode_slices(other_working_modes(paper), resolution=61)
    figure = workspace([*study.modes, other])
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 6
    assert figure.axes[1].get_title() == "working mode -1, 22.92\N{DEGREE SIGN}"
    joints = active_joints(study)
    assert [axes.name for axes in joints.axes].count("3d") == 4
    for drawn in (figure, joints):
        drawn.savefig(io.BytesIO(), dpi=30)


def test_figures_hold_for_two_legs_and_for_orientations_out_of_reach(five_bar, paper):
    two = study_workspace(five_bar, count=500, resolution=21)
    active_joints(two).savefig(io.BytesIO(), dpi=30)
    far = study_workspace(paper, [0.0, 2.0], count=500, resolution=21)
    active_joints(far).savefig(io.BytesIO(), dpi=30)
    workspace(far.modes).savefig(io.BytesIO(), dpi=30)


def test_the_command_prints_and_writes_the_study(tmp_path, capsys):
    arguments = ["workspace", "3RRR", "--out", str(tmp_path), "--orientations", "0,0.4"]
    arguments += ["--count", "2000", "--resolution", "41", "--both-modes"]
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert "structure D_6 (D_3)" in printed
    assert re.search("Carried onto itself by +r0, r1, r2", printed)
    document = json.loads((tmp_path / "workspace.json").read_text(encoding="utf-8"))
    assert [check["mismatches"] for check in document["elements"]] == [0] * 6
    modes = document["constant_orientations"]
    assert [found["working_modes"][0] for found in modes] == [-1, 1]
    assert [found["orientation_rad"] for found in modes[1]["slices"]] == [0, 0.4]
    assert {path.name for path in tmp_path.iterdir()} == {"workspace.json", "workspace.html"}
    page = (tmp_path / "workspace.html").read_text(encoding="utf-8")
    for figure in ("active_joints", "constant_orientations"):
        assert page.count(f'id="figure-{figure}"') == 1
    assert "hold" in page
    assert main([*arguments, "--json", "--overwrite"]) == 0
    assert json.loads(capsys.readouterr().out) == document


def test_the_command_refuses_what_is_no_angle(tmp_path, capsys):
    assert main(["workspace", "3RRR", "--out", str(tmp_path), "--orientations", "0,north"]) == 2
    assert '"north"' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "place", "unit"),
    [("3RRR", "orientation_rad", "m"), ("3RPS", "height_m", "rad"),
     ("agile_eye", "orientation_rad", "rad"), ("3UPU", "height_m", "m"),
     ("h4_rods", "orientation_rad", "m"), ("2rps_ups", "orientation_rad", "m")],
)  # fmt: skip
def test_a_slice_says_in_which_units_it_is(name: str, place: str, unit: str) -> None:
    study = symkin.study_workspace(symkin.load_mechanism(name), count=100, resolution=11)
    areas = [f"{kind}_{unit}2" for kind in ("reachable_area", "usable_area", "aspect_areas")]
    assert list(study.slices[0].to_dict()) == [place, *areas]
    assert {place, *areas} <= set(study.columns())
    assert study.slices[1 % len(study.slices)].usable.any()
