"""Files that earlier states of symkin wrote are read, or refused with what to do."""

from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.errors import MechanismFileError, ResultsError, StudyFileError
from symkin.study import load_study

# As they were written before options had one definition each.
PLAN = """\
leg,order,role,x_m,y_m,phi_rad,psi_1_rad,psi_2_rad,psi_3_rad
1,1,primary,0.05,0.02,0.1,{readings}
1,2,primary,-0.05,0.02,0.0,{readings}
2,1,spare,0.0,0.0,0.0,{readings}
"""
STUDY = """\
title = "mine"
mechanisms = "3RRR"
designs = ["legs", "orbits"]
use_symmetry = [true, false]
pose_counts = [12]
use = ["own", "all"]
robots = 3
"""
MECHANISM = """\
schema = 1
name = "old"
chain = "[R]RR"
platform = "rigid"
reading_unit = "rad"

[symmetry]
group = "C3"
legs = 3

[reference_leg]
working_mode = 1
proximal_length = "0.3 m"
distal_length = "0.3 m"
base_radius = "0.4 m"
base_angle = "-90 deg"
platform_radius = "0.1 m"
platform_angle = "-90 deg"
sensor_gain = 1.0
sensor_offset = 0.0

[workspace]
x = ["-0.1 m", "0.1 m"]
y = ["-0.1 m", "0.1 m"]
phi = ["-10 deg", "10 deg"]

[identification]
shared = ["*_length"]
frames = ["base"]
"""


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


def test_a_mechanism_file_of_the_version_before_is_read(tmp_path):
    robot = symkin.load(written(tmp_path, "old.toml", MECHANISM))
    assert robot.identification.shared == ("*_length",)
    robot.save(tmp_path / "new.toml")
    assert symkin.load(tmp_path / "new.toml") == robot


def test_a_plan_of_the_version_before_is_read(tmp_path, paper):
    readings = ",".join(map(repr, paper.inverse_kinematics([[0.0, 0.0, 0.0]])[0].tolist()))
    plan = symkin.read_plan(written(tmp_path, "plan.csv", PLAN.format(readings=readings)), paper)
    assert plan.spare.tolist() == [False, False, True]
    assert plan.leg_sets.tolist() == [0, 0, 1]
    np.testing.assert_array_equal(plan.poses[0], [0.05, 0.02, 0.1])


@pytest.mark.parametrize("head", ["", "schema = 1\n"])
def test_a_study_of_the_version_before_is_read(tmp_path, head):
    study = load_study(written(tmp_path, "mine.toml", head + STUDY))
    assert study.use == ("own", "all")
    assert study.use_symmetry == (True, False)


def test_results_of_this_schema_are_read(tmp_path):
    text = '{"schema": 2, "command": "identify", "settings": {"poses": "own", "noise": null}}'
    read = symkin.read_results(written(tmp_path, "results.json", text))
    assert read["settings"]["poses"] == "own"


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        (1, "of an older symkin; run the command again that wrote it"),
        (3, "of a newer symkin; update symkin to read it"),
        ('"2"', "its schema is '2'"),
        ("true", "its schema is True"),
    ],
)
def test_results_of_another_schema_are_refused_with_what_to_do(tmp_path, schema, words):
    path = written(tmp_path, "results.json", f'{{"schema": {schema}, "command": "identify"}}')
    with pytest.raises(ResultsError) as caught:
        symkin.read_results(path)
    assert str(caught.value).endswith(words)


def test_files_of_a_newer_schema_are_refused_with_what_to_do(tmp_path):
    mechanism = written(tmp_path, "new.toml", MECHANISM.replace("schema = 1", "schema = 2"))
    with pytest.raises(MechanismFileError, match=r"new\.toml:1: schema: is 2, of a newer symkin"):
        symkin.load(mechanism)
    with pytest.raises(StudyFileError, match=r"mine\.toml:1: schema: is 7, of a newer symkin"):
        load_study(written(tmp_path, "mine.toml", f"schema = 7\n{STUDY}"))
