# SPDX-License-Identifier: MIT
"""Distances of which it is not known what is shown at zero."""

import numpy as np
import pytest

import symkin
from symkin.errors import MechanismFileError
from symkin.estimate.evidence.linear_rows import linear_rows
from symkin.model.settings import Frames

ANCHORS = ((2.0, 1.0), (-1.5, 0.5))
ZERO = 3e-3
UNKNOWN = {
    "free": ["leg?", "distance*.zero"],
    "shared": ["distance*.zero"],
    "prior": {"distance*.zero": "5 mm"},
}


@pytest.fixture(scope="module")
def drawn(paper):
    return paper.replace(frames=Frames(anchors=ANCHORS))


@pytest.fixture(scope="module")
def measured(drawn):
    made = drawn.replace(frames=Frames(anchors=ANCHORS, zeros=(ZERO, ZERO)))
    sample = symkin.sample_workspace(drawn, 300, seed=1)
    plan = symkin.make_plan(drawn, sample, 40, design="mechanism", spares=0)
    return symkin.simulate(made, plan, seed=2, observe=("pose", "distance")).measurements


@pytest.fixture(scope="module")
def found(drawn, measured):
    return symkin.identify(drawn, measured, **UNKNOWN)


def test_a_zero_is_found_and_the_estimate_is_trusted(found):
    zero = found.params["distance1.zero"]
    assert abs(zero.value - ZERO) < 4 * zero.deviation < ZERO / 2
    assert found.trustworthy, found.doubts


def test_evidence_looks_at_the_residuals_of_the_estimate(found):
    assert linear_rows(found, ()).square == pytest.approx(found.chi_square, rel=1e-6)


def test_the_calibrated_robot_keeps_its_zeros_in_its_file(found, tmp_path):
    calibrated = found.mechanism
    zero = found.params["distance1.zero"].value
    assert calibrated.frames.zeros == pytest.approx((zero, zero))
    symkin.save_mechanism(calibrated, tmp_path / "calibrated.toml")
    again = symkin.load_mechanism(tmp_path / "calibrated.toml")
    assert again.frames == calibrated.frames


def test_the_page_shows_the_zeros(found, tmp_path):
    found.write_report(tmp_path)
    assert "Distance 1" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert found.params["distance2.zero"].nominal == 0


def test_a_zero_that_the_file_declares_is_held_there(drawn, measured):
    told = drawn.replace(frames=Frames(anchors=ANCHORS, zeros=(ZERO, ZERO)))
    found = symkin.identify(told, measured, prior="tolerances")
    zero = found.params["distance2.zero"]
    assert (zero.nominal, zero.value) == (ZERO, ZERO)
    assert found.trustworthy, found.doubts


def test_what_is_shown_is_the_distance_less_its_zero(drawn):
    made = drawn.replace(frames=Frames(anchors=ANCHORS, zeros=(0.0, ZERO)))
    plan = symkin.make_plan(drawn, symkin.sample_workspace(drawn, 100, seed=1), 9)
    with_zeros, without = (
        symkin.simulate(each, plan, seed=2, observe="distance").measurements.distances
        for each in (made, drawn)
    )
    assert with_zeros - without == pytest.approx(
        np.tile([0.0, -ZERO], (len(without), 1)), abs=1e-12
    )


def test_zeros_of_some_anchors_alone_are_refused(drawn, tmp_path):
    with pytest.raises(symkin.SymkinError, match="1, of 2 anchors"):
        Frames(anchors=ANCHORS, zeros=(ZERO,))
    path = tmp_path / "robot.toml"
    symkin.save_mechanism(drawn, path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("\nanchors =", '\nzeros = ["3 mm"]\nanchors ='), encoding="utf-8")
    with pytest.raises(MechanismFileError, match=r"zeros.*1, of 2 anchors"):
        symkin.load_mechanism(path)


def test_points_beside_distances_are_said_to_be_seen_in_no_row(drawn, measured):
    pointed = drawn.replace(frames=Frames(anchors=ANCHORS, points=((0.1, 0.2),)))
    notes = {each.code: str(each) for each in symkin.identify(pointed, measured, **UNKNOWN).notes}
    assert "points-unseen" in notes
    assert "point1" not in notes["held-as-exact"]
