"""``symkin study``."""

import json
from pathlib import Path

import pytest

from symkin.cli import main
from symkin.study import builtin_text


def test_the_command_writes_table_results_and_report(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = "--robots", "10", "--mechanism", "5bar", "--format", "parquet"
    assert main(["study", str(small), "--out", str(tmp_path), *options]) == 0
    printed = capsys.readouterr().out
    assert "5bar/legs/noise_aware/O1/18/inverse/all" in printed
    assert printed.rstrip().endswith("report.html")
    assert {path.name for path in tmp_path.iterdir()} == {
        "parts", "table.parquet", "results.json", "report.html",
    }  # fmt: skip
    assert main(["study", str(small), "--out", str(tmp_path), *options, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document == json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert document["robots"] == 10


def test_an_accuracy_that_is_wanted_is_answered(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["study", str(small), "--robots", "5", "--out", str(tmp_path)]
    assert main([*command, "--accuracy", "0.1mm", "--accuracy", "0.2mrad"]) == 0
    printed = capsys.readouterr().out
    assert "poses that 0.1 mm and 0.01146° need, the cheapest protocol first" in printed
    assert "symkin plan 3RRR --design legs" in printed


def test_a_built_in_study_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "--show", "protocols"]) == 0
    assert capsys.readouterr().out == builtin_text("protocols")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--show", "cots"], 'did you mean "cost"'),
        ([], "a study is missing"),
        (["protocols"], "expected a folder"),
        (["protocols", "--show", "cost"], "no other study"),
        (["cost", "--out", "x", "--accuracy", "1mm"], "one of cost"),
        (["protocols", "--out", "x", "--accuracy", "1"], "with a unit"),
    ],
)
def test_a_wrong_command_line_is_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    arguments = [str(tmp_path / "x") if each == "x" else each for each in arguments]
    assert main(["study", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
