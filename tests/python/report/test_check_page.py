# SPDX-License-Identifier: MIT
"""The page about a mechanism before anything is measured."""

import pytest

import symkin
from symkin.analysis.checks import check_mechanism
from symkin.model.mechanism import Leg
from symkin.model.settings import JointLimits
from symkin.planning.simulation import disturb

CONDITIONS = "The paper's conditions"


@pytest.fixture(scope="module")
def page(paper, page_of, tmp_path_factory):
    return page_of(
        check_mechanism(paper).report(tmp_path_factory.mktemp("check") / "new" / "check.html")
    )


def test_the_page_is_self_contained(page):
    page.assert_self_contained()
    assert {path.name for path in page.folder.iterdir()} == {"check.html"}
    assert page.figures == {"mechanism", "observability"}


def test_the_groups_are_there_in_both_notations(page):
    paper_name, usual, size, elements = page.row("Groups", "GM, structure")
    assert (paper_name, usual, size) == ("D6", "D3", "6")
    assert "s2: reflection about the axis at 150°" in elements
    assert page.row("Groups", "GW, with the working modes")[:3] == ["C3", "C3", "3"]


def test_every_condition_has_verdict_figure_and_tolerance(page):
    rows = [row for row in page.tables[CONDITIONS] if row[0].startswith("(")]
    assert len(rows) == 12
    assert all(row[1] == "holds" and row[2] and row[3] for row in rows)


def test_the_legs_are_equally_observable_at_their_images(page):
    table = "Observability of every leg at its own poses"
    *legs, deviation = page.row(table, "distal_length")
    assert len(set(legs)) == 1
    assert float(deviation.split()[0].replace("\N{MINUS SIGN}", "-")) < 10
    assert "observability is symmetrical" in page.source
    assert len(page.row("Singular values, columns scaled to length one", "s8")) == 3


def test_what_breaks_a_near_symmetry_is_listed_largest_first(paper, page_of, tmp_path):
    made = disturb(paper, seed=2).replace(symmetry=None)
    result = check_mechanism(made)
    page = page_of(result.report(tmp_path / "check.html"))
    rows = page.tables["Where the legs differ"][1:]
    first = result.comparison.deviations[0]
    assert rows[0][0] == f"leg {first.leg + 1}, {first.parameter}"
    assert len(rows) == len(result.comparison.deviations + result.comparison.sensor_deviations)
    assert 'class="verdict doubtful"' in page.source


def test_a_strut_that_reads_less_than_zero_at_home_warns():
    drawn = symkin.load_mechanism("3RPR").replace(joint_limits=JointLimits())
    legs = [
        Leg(leg.chain, {**leg.parameters, "sensor_offset": 2.0}, leg.working_mode)
        for leg in drawn.legs
    ]
    for mechanism, warned in ((drawn, False), (drawn.replace(legs=legs), True)):
        notes = check_mechanism(mechanism).page().notes
        assert any("read less than zero at home" in note for note in notes) == warned
