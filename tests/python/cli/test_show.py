# SPDX-License-Identifier: MIT
"""What other commands have found is shown again."""

import shutil

import pytest


def test_what_a_command_found_is_told_again_in_other_units(symkin, protocol, tmp_path):
    shutil.copytree(protocol, tmp_path / "moved")
    told = symkin("show", tmp_path / "moved")
    assert "Converged" in told.out
    assert " mm" in told.out
    assert " in" in symkin("show", tmp_path / "moved", "--units", "inch").out
    assert len(symkin("show", tmp_path / "moved", "--verbose").out) > len(told.out)
    assert symkin("show", tmp_path / "moved", "--json").json["result"]["kind"] == "ProtocolResult"


@pytest.mark.usefixtures("unillustrated")
def test_a_page_is_drawn_again_of_a_result_that_was_printed_as_json(symkin, tmp_path):
    printed = symkin("check", "3RRR", "--json").out
    (tmp_path / "check.json").write_text(printed, encoding="utf-8")
    told = symkin("show", tmp_path / "check.json", "--out", tmp_path / "page")
    assert "3RRR" in told.out
    assert {each.name for each in (tmp_path / "page").iterdir()} == {"results.json", "report.html"}
    assert "3RRR" in (tmp_path / "page" / "report.html").read_text(encoding="utf-8")


def test_a_file_without_a_result_is_refused(refused, tmp_path):
    (tmp_path / "it.json").write_text('{"schema": 2, "command": "check"}')
    refused("show", tmp_path / "it.json", words="has no result that loads back")
    refused("show", tmp_path / "none.json", words="no such file")
