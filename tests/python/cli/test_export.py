# SPDX-License-Identifier: MIT
"""Exporting and importing on the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import symkin as library

PRINTER = """[printer]
kinematics: delta
delta_radius: 105.6
[stepper_a]
rotation_distance: 40
microsteps: 16
position_endstop: 212.7
arm_length: 215
[stepper_b]
rotation_distance: 40
microsteps: 16
[stepper_c]
rotation_distance: 40
microsteps: 16
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# [delta_calibrate]
#*# height0 = 0.3
#*# height0_pos = 17020.000,16980.000,17035.500
"""


def test_a_model_is_printed_or_written(symkin: Callable, protocol: Path, tmp_path: Path) -> None:
    shown = symkin("export", protocol / "calibrated.toml", "--to", "mjcf")
    assert (shown.code, shown.err) == (0, "")
    calibrated = library.load_mechanism(protocol / "calibrated.toml")
    assert shown.out == library.export(calibrated, "mjcf").text
    path = tmp_path / "robot.xml"
    written = symkin("export", protocol / "calibrated.toml", "--to", "mjcf", "--out", path)
    assert (written.code, written.out) == (0, f"{path}\n")
    assert path.read_text() == shown.out


def test_what_is_lost_is_said_beside_the_text(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    shown = symkin("export", "linear_delta", "--to", "klipper", "--endstops", "40 cm")
    assert shown.code == 0
    assert "[stepper_c]" in shown.out
    assert shown.err.splitlines()[-1].startswith(
        "End-effector errors with this file: less than 0.0001 mm, the largest of 20"
    )
    path = tmp_path / "table.csv"
    table = ("--to", "table", "--nominal", "3RRR", "--grid", 7, "--out", path)
    lines = symkin("export", protocol / "calibrated.toml", *table).out.splitlines()
    assert lines[0].startswith("Without the table the errors are ")
    assert lines[-2].startswith("End-effector errors with this file: ")
    assert lines[-1] == str(path)


def test_an_export_is_one_json_document(symkin: Callable, tmp_path: Path) -> None:
    document = symkin(
        "export", "linear_delta", "--to", "marlin", "--endstops", "0.4", "--json"
    ).json
    assert document["text"].startswith("M665 L215.000000 ")
    assert document["loss"]["position_max_m"] < 1e-8
    path = tmp_path / "robot.urdf"
    document = symkin("export", "5bar", "--to", "urdf", "--out", path, "--json").json
    assert (document["format"], document["loss"]) == ("urdf", None)
    assert "text" not in document


def test_what_cannot_be_exported_is_refused(refused: Callable, tmp_path: Path) -> None:
    refused("export", "3RRR", "--to", "klipper", words="linear deltas, 3 legs [P]US")
    refused("export", "3RRP", "--to", "sdf", words='not written for chain "[R]RP"')
    refused("export", "5bar", "--to", "table", words="(--nominal)")
    delta = ("export", "linear_delta", "--to", "klipper")
    refused(*delta, words="(--endstops, or [joint_limits] in the file)")
    refused(*delta, "--endstops", "3 deg", words="--endstops: ")
    refused(*delta, "--endstops", "1,2", words="2 endstops; expected one for all legs, or 3")
    path = tmp_path / "robot.xml"
    path.write_text("mine")
    refused("export", "5bar", "--to", "mjcf", "--out", path, words="exists; choose another place")
    assert path.read_text() == "mine"


def test_a_printer_is_imported_with_what_it_probed(
    symkin: Callable, refused: Callable, tmp_path: Path
) -> None:
    config, folder = tmp_path / "printer.cfg", tmp_path / "printer"
    config.write_text(PRINTER)
    done = symkin("import", config, "--out", folder)
    assert (done.code, done.err) == (0, "")
    files = [str(folder / name) for name in ("mechanism.toml", "probed.csv")]
    assert done.out.splitlines()[-2:] == files
    mechanism = library.load_mechanism(files[0])
    assert mechanism.pose_space == "translating"
    measured = library.read_measurements(files[1], mechanism)
    assert measured.heights.tolist() == [0.0003]
    assert measured.readings[0].tolist() == pytest.approx([-0.21275, -0.21225, -0.21294375])
    refused("import", config, "--out", folder, words="exists; choose another place")
    config.write_text(PRINTER.replace("delta\n", "polar\n"))
    refused("import", config, "--out", tmp_path / "other", words='is "polar"; symkin reads "delta"')
    assert not (tmp_path / "other").exists()


def test_a_model_is_imported(symkin: Callable, tmp_path: Path) -> None:
    assert symkin("export", "3RRR", "--to", "urdf", "--out", tmp_path / "3RRR.urdf").code == 0
    done = symkin("import", tmp_path / "3RRR.urdf", "--out", tmp_path)
    assert done.out.splitlines()[-1] == str(tmp_path / "mechanism.toml")
    assert not (tmp_path / "probed.csv").exists()
    assert symkin("check", tmp_path / "mechanism.toml").code == 0
