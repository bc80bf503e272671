# SPDX-License-Identifier: MIT
"""``symkin accept`` and ``compare``."""

import json

import pytest


@pytest.fixture(scope="module")
def later(symkin, protocol, tmp_path_factory):
    """Measurements of the same robot on another day."""
    folder = tmp_path_factory.mktemp("later")
    made = symkin(
        *("simulate", "3RRR", "--plan", protocol / "plan.csv", "--seed", 9, "--out", folder),
        *("--actual", protocol / "actual.toml", "--overwrite"),
    )
    assert made.code == 0, made.err
    return folder / "measurements.csv"


def test_accept_writes_a_certificate(symkin, protocol, later, tmp_path):
    given = ("accept", protocol, later, "--tolerance")
    done = symkin(*given, "0.3mm", "--about", "serial=A12", "--out", tmp_path / "c")
    assert done.code == 0, done.err
    assert "Pass: the position error (rms) is within 0.300 mm" in done.words
    document = json.loads((tmp_path / "c" / "acceptance.json").read_text())
    assert document["verdict"] == "pass"
    assert document["held_out"] is True
    assert document["about"] == {"serial": "A12"}
    page = (tmp_path / "c" / "certificate.html").read_text()
    for words in ("A12", "Signature", "SHA-256 of measurements.csv", "ISO 14253-1"):
        assert words in page


def test_accept_ends_with_one_unless_it_passes(symkin, protocol, later):
    for tolerance in ("0.01mm", "0.12mm"):
        done = symkin("accept", protocol, later, "--tolerance", tolerance, "--json")
        assert (done.code == 0) == (done.json["verdict"] == "pass")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "a tolerance is missing"),
        (("--tolerance", "0.2"), "no length or angle with a unit"),
        (("--tolerance", "1mm", "--about", "seral=2"), 'did you mean "serial"'),
        (("--tolerance", "1mm", "--about", "2"), 'has no "="'),
        (("--tolerance", "1mm", "--frames", "target"), "expected base"),
    ],
)
def test_accept_refuses_wrong_input_in_one_sentence(refused, protocol, later, options, words):
    refused("accept", protocol, later, *options, words=words)


def test_accept_refuses_the_rows_of_the_calibration(refused, protocol):
    table = protocol / "measurements.csv"
    refused("accept", protocol, table, "--tolerance", "1mm", words="of the calibration itself")


def test_compare_tells_whether_anything_moved(symkin, refused, protocol, later, tmp_path):
    made = symkin("identify", "3RRR", later, "--out", tmp_path / "friday", "--no-report")
    assert made.code == 0, made.err
    done = symkin("compare", protocol, tmp_path / "friday", "--out", tmp_path / "c")
    assert done.code == 0, done.err
    assert "The two calibrations agree" in done.words
    document = json.loads((tmp_path / "c" / "comparison.json").read_text())
    assert document["shape_moved"] is False
    assert len(document["parameters"]) == 24
    refused("compare", protocol, tmp_path / "sunday", words="no such file")
