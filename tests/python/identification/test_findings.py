# SPDX-License-Identifier: MIT
"""Doubts and notes are values of a closed, documented list, told in the language of who asks."""

import copy
import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.estimate import Doubt, Note
from symkin.estimate.evidence.codes import DOUBTS, NOTES
from symkin.present import asked_by

PAGE = Path(__file__).parents[3] / "docs" / "user-guide" / "findings.md"


@pytest.fixture(scope="module")
def wrong():
    robot = symkin.load_mechanism("3RRR")
    taken = symkin.simulate(robot, robot.plan(24), seed=1).measurements.for_all_legs()
    return robot, symkin.Measurements.of(taken.poses, taken.readings * [1, -1, 1])


def test_the_list_of_codes_is_that_of_the_documentation():
    tables = PAGE.read_text(encoding="utf-8").split("## Mistakes")[1]
    cells = [line.split("|")[1] for line in tables.splitlines() if line.startswith("| `")]
    told = [code for cell in cells for code in re.findall(r"`([a-z-]+)`", cell)]
    assert sorted(told) == sorted({**DOUBTS, **NOTES})


@pytest.mark.parametrize("kind", [Doubt, Note])
def test_a_code_that_nobody_documented_is_refused(kind):
    with pytest.raises(KeyError, match="no-such-code"):
        kind("no-such-code")


def test_a_doubt_is_a_value_that_pickles_and_copies(wrong):
    (doubt,) = symkin.identify(*wrong).doubts
    assert (doubt.code, doubt.legs, doubt.is_cause) == ("opposite-sign", (1,), True)
    for again in (pickle.loads(pickle.dumps(doubt)), copy.deepcopy(doubt)):
        assert again == doubt
        assert str(again) == str(doubt)


def test_results_have_the_codes_and_count_legs_from_one(wrong, tmp_path):
    found = symkin.identify(*wrong)
    told = json.loads(found.save(tmp_path / "found.json").read_text())["identification"]
    (doubt,) = told["doubts"]
    assert (doubt["code"], doubt["legs"], doubt["rows"]) == ("opposite-sign", [2], [])
    assert doubt["cause"] == "the readings of leg 2 have the opposite sign"
    assert doubt["remedy"].startswith("negate the column")


def test_a_remedy_is_told_in_the_language_of_who_asks():
    options = {"frames": ("base", "target"), "sensor": "quadratic"}
    doubt = Doubt("frame-not-as-drawn", figures={"evidence": "", "moved": "", "angle": 3.0},
                  options=options)  # fmt: skip
    assert doubt.remedy == 'identify with frames=["base", "target"], sensor="quadratic"'
    with asked_by("command"):
        asked = "identify with --frames base --frames target --sensor quadratic"
        assert doubt.remedy == asked
    assert 'frames=["base", "target"]' in str(doubt)


def test_what_a_doubt_asks_for_settles_it():
    robot = symkin.load_mechanism("3RRR")
    plan = robot.plan(24)
    observe = Observed("pose", base=(0.3, -0.2, 0.5))
    taken = symkin.simulate(robot, plan, seed=2, observe=observe).measurements.for_all_legs()
    (doubt,) = symkin.identify(robot, taken).doubts
    assert np.isfinite(doubt.size)
    assert symkin.identify(robot, taken, **doubt.options).trustworthy
