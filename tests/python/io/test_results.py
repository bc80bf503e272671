# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from symkin.errors import ResultsError
from symkin.storage.results_file import read_results, results_text, write_results

Write = Callable[..., Path]


@dataclass(frozen=True)
class Part:
    values: np.ndarray
    converged: np.bool_


RESULTS = {
    "estimator": "implicit",
    "residual_rms_m": np.float64(1.25e-5),
    "parts": [Part(np.array([[1.0, np.nan], [np.inf, 0.1]]), np.bool_(True))],
    "indices": np.array([3, 1]),
    "file": Path("out") / "plan.csv",
    "nothing": None,
}


def test_results_read_back_as_plain_values(tmp_path: Path) -> None:
    write_results(RESULTS, tmp_path / "results.json")
    assert read_results(tmp_path / "results.json") == {
        "estimator": "implicit",
        "residual_rms_m": 1.25e-5,
        "parts": [{"values": [[1.0, None], [None, 0.1]], "converged": True}],
        "indices": [3, 1],
        "file": "out/plan.csv",
        "nothing": None,
    }


def test_the_same_results_give_the_same_text_with_the_version_first() -> None:
    text = results_text(RESULTS)
    assert text == results_text(dict(RESULTS))
    assert text.startswith('{\n  "schema": 2,\n  "estimator": "implicit",')
    assert text.endswith("}\n")


def test_floats_keep_every_digit(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=100) * 10.0 ** np.arange(-50, 50)
    write_results({"values": values}, tmp_path / "results.json")
    assert np.array_equal(read_results(tmp_path / "results.json")["values"], values)


def test_a_value_without_a_json_form_is_named() -> None:
    with pytest.raises(ResultsError, match=r"results.a.b\[1\] is a set"):
        results_text({"a": {"b": [1, {2}]}})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is not valid JSON"),
        ("", "the file is empty"),
        ('{"schema": true}', "its schema is True"),
        ('{"schema": 1.0}', "its schema is 1.0"),
        ('{"schema": "' + "x" * 9999 + '"}', "xxx\\.\\.\\.xxx"),
        ("[" * 99_999, "is not a results file"),
        ('{"schema": ' + "1" * 9999 + "}", "is not a results file"),
        ("[]", "not a results file of version 2"),
        ('{"a": 1}', "its schema is None"),
        ('{"schema": 1}', "its schema is 1"),
    ],
)
def test_a_file_that_holds_no_results_is_refused(write: Write, text: str, words: str) -> None:
    with pytest.raises(ResultsError, match=words):
        read_results(write(text, "results.json"))


def test_an_absent_results_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match="no such file"):
        read_results(tmp_path / "results.json")
    with pytest.raises(ResultsError, match="is a directory"):
        read_results(tmp_path)
