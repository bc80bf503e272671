# SPDX-License-Identifier: MIT
"""Options with a few values: a wrong one is answered with those that there are."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

import symkin
from symkin.analysis.observability import mechanism_rows, observability_rows


@cache
def given() -> dict[str, Any]:
    mechanism = symkin.load_mechanism("3RRR")
    sample = symkin.sample_workspace(mechanism, 200)
    plan = symkin.make_plan(mechanism, sample, 10)
    return {
        "mechanism": mechanism,
        "poses": sample.poses,
        "plan": plan,
        "measured": symkin.simulate(mechanism, plan).measurements,
        "rows": observability_rows(mechanism, 0, sample.poses),
    }


CALLS: dict[str, tuple[Callable[..., Any], str]] = {
    "make_plan": (
        lambda of, **o: symkin.make_plan(of["mechanism"], of["poses"], 10, **o),
        "design rows criterion method visit",
    ),
    "identify": (
        lambda of, **o: symkin.identify(of["mechanism"], of["measured"], **o),
        "estimator poses loss",
    ),
    "cross_validate": (
        lambda of, **o: symkin.cross_validate(of["mechanism"], of["measured"], **o),
        "estimator poses loss",
    ),
    "predict_accuracy": (
        lambda of, **o: symkin.predict_accuracy(of["mechanism"], of["plan"], of["poses"], **o),
        "estimator poses",
    ),
    "pose_count_curve": (
        lambda of, **o: symkin.pose_count_curve(of["mechanism"], of["poses"], [8, 9], **o),
        "design rows criterion estimator poses",
    ),
    "run_protocol": (
        lambda of, **o: symkin.run_protocol(of["mechanism"], **o),
        "estimator poses design rows criterion method",
    ),
    "select_poses": (
        lambda of, **o: symkin.select_poses(of["rows"], 10, **o),
        "criterion method",
    ),
    "observability_rows": (
        lambda of, **o: observability_rows(of["mechanism"], 0, of["poses"], **o),
        "kind",
    ),
    "mechanism_rows": (
        lambda of, **o: mechanism_rows(of["mechanism"], of["poses"], **o),
        "kind",
    ),
    "Mechanism": (
        lambda of, **o: symkin.Mechanism("m", of["mechanism"].legs, **o),
        "platform reading_unit",
    ),
    "chain_info": (lambda _, **o: symkin.chain_info("[R]RR", **o), "platform"),
    "chains": (lambda _, **o: symkin.chains(**o), "platform"),
}


@pytest.mark.parametrize(
    ("name", "option"), [(name, each) for name, (_, o) in CALLS.items() for each in o.split()]
)
def test_a_wrong_option_is_answered_with_the_valid_ones(name: str, option: str) -> None:
    with pytest.raises(
        symkin.SymkinError, match=r"""is 'zzz'; expected "\w+"(, "\w+")* or "\w+"$"""
    ):
        CALLS[name][0](given(), **{option: "zzz"})


@pytest.mark.parametrize("wrong", [True, 3, ["implicit"]])
def test_an_option_that_is_no_text_is_refused_too(wrong: object) -> None:
    with pytest.raises(
        symkin.SymkinError,
        match=r'estimator is .*; expected "paper", "inverse", "implicit" or "joint"',
    ):
        CALLS["identify"][0](given(), estimator=wrong)
