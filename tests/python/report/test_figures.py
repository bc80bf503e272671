# SPDX-License-Identifier: MIT
"""Figures: drawn without pyplot, not blank, one panel for everything that they should show."""

import inspect
import io
import os
import subprocess
import sys
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure

import symkin
from symkin import plot
from symkin.analysis.evaluation import Evaluation
from symkin.model.settings import JointLimits
from symkin.show.skeleton import rails_of
from symkin.show.theme import point_names

# One of each: joints at the base, on the platform, sliding, telescopic, a point platform, space.
DRAWN = ["3RRR", "3PRR", "3PRP", "3RRP", "3RPR", "3RPR_end_joint", "5bar", "hexapod_jugglebot"]


def assert_not_blank(figure):
    assert isinstance(figure, Figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=50)
    buffer.seek(0)
    pixels = matplotlib.image.imread(buffer)[..., :3]
    ink = (pixels < 0.95).any(axis=2)
    assert ink.mean() > 0.01
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    assert np.ptp(rows) > 0.7 * pixels.shape[0]
    assert np.ptp(columns) > 0.7 * pixels.shape[1]


@pytest.mark.parametrize("name", DRAWN)
def test_every_leg_of_a_mechanism_is_drawn_and_numbered(name):
    mechanism = symkin.load_mechanism(name)
    figure = plot.mechanism(mechanism).figure
    assert_not_blank(figure)
    flat = figure.axes[-1]
    numbers = {text.get_text() for text in flat.texts}
    assert numbers == {str(leg + 1) for leg in range(len(mechanism.legs))}


def test_the_drawing_puts_the_joints_where_the_mechanism_has_them(paper):
    figure = plot.mechanism(paper, paper.home).figure
    links = [line.get_xydata() for line in figure.axes[0].lines if len(line.get_xdata()) == 3]
    readings = paper.inverse_kinematics(paper.home)[0]
    for leg, link in enumerate(links):
        centres = paper.core.joint_centres(leg, paper.home, readings[leg])
        np.testing.assert_allclose(link, 1e3 * centres)
    assert len(links) == 3


def test_a_crank_is_drawn_with_the_arc_between_its_limits(paper):
    limited = paper.replace(joint_limits=JointLimits(0.0, 1.0))
    arcs = [line for line in plot.mechanism(limited).lines if len(line.get_xdata()) == 37]
    assert len(arcs) == 3
    for leg, arc in enumerate(arcs):
        joint, elbow, _ = 1e3 * paper.core.joint_centres(leg, paper.home, 1.0)
        np.testing.assert_allclose(arc.get_xydata()[-1], joint + 0.4 * (elbow - joint))
    assert not [line for line in plot.mechanism(paper).lines if len(line.get_xdata()) == 37]


def test_poses_of_every_leg_lie_on_the_cloud(planar_result):
    plan, cloud = planar_result.plan, planar_result.candidates.poses
    sets = [plan.poses[plan.rows_of(leg)] for leg in range(3)]
    figure = plot.poses(cloud, sets)
    assert_not_blank(figure)
    candidates, *legs = figure.axes[0].collections
    assert len(candidates.get_offsets()) == len(cloud)
    for poses, drawn in zip(sets, legs, strict=True):
        np.testing.assert_array_equal(drawn.get_offsets(), 1e3 * poses[:, :2])


def test_a_large_cloud_is_thinned(planar_result):
    cloud = np.tile(planar_result.candidates.poses, (50, 1))
    figure = plot.poses(cloud)
    assert len(figure.axes[0].collections[0].get_offsets()) < len(cloud) / 2


def test_spatial_poses_are_drawn_in_three_projections(spatial_result):
    figure = plot.poses(spatial_result.candidates)
    assert_not_blank(figure)
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes[:3]]
    assert labels == [("x, mm", "y, mm"), ("x, mm", "z, mm"), ("y, mm", "z, mm")]


@pytest.mark.parametrize("unknown", [{}, {"shared": ["sensor_gain"]}], ids=["legs", "joint"])
def test_positions_in_space_are_not_drawn_as_poses_in_the_plane(unknown):
    delta = symkin.load_mechanism("linear_delta")
    plan = symkin.make_plan(delta, delta.sample_workspace(300, 1), 20)
    found = symkin.identify(delta, symkin.simulate(delta, plan).measurements, **unknown)
    parts = [part for section in found.page().sections for part in section.parts]
    (poses,) = [part for part in parts if getattr(part, "name", "") in ("poses", "latent_poses")]
    assert [axes.get_ylabel() for axes in poses.draw().axes] == ["y, mm", "z, mm", "z, mm"]


def test_observability_has_a_bar_for_every_leg_and_parameter():
    diagonals = np.array([[1.0, 20.0, 0.3], [1.0, 20.0, 0.3]])
    figure = plot.observability(("base_radius", "base_angle", "gain"), diagonals).figure
    assert_not_blank(figure)
    heights = [patch.get_height() for patch in figure.axes[0].patches]
    assert heights == [1.0, 20.0, 0.3] * 2
    assert figure.axes[0].get_yscale() == "log"


def test_histograms_are_logarithmic_and_mark_the_root_mean_squares(planar_result):
    before, after = planar_result.before, planar_result.after
    figure = plot.error_histogram(before, after)
    assert_not_blank(figure)
    position = figure.axes[0]
    assert position.get_xscale() == "log"
    marks = [line.get_xdata()[0] for line in position.lines]
    np.testing.assert_allclose(marks, [1e3 * before.position_rms, 1e3 * after.position_rms])


def test_maps_have_one_scale_a_state(planar_result):
    figure = plot.error_map(planar_result.candidates, planar_result.before, planar_result.after)
    assert_not_blank(figure)
    panels = [axes for axes in figure.axes if axes.get_title()]
    scales = [axes.collections[0].get_clim() for axes in panels]
    assert len(set(scales[:3])) == len(set(scales[3:])) == 1
    assert scales[0][1] > 5 * scales[3][1]


def test_a_map_leaves_out_poses_that_failed(planar_result):
    poses, before = planar_result.candidates.poses, planar_result.before
    differences = before.differences.copy()
    differences[::2] = np.nan
    failed = Evaluation.of(differences, poses, planar_result.nominal)
    figure = plot.error_map(poses, failed, planar_result.after)
    assert_not_blank(figure)
    panels = [axes for axes in figure.axes if axes.get_title()]
    assert sum(len(axes.collections[0].get_offsets()) for axes in panels[:3]) == 200


def test_errors_beyond_the_interval_stand_out(planar_result):
    found = planar_result.identification
    deviations = found.mechanism.deviations.copy()
    deviations[1, 1] = 0
    wrong = np.zeros_like(deviations)
    wrong[0, :2] = 0.5, -1.0
    wrong[1, 0] = 2.5
    actual = found.mechanism.with_parameters(found.mechanism.parameters - wrong * deviations)
    uncertain = found.mechanism.with_parameters(found.mechanism.parameters, deviations)
    figure = plot.parameter_errors(replace(found, mechanism=uncertain), actual)
    assert_not_blank(figure)
    inside, outside = (line.get_xdata() for line in figure.axes[1].lines[-2:])
    np.testing.assert_allclose(outside, [2.5])
    assert np.isnan(inside[0])
    assert len(inside) == deviations.shape[1] - 1


def test_the_interval_of_a_robust_fit_is_drawn_as_wide_as_the_page_says(planar_result):
    taken = planar_result.simulation.measurements
    found = symkin.identify(planar_result.nominal, taken, loss="robust")
    interval = found.legs[0].interval
    assert interval > 1.97  # Student's
    wrong = np.zeros_like(found.deviations)
    wrong[0, :2] = 0.99 * interval, 1.01 * interval
    actual = found.mechanism.with_parameters(
        found.mechanism.parameters - wrong * found.deviations, symmetry=None
    )
    figure = plot.parameter_errors(found, actual)
    (outside,) = (line.get_xdata() for line in figure.axes[0].lines[-1:])
    np.testing.assert_allclose(outside, [1.01 * plot.INTERVAL])


def test_residuals_are_drawn_against_what_they_depend_on_most(planar_result):
    identification = planar_result.identification
    measurements = planar_result.simulation.measurements
    bent = [
        replace(fit, residuals=1e-3 * measurements.readings[fit.rows, leg] ** 2)
        for leg, fit in enumerate(identification.legs)
    ]
    found = replace(identification, legs=tuple(bent))
    figure = plot.dependence(found)
    assert len(figure.axes) == 3
    for axes, fit in zip(figure.axes, found.legs, strict=True):
        assert "reading explains 100%" in axes.get_title()
        np.testing.assert_allclose(axes.lines[1].get_ydata(), 1e3 * fit.residuals)


def test_points_of_every_leg_say_their_closure_in_its_own_unit(planar_result):
    found = planar_result.identification
    for figure in (plot.residuals(found), plot.dependence(found)):
        names = [name for of_leg in point_names(figure).values() for name in of_leg]
        assert len(names) == sum(len(leg.residuals) for leg in found.legs)
        assert {name.rpartition(" ")[2] for name in names} == {"mm"}


def test_residuals_show_every_pose_of_every_leg(planar_result):
    identification = planar_result.identification
    figure = plot.residuals(identification)
    assert_not_blank(figure)
    for axes, fit in zip(figure.axes, identification.legs, strict=True):
        np.testing.assert_allclose(axes.lines[1].get_ydata(), 1e3 * fit.residuals)


def test_of_many_rows_bins_and_the_worst_are_drawn(paper):
    poses = np.tile(symkin.sample_workspace(paper, 400, seed=1).poses, (10, 1))
    random = np.random.default_rng(1)
    readings = paper.inverse_kinematics(poses)
    noisy = poses + 1e-4 * random.standard_normal(poses.shape)
    noisy[1234, 0] += 0.01
    found = symkin.identify(paper, symkin.Measurements.of(noisy, readings))
    for figure in (plot.residuals(found), plot.dependence(found), plot.t_values(found).figure):
        assert_not_blank(figure)
        names = point_names(figure)
        assert {len(of_leg) for of_leg in names.values()} == {100}
        assert any("row 1235," in name for name in names["points0"])
        assert any(axes.collections for axes in figure.axes)  # what holds most of them


def limit_of(axes):
    below, above = (line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--")
    assert below == -above
    return above


@pytest.mark.parametrize("off", [5e-5, 1e-4, 1.5e-4, 5e-4])
def test_what_is_named_as_a_blunder_lies_beyond_the_limit_in_its_figure(off):
    delta = symkin.load_mechanism("linear_delta").with_device("bed probe")
    taken = delta.simulate(delta.plan(13, candidates=300, spares=0), seed=3).measurements
    heights = np.array(taken.heights)
    heights[5] += off
    found = symkin.identify(delta, replace(taken, heights=heights))
    limit, t = limit_of(plot.t_values(found)), np.abs(np.nan_to_num(found.rows.t))
    for named in found.outliers:
        assert t[found.rows.pose == named.row].max() > limit
    if not found.outliers:
        assert t.max() < limit


def test_the_limit_of_a_figure_is_by_the_size_of_what_is_not_named(paper):
    plan = paper.plan(40, seed=1)
    taken = paper.simulate(plan, seed=2).measurements.for_all_legs()
    limits = []
    for off in (0.0, 1e-3, 5e-3):
        poses = np.array(taken.poses)
        poses[5, 1] += off
        found = symkin.identify(paper, replace(taken, poses=poses), "joint", prior="tolerances")
        limits.append(limit_of(plot.t_values(found)))
        t = np.abs(np.nan_to_num(found.rows.t))
        assert {each.row for each in found.outliers} == ({5} if off else set())
        assert t[found.rows.pose != 5].max() < limits[-1]
    assert max(limits) < 1.1 * min(limits)


def test_figures_are_drawn_where_they_are_told(planar_result, paper):
    whole = Figure(figsize=(8, 8))
    upper, lower = whole.subfigures(2, 1)
    found = planar_result.identification
    assert plot.residuals(found, figure=upper) is upper
    (axes,) = [lower.subplots()]
    assert plot.mechanism(paper, ax=axes) is axes
    assert len(upper.axes) == 3
    assert {text.get_text() for text in axes.texts} == {"1", "2", "3"}
    assert_not_blank(whole)


@pytest.mark.parametrize(
    "name", sorted({name for name in plot.__all__ if name.islower()} - {"explore"})
)
def test_every_figure_takes_axes_or_a_figure_and_returns_it(name):
    signature = inspect.signature(getattr(plot, name))
    (given,) = {"ax", "figure"} & set(signature.parameters)
    assert signature.parameters[given].kind is inspect.Parameter.KEYWORD_ONLY
    assert signature.return_annotation == {"ax": "Axes", "figure": "FigureBase"}[given]


def test_figures_need_neither_pyplot_nor_a_display():
    code = "import sys, symkin.plot; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("module", ["symkin", "symkin.show.rendering"])
def test_matplotlib_is_imported_for_figures_only(module):
    code = f"import sys, {module}; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_backend_that_matplotlib_does_not_have_does_not_matter():
    code = "from symkin import load_mechanism, plot; plot.mechanism(load_mechanism('5bar'))"
    environment = os.environ | {"MPLBACKEND": "no such backend"}
    assert (
        subprocess.run([sys.executable, "-c", code], env=environment, check=False).returncode == 0
    )


def test_a_notebook_shows_what_a_figures_function_returns_but_not_axes_of_others(planar_result):
    for shown in (
        plot.mechanism(planar_result.nominal),
        plot.poses(planar_result.candidates),
        plot.observability(["a", "b"], [[1, 2], [2, 1]]),
    ):
        assert shown._repr_svg_().rstrip().endswith("</svg>")
    mine = plot.observability(["a"], [[1]], ax=Figure().subplots())
    assert not hasattr(mine, "_repr_svg_")


def test_a_carriage_is_drawn_on_a_rail_that_ends_at_its_limits():
    slides = symkin.load_mechanism("linear_delta")
    limited = slides.replace(joint_limits=JointLimits(lower=0.2, upper=0.45))
    home = limited.inverse_kinematics(limited.home)
    for rail in rails_of(limited, limited.home, home[0]):
        np.testing.assert_allclose(rail[:, 2], [0.2, 0.45])
    for rail in rails_of(slides, slides.home, home[0]):
        assert rail[0, 2] < home[0, 0] < rail[1, 2]
    turning = symkin.load_mechanism("3RRR")
    assert rails_of(turning, turning.home, turning.inverse_kinematics(turning.home)[0]) == (
        None,
        None,
        None,
    )
