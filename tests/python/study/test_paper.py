# SPDX-License-Identifier: MIT
"""The paper's figures done again, and the page that judges its claims."""

import dataclasses
import functools
import re

import numpy as np
import pytest

import symkin
from symkin import plot
from symkin.analysis.workspace.study import constant_orientations
from symkin.errors import SymkinError
from symkin.show.rendering import page_html
from symkin.show.study import study_page
from symkin.study import StudyResult, builtin_studies, builtin_text, load_study, run_study
from symkin_paper import STUDY, figures
from symkin_paper.findings import (
    EACH_LEG,
    EQUAL_EFFORT,
    PAPER,
    TRADITIONAL,
    local_errors,
    paper_calls,
    study_paper,
)
from symkin_paper.measured import ORIENTATIONS
from symkin_paper.page import HEADLINE_CELLS, paper_page


@pytest.fixture(scope="module")
def study() -> StudyResult:
    """The study of the paper with few robots and candidates."""
    small = load_study("paper").replace(candidates=300, robots=3, evaluation_poses=50)
    found = run_study(small)
    assert isinstance(found, StudyResult)
    return found


@pytest.fixture(scope="module")
def findings(study):
    return study_paper(study, poses=2000, mapped_robots=2)


def test_the_cells_are_the_paper_s_protocol_and_what_it_is_compared_with():
    definition = load_study("paper")
    cells = {cell.id: cell for cell in definition.cells}
    paper = cells[PAPER]
    assert (paper.rows, paper.criterion, paper.method) == ("paper", "O1", "sun_hollerbach")
    assert (paper.estimator, paper.use, paper.pose_count) == ("paper", "own", 24)
    assert paper.margin_sigmas == 0
    assert definition.candidates is None
    assert definition.loaded["3RRR"].protocol.candidates == 30_000
    alone = dataclasses.replace(paper, id=EACH_LEG, use_symmetry=False)
    assert cells[EACH_LEG] == alone
    traditional = dataclasses.replace(paper, id=TRADITIONAL, design="mechanism", use="all")
    assert cells[TRADITIONAL] == traditional
    assert cells[EQUAL_EFFORT] == dataclasses.replace(traditional, id=EQUAL_EFFORT, pose_count=72)
    assert set(HEADLINE_CELLS.values()) <= set(cells)


def test_the_claims_that_no_robot_decides_are_judged_as_the_theory_says(findings):
    verdicts = {claim.name: claim.verdict for claim in findings.claims}
    assert verdicts["Symmetry of the workspace"] == "holds partly"
    assert verdicts["Conjecture of the active joints"] == "holds"
    assert verdicts["Symmetrical observability"] == "holds partly"
    assert verdicts["Mapped poses"] == "holds partly"
    assert verdicts["Group of the structure"] == "holds"
    assert verdicts["Conditions of sections 4 and 5"] == "holds"
    assert verdicts["Sensor offsets"] == "holds"
    assert verdicts["A symmetrical workspace is not sufficient"] == "holds"
    assert verdicts["Defects of revolute joints"] == "holds"
    assert verdicts["Observability of a parameter"] == "does not hold"
    assert verdicts["Iteration of the estimate"] == "holds partly"


def test_the_slices_are_at_exactly_the_paper_s_orientations(study, findings):
    assert tuple(each.orientation for each in findings.local) == ORIENTATIONS
    assert tuple(each.orientation for each in findings.workspace.slices) == ORIENTATIONS
    mechanism = symkin.load_mechanism("3RRR")
    slices = constant_orientations(mechanism, ORIENTATIONS, 21)
    for found, errors in zip(slices, local_errors(study, slices), strict=True):
        assert errors.ratio.low < errors.ratio.value < errors.ratio.high
        np.testing.assert_array_equal(np.isfinite(errors.divided), found.usable)
        assert np.nanmax(errors.divided) < 1e-3


def test_local_errors_are_those_of_the_study_s_robots(study):
    mechanism = symkin.load_mechanism("3RRR")
    (found,) = constant_orientations(mechanism, [0.4], 11)
    (errors,) = local_errors(study, [found], 1)
    plan, seed = study.plan(PAPER), int(study.rows(PAPER)["seed"][0])
    simulation = symkin.simulate(mechanism, plan, seed)
    fit = symkin.identify(mechanism, simulation.measurements, "paper", poses="own")
    row, column = np.argwhere(found.usable)[0]
    pose = [[found.x[column], found.y[row], 0.4]]
    alone = symkin.evaluate(fit.mechanism, actual=simulation.actual, poses=pose)
    assert errors.divided[row, column] == pytest.approx(alone.position_rms, rel=1e-12)


def test_workers_find_of_the_paper_what_one_process_finds(study, findings, cluster, monkeypatch):
    few = functools.partial(paper_calls, poses=2000, mapped_robots=2)
    small = "paper", dataclasses.replace(STUDY, calls=few)
    monkeypatch.setattr("symkin.study.running.extension_of", lambda _definition: small)
    found = run_study(study.definition, scheduler=cluster.scheduler_address)
    assert isinstance(found, StudyResult)
    assert found == study
    assert found.extension_parts is not None
    assert found.findings is not None
    ratios = "selection", "plan", "step", "replacement", "exchange"
    timed = dict.fromkeys([f"{each}_saving" for each in ratios], 0.0)
    assert dataclasses.replace(found.findings.evidence, **timed) == dataclasses.replace(
        findings.evidence, **timed
    )
    assert found.findings.local == findings.local
    assert found.findings.workspace == findings.workspace


def test_only_the_paper_s_study_makes_its_calls(study):
    assert paper_calls(study.definition, study.job)
    assert not paper_calls(study.definition.replace(seed=2, cell=()), study.job)
    without = dict.fromkeys(study.job.plans, "no plan: said so")
    assert not paper_calls(study.definition, dataclasses.replace(study.job, plans=without))


def test_the_page_has_every_figure_beside_the_paper_s_words(study, findings):
    html = re.sub(r"<sub>(\w+)</sub>", r"_\1", page_html(paper_page(study, findings)))
    assert html.count('<svg role="img"') == 6
    for number in (6, 7, 8, 9, 10):
        assert re.search(rf"<figcaption>\s*After Figs?. {number}", html)
    for claim in findings.claims:
        row = re.search(rf"{re.escape(claim.quotation[-20:])}.*?</tr>", html, re.DOTALL)
        assert row, claim.quotation
        assert claim.verdict in row[0]


def test_results_and_page_of_the_study_have_the_claims(study, findings, monkeypatch):
    monkeypatch.setitem(study.__dict__, "findings", findings)
    claims = study.to_dict()["paper"]["claims"]
    assert [each["verdict"] for each in claims] == [each.verdict for each in findings.claims]
    assert study_page(study).title == paper_page(study, findings).title


@pytest.mark.parametrize(
    "cells",
    [
        [{"id": PAPER, "mechanisms": "5bar", "pose_counts": 12}],
        [{"id": name, "pose_counts": 12} for name in (PAPER, EACH_LEG, TRADITIONAL, EQUAL_EFFORT)],
    ],
    ids=["another mechanism", "another protocol of the same name"],
)
def test_other_cells_do_not_judge_the_paper(cells):
    whole = load_study("paper")
    given = {each["id"]: dict(each) for each in whole.cell}
    own = tuple({**given[each["id"]], **each} for each in cells)
    found = run_study(whole.replace(cell=own, candidates=300, robots=1, evaluation_poses=20))
    assert isinstance(found, StudyResult)
    assert found.findings is None
    with pytest.raises(SymkinError, match='the study "paper"'):
        study_paper(found)


def test_all_maps_of_local_errors_have_one_scale(findings):
    figure = figures.local_errors(findings.local)
    scales = {axes.images[0].get_clim() for axes in figure.axes if axes.images}
    assert len(scales) == 1
    (scale,) = scales
    every = [1e3 * getattr(e, w) for e in findings.local for w in ("divided", "traditional")]
    assert scale == (
        min(np.nanmin(values) for values in every),
        max(np.nanmax(values) for values in every),
    )


def test_chosen_poses_stand_where_their_readings_are(findings):
    figure = plot.chosen_readings(findings.plan, findings.workspace.sample)
    flat = figure.axes[1]
    drawn = np.asarray(flat.collections[1].get_offsets())
    readings = findings.plan.readings[findings.plan.rows_of_set(0)]
    assert len(drawn) == 24
    across = (readings[:, 1] - readings[:, 0]) / np.sqrt(2)
    np.testing.assert_allclose(drawn[:, 0], np.degrees(across))


def test_protocols_are_drawn_side_by_side_with_and_without_the_state_before(study):
    cells = {name: study.cells[cell] for name, cell in HEADLINE_CELLS.items()}
    for before in (True, False):
        position, orientation = plot.protocol_errors(cells, before=before).axes
        names = [label.get_text() for label in position.get_yticklabels()]
        assert names == (["before"] if before else []) + list(cells)
        assert "mm" in position.get_xlabel()
        assert "\N{DEGREE SIGN}" in orientation.get_xlabel()


def test_without_its_package_the_study_says_what_to_install(monkeypatch):
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_group: ())
    with pytest.raises(SymkinError, match=r"not installed.*symkin-paper"):
        load_study("paper")
    with pytest.raises(SymkinError, match=r"not installed.*symkin-paper"):
        builtin_text("paper")
    assert "paper" not in builtin_studies()


def test_without_its_package_the_cells_are_a_study_as_any_other(study, monkeypatch):
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_group: ())
    alone = dataclasses.replace(study)
    assert alone.findings is None
    assert "paper" not in alone.to_dict()
    assert study_page(alone).title == study.definition.title
