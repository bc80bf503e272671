# SPDX-License-Identifier: MIT
"""The report says what the results are, and needs no other file to say it."""

import html
import re

import numpy as np
import pytest

import symkin
from symkin.analysis.observability import analyse_observability, expected_accuracy
from symkin.present import Group, Page, Section, Table
from symkin.show.rendering import page_text
from symkin.show.wording import fixed, milli, significant

FITS = "How the legs fit (chi-square per degree of freedom, 1 if the noise is as declared)"
RUN_FIGURES = {
    "mechanism",
    "workspace",
    "observability",
    "parameter_errors",
    "residuals",
    "dependence",
    "error_histogram",
    "error_map",
    "t_values",
}
MEASURED_FIGURES = (RUN_FIGURES | {"latent_poses"}) - {"workspace", "parameter_errors"}


@pytest.fixture(params=["planar", "spatial"])
def run(request):
    """A result of the protocol and its page."""
    name = request.param
    return request.getfixturevalue(f"{name}_result"), request.getfixturevalue(f"{name}_page")


def test_a_first_screen_needs_nothing_that_the_page_alone_tells(run, monkeypatch):
    def asked(*_):
        raise AssertionError

    found = run[0].identification
    whole = found.page()
    monkeypatch.setattr("symkin.show.estimate.robot_symmetry_section", asked)
    assert found.text() == page_text(whole)
    (worst,) = [line for line in found.text().splitlines() if line.startswith("Known worst")]
    assert found.directions[0].unknowns[0].partition(".")[2] in worst


def test_the_page_is_self_contained(run):
    run[1].assert_self_contained()


def test_the_page_of_measurements_is_self_contained(measured_page):
    measured_page.assert_self_contained()


def test_every_figure_is_on_the_page_with_its_letters(run):
    page = run[1]
    assert page.figures == RUN_FIGURES
    assert len(page.all("text")) > 100


def test_every_figure_of_measurements_is_on_the_page(measured_page):
    assert measured_page.figures == MEASURED_FIGURES


def test_the_page_of_a_good_result_leaves_out_figures_for_details_and_names_them(
    planar_result, page_of, tmp_path
):
    found = planar_result.identification
    page = page_of(found.report(tmp_path / "good.html"))
    assert page.figures == {"t_values", "error_histogram"}
    left_out = re.search(r"Figures left out: (.*)\.", page.source)[1].split(", ")
    assert left_out == [
        "residuals",
        "dependence",
        "error_map",
        "latent_poses",
        "observability",
        "mechanism",
    ]
    doubted = symkin.identify(planar_result.nominal, planar_result.simulation, max_iterations=1)
    page = page_of(doubted.report(tmp_path / "doubtful.html"))
    assert {"residuals", "dependence", "mechanism"} < page.figures
    assert "Figures left out" not in page.source


def test_figures_share_no_identifiers(run):
    """They would take each other's markers and clippings, being in one document."""
    identifiers = [attributes["id"] for _, attributes in run[1].tags if "id" in attributes]
    assert len(identifiers) == len(set(identifiers))
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', run[1].source))
    assert used <= set(identifiers)


def test_the_same_results_give_the_same_page(planar_result, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    pages = [planar_result.report(tmp_path / name) for name in ("one.html", "other.html")]
    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert "2023-11-14 (UTC)" in pages[0].read_text(encoding="utf-8")


def test_images_have_texts_and_tables_have_headings(run):
    page = run[1]
    drawings = page.all("svg")
    assert len(drawings) == len(RUN_FIGURES) + 1  # the mechanism that can be moved
    assert all(len(drawing["aria-label"]) > 20 for drawing in drawings)
    assert len(page.all("caption")) == len(page.all("table")) == len(page.tables)
    assert {heading["scope"] for heading in page.all("th")} == {"col", "row", "rowgroup"}


def test_errors_before_after_and_expected_are_the_results(run):
    result, page = run
    expected = expected_accuracy(
        result.identification.mechanism,
        result.candidates.poses,
        result.identification.covariance,
    )
    cells = page.row("End-effector error", "position, root mean square")
    before, after = result.before, result.after
    assert cells[:2] == [milli(before.position_rms, "m"), milli(after.position_rms, "m")]
    assert cells[3] == milli(expected.position, "m")
    cells = page.row("End-effector error", "orientation, maximum")
    assert cells[:2] == [milli(e.orientation_max, "rad") for e in (before, after)]
    cells = page.row("End-effector error", "aligned position, root mean square")
    assert cells[:2] == [milli(e.aligned.position_rms, "m") for e in (before, after)]
    cells = page.row("End-effector error", "mean y")
    assert cells[:2] == [milli(e.means[1], "m") for e in (before, after)]
    assert page.row("End-effector error", "evaluated")[:2] == ["400", "400"]
    assert page.row("End-effector error", "failed")[:2] == [str(before.failed), str(after.failed)]


def test_the_summary_says_the_answer_and_whether_to_trust_it(run):
    result, page = run
    top = page.source[: page.source.index("<main>")]
    assert milli(result.before.position_rms, "m") in top
    assert milli(result.after.position_rms, "m") in top
    assert result.identification.trustworthy
    assert "nothing speaks against the estimate" in top


def test_identified_and_true_parameters_are_the_results(run):
    result, page = run
    calibrated, actual = result.identification.mechanism, result.simulation.actual
    rows = [row for row in page.tables["Identified parameters"][1:] if len(row) > 1]
    assert len(rows) == calibrated.parameters.size
    names = result.nominal.parameter_names * len(result.nominal.legs)
    assert [row[0] for row in rows] == list(names)
    identified, deviations, true, errors = _numbers(rows)
    np.testing.assert_allclose(deviations, calibrated.deviations.ravel(), rtol=0.06)
    slack = calibrated.deviations.ravel() / 10
    assert (np.abs(identified - calibrated.parameters.ravel()) < slack).all()
    assert (np.abs(true - actual.parameters.ravel()) < slack).all()
    in_sigmas = (calibrated.parameters - actual.parameters) / calibrated.deviations
    np.testing.assert_allclose(errors, in_sigmas.ravel(), atol=0.006)


def _numbers(rows):
    """Columns identified, standard deviation, true and error of the parameters, in SI units."""
    superscripts = str.maketrans(
        "\u207b\u2070\xb9\xb2\xb3\u2074\u2075\u2076\u2077\u2078\u2079", "-0123456789"
    )

    def number(cell):
        mantissa, _, power = cell.replace("\N{MINUS SIGN}", "-").partition("\xa0\xd7\xa010")
        return float(mantissa) * 10.0 ** int(power.translate(superscripts) or 0)

    units = {"mm": 1e-3, "\N{DEGREE SIGN}": np.pi / 180}
    si = np.array([units.get(row[1], 1.0) for row in rows])
    columns = (np.array([number(row[column]) for row in rows]) for column in (3, 4, 8, 9))
    return (values * of for values, of in zip(columns, (si, si, si, 1.0), strict=True))


def test_observability_of_all_legs_is_the_results(run):
    result, page = run
    nominal, plan = result.nominal, result.plan
    legs = [
        analyse_observability(nominal, leg, plan.poses[plan.rows_of(leg)])
        for leg in range(len(nominal.legs))
    ]
    caption = "Observability of every leg at its own poses"
    for i, name in enumerate(nominal.parameter_names):
        shown = page.row(caption, name)
        assert shown[:-1] == [significant(leg.r_diagonal[i]) for leg in legs]
    assert page.row(caption, "O1, all parameters (D-optimality)")[:-1] == [
        significant(choice.selection.criterion_value)
        for choice in plan.basis.choices
        for _ in choice.legs
    ]
    assert "their observability is symmetrical" in page.source


def test_sampling_and_plan_are_counted(run):
    result, page = run
    sampling = page.tables["Sampling of the workspace"]
    counts = [int(row[1].replace("\xa0", "")) for row in sampling[1:]]
    assert counts[0] == result.candidates.drawn == sum(counts[1:])
    assert counts[-1] == 400
    for leg, replaced in enumerate(result.simulation.replaced):
        spares = len(result.plan.rows_of_set(leg, spare=True))
        shown = page.row("Planned poses", f"leg {leg + 1}")
        assert shown == ["16", str(spares), str(replaced)]
    (choice,) = result.plan.basis.choices
    shown = page.row("Selections and their certificates", _all_legs(result))
    assert shown[1] == f"{100 * choice.selection.certificate.efficiency:.2f}\xa0%"
    assert shown[-1] == "no"


def _all_legs(result):
    return "legs " + ", ".join(str(leg + 1) for leg in range(len(result.nominal.legs)))


def test_symmetry_names_the_element_of_every_leg(planar_page, spatial_page):
    caption = "Where the legs and their poses come from (Eqs. 7, 21)"
    assert planar_page.row(caption, "leg 3") == ["leg 1", "r2", "rotation by 240\N{DEGREE SIGN}"]
    assert spatial_page.row(caption, "leg 2") == [
        "leg 1",
        "s0",
        "reflection about the axis at 30\N{DEGREE SIGN}",
    ]


def test_the_estimators_are_compared(run):
    result, page = run
    rows = page.tables["Every estimator on the same measurements"][1:]
    assert [row[0] for row in rows] == ["paper", "implicit", "implicit", "joint"]
    for row, figures in zip(rows, result.comparison, strict=True):
        assert row[1:3] == [figures.poses, milli(figures.evaluation.position_rms, "m")]
    used = result.comparison[2]
    assert (used.evaluation, used.expected) == (result.after, result.expected)


def test_the_report_of_measurements_has_residuals_and_cross_validation(measured, measured_page):
    identification, validation = measured, measured.cross_validation
    caption = "Closure residual of all legs"
    assert measured_page.row(caption, "calibrated") == [
        milli(identification.residual_rms, "m"),
        milli(identification.residual_max, "m"),
    ]
    unseen = "5-fold cross-validation (poses that the fit did not see)"
    assert measured_page.row(caption, unseen)[0] == milli(validation.residual_rms, "m")
    cells = measured_page.row("End-effector error", "unseen position, root mean square")
    assert cells[1] == milli(validation.evaluation.position_rms, "m")
    fit = identification.legs[1]
    cells = measured_page.row(FITS, "leg 2")
    assert cells[3].startswith(f"{len(fit.rejected)} (rows ")
    assert cells[5] == significant(identification.goodness[1].chi_square_ratio)
    rows = measured_page.tables["Identified parameters"]
    assert rows[0][-2:] == ["Change", "Status"]
    assert rows[2][1:4:2] == ["mm", fixed(1e3 * identification.mechanism.parameters[0, 0], 2)]


def test_the_first_figure_of_measurements_is_the_error_as_evaluate_tells_it(
    measured, measured_page
):
    top = measured_page.source[: measured_page.source.index("<main>")]
    before, after = measured.before.position_rms, measured.after.position_rms
    assert f"{milli(before, 'm')} → {milli(after, 'm')}" in top
    places = [top.index(milli(each, "m")) for each in (before, after)]
    assert places == sorted(places)
    assert "as measured" in top[places[1] :]


@pytest.mark.parametrize("frames", [(), ("base", "target")])
def test_the_first_figure_is_what_no_frame_explains_where_frames_are_unknown(planar_result, frames):
    taken = planar_result.simulation.measurements
    found = symkin.identify(planar_result.identification.nominal, taken, frames=frames)
    errors = [(frames and each.aligned) or each for each in (found.before, found.after)]
    before, after = (milli(each.position_rms, "m").split()[0] for each in errors)
    assert f"{before} → {after}" in found.text()


def test_measurements_of_single_legs_are_reported_without_end_effector_errors(
    planar_result, tmp_path
):
    taken = planar_result.simulation.measurements
    own = taken.leg_sets[:, np.newaxis] == np.arange(3)
    partial = symkin.Measurements(
        taken.poses, np.where(own, taken.readings, np.nan), taken.leg_sets, taken.row_numbers
    )
    identification = symkin.identify(planar_result.nominal, partial)
    path = identification.report(tmp_path / "report.html")
    text = path.read_text(encoding="utf-8")
    assert "No end-effector error" in text
    assert 'id="figure-error_map"' not in text


@pytest.mark.usefixtures("unillustrated")
def test_doubts_and_failure_stand_on_top(planar_result, tmp_path):
    measurements = planar_result.simulation.measurements
    stopped = symkin.identify(planar_result.nominal, measurements, max_iterations=1)
    assert not stopped.converged
    path = stopped.report(tmp_path / "report.html")
    top = path.read_text(encoding="utf-8").split("<main>")[0]
    assert "Not converged: leg 1" in top
    assert all(html.escape(doubt.cause, quote=False) in top for doubt in stopped.doubts)


@pytest.mark.usefixtures("unillustrated")
def test_names_are_escaped(planar_result, tmp_path):
    nominal = planar_result.nominal.replace(name="<b>3RRR</b> & co")
    measurements = planar_result.simulation.measurements
    identification = symkin.identify(nominal, measurements)
    path = identification.report(tmp_path / "report.html")
    text = path.read_text(encoding="utf-8")
    assert "<b>" not in text
    assert "&lt;b&gt;3RRR&lt;/b&gt; &amp; co" in text


def test_a_table_that_is_cut_says_how_many_rows_more_it_has_whatever_they_are():
    rows = [(f"robot {number}", "failed", "too few poses") for number in range(25)]
    columns = ("Robot", "Verdict", "Why")
    table = Table("Robots to look at", columns, [Group(rows)], brief=True, brief_rows=10)
    text = page_text(Page("Fleet", sections=[Section("robots", "Robots", parts=[table])]))
    assert "robot 8" in text
    assert "robot 9" not in text
    assert text.endswith("and 16 more")
