# SPDX-License-Identifier: MIT
"""Every command from end to end, and its files from one to the next."""

from __future__ import annotations

import dataclasses
import filecmp
import math
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symkin as library
from symkin.estimate import Estimate
from symkin.estimate import fleet as fleet_module
from symkin.estimate.evidence.edits import in_modes
from symkin.pipeline import ProtocolResult
from symkin.present import asked_by
from symkin.show.wording import milli

COMMANDS = [
    "check",
    "pose-count",
    "plan",
    "simulate",
    "identify",
    "evaluate",
    "run",
    "kinematics",
]


def test_check_describes_a_mechanism(symkin: Callable) -> None:
    shown = symkin("check", "3RRR")
    assert shown.code == 0
    assert "3 legs [R]RR, planar" in shown.out
    assert "proximal_length, m" in shown.out
    document = symkin("check", "3RRR", "--json").json
    assert [leg["element"] for leg in document["legs"]] == ["r0", "r1", "r2"]
    assert [leg["rank"] for leg in document["identifiability"]] == [8, 8, 8]
    assert 0.1 < document["workspace"]["share"] < 0.5


def test_check_prints_the_groups_in_both_notations_and_every_condition(symkin: Callable) -> None:
    shown = symkin("check", "3RRR", "--verbose")
    lines = [line.split() for line in shown.out.splitlines()]
    assert ["G_M,", "structure", "D_6", "D_3", "6"] in [line[:5] for line in lines]
    assert "r0: the identity; r1: rotation by 120°; " in shown.out
    assert ["G_Q,", "active", "joints", "C_3", "C_3"] in [line[:5] for line in lines]
    numbers = [line[0] for line in lines if line[:1] > ["("] and "holds" in line]
    assert numbers == [*(f"({i})" for i in range(1, 6)), *(f"({i})" for i in range(1, 8))]
    assert "All legs are images of leg 1." in shown.out
    assert ["s_8", "0.00490", "0.00490", "0.00490"] in lines


def test_check_begins_with_a_verdict_and_ends_with_a_command_that_runs(
    symkin: Callable, tmp_path: Path
) -> None:
    shown = symkin("check", "3RRR").out
    title, subtitle, verdict, *_ = shown.splitlines()
    assert (title, subtitle) == ("3RRR: check", "3 legs [R]RR, planar")
    assert verdict == "All 3 legs are alike: poses chosen for one serve all."
    assert "at least 8" in shown
    assert not re.search(r"G_[MWQC]|D_6|Eq\.|R_ii|singular value", shown)
    program, *arguments, _ = shlex.split(shown.splitlines()[-1].removeprefix("Next: "))
    assert program == "symkin"
    assert symkin(*arguments, tmp_path / "planned", "--candidates", 300).code == 0


@pytest.mark.parametrize(
    ("name", "verdict", "design"),
    [
        ("5bar", "Both legs are alike: poses chosen for one serve both.", "orbits"),
        (
            "3RRR_asymmetric",
            "The legs are not alike: leg 2 differs most, base_angle by 15 degrees (262 "
            "tolerances).",
            "mechanism",
        ),
    ],
)
def test_check_says_which_leg_differs_by_what(
    symkin: Callable, name: str, verdict: str, design: str
) -> None:
    document = symkin("check", name, "--json").json
    assert document["verdict"] == verdict
    assert document["measuring"]["design"] == "legs"  # plan's default
    assert document["measuring"]["shortest_design"] == design
    assert verdict in symkin("check", name).words


def test_a_result_without_its_report_is_all_but_the_page(symkin: Callable, tmp_path: Path) -> None:
    small = ("--candidates", 300, "--pose-count", 10, "--no-report")
    made = symkin("run", "3RRR", *small, "--out", tmp_path / "out")
    assert made.code == 0
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == set(ProtocolResult.FILES) - {"report.html"}
    assert made.out.splitlines()[-1] == str(tmp_path / "out" / "residuals.csv")


def test_check_names_what_keeps_a_calibrated_mechanism_from_its_symmetry(
    symkin: Callable, protocol: Path
) -> None:
    calibrated = protocol / "calibrated.toml"
    shown = symkin("check", calibrated)
    assert shown.code == 0
    whole = symkin("check", calibrated, "--verbose").out
    assert "Nearly D_6 (D_3), with the working modes C_3: within" in whole
    symmetry = symkin("check", calibrated, "--json").json["symmetry"]
    assert symmetry["verdict"] == "nearly"
    worst = symmetry["deviations"][0]
    where = f"leg {worst['leg']} differs most, {worst['parameter']} by "
    assert f"alike within tolerances, not exactly: {where}" in shown.words
    assert worst["unit"] == "m"
    row = rf"^leg {worst['leg']}, {worst['parameter']} +{1e3 * worst['deviation']:#.3g} mm "
    assert re.search(row, whole, re.MULTILINE)
    assert worst["standard_deviation"] > 0


def test_check_writes_its_report_and_the_document_that_json_prints(
    symkin: Callable, tmp_path: Path
) -> None:
    shown = symkin("check", "5bar", "--out", tmp_path)
    assert shown.code == 0
    assert shown.out.splitlines()[-1] == str(tmp_path / "check.html")
    printed = symkin("check", "5bar", "--json").out
    assert (tmp_path / "check.json").read_text(encoding="utf-8") == printed
    assert symkin("check", "5bar", "--out", tmp_path).code == 2
    assert symkin("check", "5bar", "--out", tmp_path, "--overwrite").code == 0


def test_check_needs_no_workspace(symkin: Callable, changed: Callable, tmp_path: Path) -> None:
    text = Path(changed("schema", "schema")).read_text()
    path = tmp_path / "bare.toml"
    path.write_text(text[: text.index("[workspace]")])
    shown = symkin("check", path, "--out", tmp_path / "out")
    assert shown.code == 0
    assert "no [workspace] in the file" in shown.out
    assert (tmp_path / "out" / "check.html").exists()


@pytest.mark.usefixtures("unillustrated")
def test_plan_shows_the_same_of_every_leg(symkin: Callable, tmp_path: Path) -> None:
    out = tmp_path / "new"
    arguments = ("plan", "3RRR", "--out", out, "--pose-count", 9, "--candidates", 300)
    document = symkin(*arguments, "--json").json
    assert document["poses"] == 27
    assert [leg["leg"] for leg in document["legs"]] == [1, 2, 3]
    assert document["selection"]["choices"][0]["legs"] == [1, 2, 3]
    first, *others = (leg["r_diagonal"] for leg in document["legs"])
    assert all(leg == pytest.approx(first, rel=1e-9) for leg in others)
    shown = symkin(*arguments, "--overwrite")
    assert "Beside it: plan.csv, plan.json" in shown.out
    assert shown.out.splitlines()[-1] == str(out / "plan.html")
    assert "|R_ii|" not in shown.out
    assert "|R_ii|" in symkin(*arguments, "--overwrite", "--verbose").out


def test_plan_writes_its_certificate_to_a_page(symkin: Callable, tmp_path: Path) -> None:
    folder = tmp_path / "report"
    shown = symkin(
        *("plan", "3RRR", "--out", folder, "--candidates", 400),
        *("--design", "orbits", "--pose-count", 12, "--avoid", "y=30cm:", "--spares", 1),
    )
    assert shown.code == 0
    assert shown.out.endswith(f"{folder / 'plan.html'}\n")
    document = library.read_results(folder / "plan.json")
    (choice,) = document["selection"]["choices"]
    efficiency = f"{100 * choice['selection']['certificate']['efficiency']:.2f}"
    assert f"{efficiency} %" in shown.out
    page = (folder / "plan.html").read_text()
    assert efficiency in page
    assert f"Note: {document['selection']['excluded']} of 400 candidates are left out" in shown.out
    assert "Candidates (small dots" in page
    plan = library.read_plan(folder / "plan.csv", library.load_mechanism("3RRR"))
    assert plan.poses[:, 1].max() < 0.3
    assert len(plan.poses) == 12 + 3


@pytest.mark.usefixtures("unillustrated")
def test_plan_adds_to_what_is_measured_and_takes_what_is_required(
    symkin: Callable, tmp_path: Path, protocol: Path
) -> None:
    measured, needed, out = protocol / "measurements.csv", tmp_path / "n.csv", tmp_path / "p"
    needed.write_text("x_mm,y_m,phi_deg\n10,0.02,5\n")
    small = ("--candidates", 400, "--pose-count", 4, "--spares", 0)
    document = symkin(
        *("plan", "3RRR", "--out", out, *small, "--json"),
        *("--measured", measured, "--required", needed, "--minimum-distance", "2 cm"),
    ).json
    assert document["poses"] == 1 + 3 * 3
    plan = library.read_plan(out / "plan.csv", library.load_mechanism("3RRR"))
    assert plan.poses[plan.rows_of_set(-1)][0] == pytest.approx([0.01, 0.02, 0.0872664626])


def test_pose_count_tells_when_more_poses_gain_little(symkin: Callable, tmp_path: Path) -> None:
    arguments = ("pose-count", "3RRR", "--candidates", 400, "--least-gain", 0.02)
    shown = symkin(*arguments, "--out", tmp_path)
    assert shown.code == 0
    document = library.read_results(tmp_path / "pose-count.json")
    assert f"From {document['enough']} poses a leg on, another one saves less than 2 %" in shown.out
    assert document["poses_per_leg"][0] == 8
    assert document["poses_per_leg"][-1] == 80
    page = (tmp_path / "pose-count.html").read_text()
    assert f"From {document['enough']} poses a leg on" in page
    assert "Expected errors and efficiency against the number of poses." in page


def test_pose_count_says_how_many_poses_an_accuracy_needs(symkin: Callable, tmp_path: Path) -> None:
    small = ("pose-count", "3RRR", "--candidates", 400)
    shown = symkin(*small, "--accuracy", "0.06mm", "--accuracy", "0.2mrad", "--out", tmp_path)
    assert shown.code == 0
    answer = library.read_results(tmp_path / "pose-count.json")["accuracy"]
    assert answer["wanted_position_rms_m"] == pytest.approx(6e-5)
    assert answer["wanted_orientation_rms_rad"] == pytest.approx(2e-4)
    assert answer["expected"]["position_rms_m"] <= 6e-5
    count, poses = answer["poses_per_leg"], answer["poses"]
    sentence = f"{count} poses a leg, {poses} in all, are enough for 0.06 mm and 0.01146°"
    assert sentence in shown.out
    assert sentence in (tmp_path / "pose-count.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert f"--pose-count {count} " in shown.out


def test_pose_count_recommends_the_plan_that_it_counted_the_poses_of(symkin: Callable) -> None:
    small = ("pose-count", "3RRR", "--candidates", 200)
    assert "symkin plan 3RRR --pose-count" in symkin(*small).out
    shown = symkin(*small, "--design", "orbits", "--rows", "paper").out
    assert "symkin plan 3RRR --design orbits --rows paper --pose-count" in shown


def test_pose_count_says_what_else_helps_where_more_poses_do_not(symkin: Callable) -> None:
    shown = symkin("pose-count", "3RRR", "--candidates", 300, "--accuracy", "1um")
    assert shown.code == 0
    assert "are too few for 0.001 mm" in shown.out
    assert "times smaller" in shown.out
    assert "half the noise of the measured positions" in shown.out
    assert "the estimator joint" in shown.out


@pytest.mark.usefixtures("unillustrated")
def test_partial_measurements_are_simulated_read_and_refused_in_words(
    symkin: Callable, tmp_path: Path
) -> None:
    plan, robot = tmp_path / "plan.csv", tmp_path / "robot"
    symkin("plan", "3RRR", "--out", tmp_path, "--pose-count", 10, "--candidates", 300)
    simulate = ("simulate", "3RRR", "--plan", plan, "--out", robot)
    noisy = ("--missing", 0.2, "--spread", 0.5, "--base", "1 m, 20 cm, 170 deg")
    observe = ("--observe", "position", "--observe", "distance", "--anchors", "2 m, 100 cm")
    assert symkin(*simulate, *observe, *noisy).code == 0
    table = (robot / "measurements.csv").read_text().splitlines()
    assert table[0].startswith("leg,x_m,y_m,phi_rad,psi_1_rad")
    assert table[0].endswith("distance_1_m,distance_1_sd_m")
    assert len(table) == 31
    for estimator in ("implicit", "inverse", "paper"):
        refused = symkin(
            "identify", "3RRR", robot / "measurements.csv", "--estimator", estimator,
            "--out", tmp_path / "found",
        )  # fmt: skip
        assert refused.code == 2
        assert "row 2 has no measured phi" in refused.err
    for wrong, words in (
        (("--observe", "hight"), "observe is 'hight'; expected \"pose\""),
        (("--base", "1, 2"), '--base "1, 2" has 2 values; expected 3, in m, m, rad'),
        (("--base", "1, 2, 3 m"), "--base:"),
        (("--observe", "height"), "this robot is planar"),
    ):
        refused = symkin(*simulate, *wrong, "--overwrite")
        assert refused.code == 2
        assert words in refused.err


def test_the_stages_hand_files_to_each_other(symkin: Callable, tmp_path: Path) -> None:
    plan, robot = tmp_path / "plan.csv", tmp_path / "robot"
    measured, actual = robot / "measurements.csv", robot / "actual.toml"
    symkin("plan", "3RRR", "--out", tmp_path, "--pose-count", 10, "--candidates", 300)
    simulated = symkin("simulate", "3RRR", "--plan", plan, "--out", robot)
    assert re.search(r"Poses measured +30\n", simulated.out)
    folder = tmp_path / "identified"
    identified = symkin("identify", "3RRR", measured, "--out", folder, "--json").json
    assert identified["identification"]["residual_after_rms_m"] < 3e-4
    calibrated = folder / "calibrated.toml"
    for model, least, most in (("3RRR", 5e-4, 1e-1), (calibrated, 1e-6, 4e-4)):
        against = ("evaluate", model, "--actual", actual, "--json")
        for poses in (("--plan", plan), ("--candidates", 200)):
            error = symkin(*against, *poses).json["evaluation"]
            assert least < error["position_rms_m"] < most


def test_what_is_simulated_is_what_the_plan_was_made_for(symkin: Callable, tmp_path: Path) -> None:
    observed = ("--observe", "position", "--prior", "tolerances", "--no-report")
    planned = ("plan", "3RRR", *observed, "--pose-count", 12, "--candidates", 300)
    assert symkin(*planned, "--out", tmp_path).code == 0

    def simulated(plan: Path, *options: str) -> str:
        made = symkin("simulate", "3RRR", "--plan", plan, "--out", tmp_path / "robot", *options)
        assert made.code == 0
        return made.out + (tmp_path / "robot" / "measurements.csv").read_text().split("\n")[0]

    seen = simulated(tmp_path / "plan.csv")
    assert "phi" not in seen
    assert re.search(r"Poses measured in full +0\n", seen)
    assert "phi" in simulated(tmp_path / "plan.csv", "--observe", "pose", "--overwrite")
    rows = (tmp_path / "plan.csv").read_text().splitlines(keepends=True)
    (tmp_path / "mine.csv").write_text("".join(rows[:-1]))  # not the plan that plan.json is of
    assert "phi" in simulated(tmp_path / "mine.csv", "--overwrite")


def test_run_writes_all_its_files(protocol: Path) -> None:
    names = {path.name for path in protocol.iterdir()}
    files = ["plan.csv", "measurements.csv", "actual.toml", "calibrated.toml", "results.json"]
    assert names.issuperset([*files, "report.html"])
    assert not [name for name in names if name.startswith(".")]
    results = library.read_results(protocol / "results.json")
    before, after = results["evaluation"]["before"], results["evaluation"]["after"]
    assert after["position_rms_m"] < before["position_rms_m"] / 5
    compared = [(row["estimator"], row["poses"]) for row in results["comparison"]]
    assert compared == [
        ("paper", "own"),
        ("implicit", "own"),
        ("implicit", "all"),
        ("joint", "all"),
    ]


@pytest.mark.usefixtures("unillustrated")
def test_identify_finds_in_the_files_of_a_run_what_the_run_found(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    measured = protocol / "measurements.csv"
    assert symkin("identify", "3RRR", measured, "--out", tmp_path).code == 0
    ran, found = (
        library.read_results(folder / "results.json")["identification"]
        for folder in (protocol, tmp_path)
    )
    assert found == ran
    of_run, of_identify = (
        library.load_mechanism(folder / "calibrated.toml") for folder in (protocol, tmp_path)
    )
    assert (of_identify.parameters == of_run.parameters).all()
    assert (of_identify.deviations == of_run.deviations).all()


def test_identify_writes_the_table_as_its_likely_cause_corrects_it(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    robot = library.load_mechanism("3RRR")
    sound = library.read_measurements(protocol / "measurements.csv", robot)
    for name, signs in (("one", [1, -1, 1]), ("all", [-1, -1, -1])):
        wrong = library.Measurements.of(sound.poses, sound.readings * signs, sound.leg_sets)
        wrong.save(tmp_path / f"{name}.csv", robot)
        asked = ("identify", "3RRR", tmp_path / f"{name}.csv", "--no-report")
        shown = symkin(*asked, "--out", tmp_path / name)
        (command,) = re.findall(r"symkin identify (.*) --out corrected$", shown.out, re.M)
        assert command == f"3RRR {tmp_path / name / 'corrected.csv'}"
        again = library.read_measurements(tmp_path / name / "corrected.csv", robot)
        np.testing.assert_allclose(again.readings, sound.readings)


@pytest.mark.parametrize(
    ("name", "code", "legs", "change", "asked"),
    [
        ("3RRR", "working-mode", (0,), {}, ()),
        ("3RRR", "gain", (1,), {"sensor_gain": (1.5, 0.0)}, ()),
        ("linear_delta", "zero", (0,), {"sensor_offset": (1.0, 0.03)}, ()),
        (
            "linear_delta",
            "drawn-wrong",
            (0, 1, 2),
            {"sensor_gain": (1.25, 0.0)},
            ("--fixed", "sensor_gain", "--prior", "tolerances"),
        ),
    ],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_the_command_that_follows_a_wrong_drawing_cures_it(
    symkin: Callable,
    tmp_path: Path,
    name: str,
    code: str,
    legs: tuple[int, ...],
    change: dict[str, tuple[float, float]],
    asked: tuple[str, ...],
) -> None:
    drawn = library.load_mechanism(name)
    parameters = drawn.parameters.copy()
    for parameter, (factor, shift) in change.items():
        column = list(drawn.parameter_names).index(parameter)
        parameters[legs, column] = factor * parameters[legs, column] + shift
    built = drawn.with_parameters(parameters, symmetry=None)
    if code == "working-mode":
        modes = [
            -leg.working_mode if i in legs else leg.working_mode for i, leg in enumerate(drawn.legs)
        ]
        built = in_modes(drawn, modes)[0]
    if asked:  # then no robot differs from its drawing in what is held but by the factor
        built = built.replace(tolerances=dataclasses.replace(built.tolerances, gain=1e-9))
    taken = library.simulate(built, library.plan(built, seed=1), seed=3).measurements
    taken.save(tmp_path / "measured.csv", built)
    into = ("--no-report", "--out", tmp_path / "out")
    first = symkin("identify", name, tmp_path / "measured.csv", *asked, *into)
    found = library.read_estimate(tmp_path / "out")
    assert [(each.code, each.legs) for each in found.doubts] == [(code, legs)]
    (command,) = re.findall(r"^  symkin (identify .*) --out corrected$", first.out, re.M)
    assert f"{tmp_path / 'out' / 'corrected.toml'}" in command
    cured = symkin(*shlex.split(command), "--no-report", "--out", tmp_path / "cured")
    assert "nothing speaks against the estimate" in cured.words
    assert {each.name for each in (tmp_path / "cured").iterdir()}.isdisjoint(Estimate.SOMETIMES)


def test_an_interrupted_search_for_causes_loses_no_estimate(
    symkin: Callable, protocol: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = library.load_mechanism("3RRR")
    sound = library.read_measurements(protocol / "measurements.csv", robot)
    wrong = library.Measurements.of(sound.poses, sound.readings * [1, -1, 1], sound.leg_sets)
    wrong.save(tmp_path / "wrong.csv", robot)

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("symkin.estimate.evidence.examine.hypotheses_of", interrupted)
    into = ("--no-report", "--out", tmp_path / "out")
    told = symkin("identify", "3RRR", tmp_path / "wrong.csv", *into)
    assert "Ctrl-C ended the search for a cause" in told.words
    assert (tmp_path / "out" / "calibrated.toml").exists()


def test_ctrl_c_while_it_is_cross_validated_keeps_the_estimate(
    symkin: Callable, protocol: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("symkin.estimate.cross_validation.settled", interrupted)
    monkeypatch.setattr("symkin.estimate.cross_validation.closures_of", interrupted)
    into = ("--cross-validate", 5, "--no-report", "--out", tmp_path / "out")
    told = symkin("identify", "3RRR", protocol / "measurements.csv", *into)
    assert "Interrupted: it is not cross-validated" in told.err
    assert library.read_estimate(tmp_path / "out").cross_validation is None


@pytest.mark.parametrize("command", ["identify", "run", "identify-batch"])
def test_ctrl_c_while_the_page_is_drawn_keeps_the_rest(
    symkin: Callable,
    protocol: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
) -> None:
    def interrupted(_page: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr("symkin.show.rendering.page_html", interrupted)
    of = () if command == "run" else (protocol / "measurements.csv",)
    few = ("--candidates", "300", "--pose-count", "10") if command == "run" else ()
    told = symkin(command, "3RRR", *of, *few, "--out", tmp_path / "out")
    assert told.code == 0
    assert "Interrupted: the page is not drawn" in told.err
    names = {each.name for each in (tmp_path / "out").iterdir()}
    assert names >= ({"fleet.csv"} if command == "identify-batch" else {"calibrated.toml"})
    assert "report.html" not in {*names, *told.words.split()}


def test_ctrl_c_keeps_the_robots_that_are_identified(
    symkin: Callable, protocol: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    identified, met = fleet_module.part_of, list[object]()

    def interrupted(*given: Any) -> Any:
        met.append(given)
        if len(met) == 3:
            raise KeyboardInterrupt
        return identified(*given)

    monkeypatch.setattr("symkin.estimate.fleet.part_of", interrupted)
    monkeypatch.setattr("symkin.estimate.fleet_sources._ROWS", 1)
    files = [tmp_path / f"{name}.csv" for name in "abcd"]
    for file in files:
        shutil.copy(protocol / "measurements.csv", file)
    told = symkin("identify-batch", "3RRR", *files, "--out", tmp_path / "out", "--no-report")
    assert told.code == 0
    assert "Ctrl-C ended it" in told.words
    assert len((tmp_path / "out" / "fleet.csv").read_text().splitlines()) == 3


def test_a_refusal_writes_the_table_as_its_likely_cause_corrects_it(
    symkin: Callable, tmp_path: Path
) -> None:
    robot = library.load_mechanism("rotary_delta")
    poses = library.sample_workspace(robot, 60, seed=1).poses
    noise = robot.noise.position * np.random.default_rng(1).standard_normal(poses.shape)
    readings = robot.inverse_kinematics(poses)
    wrong = library.Measurements.of(poses + noise, -readings, pose_space="translating")
    wrong.save(tmp_path / "wrong.csv", robot)
    asked = ("identify", "rotary_delta", tmp_path / "wrong.csv")
    told = "with --out DIR the table so corrected is written as DIR/corrected.csv"
    assert symkin(*asked).err.endswith(f"; {told}\n")
    refused = symkin(*asked, "--out", tmp_path / "out")
    assert refused.code == 1
    assert refused.err.endswith(
        f"; the table so corrected is {tmp_path / 'out' / 'corrected.csv'}\n"
    )
    assert [each.name for each in (tmp_path / "out").iterdir()] == ["corrected.csv"]
    again = library.read_measurements(tmp_path / "out" / "corrected.csv", robot)
    np.testing.assert_allclose(again.readings, readings)


def test_a_refusal_writes_the_drawing_as_its_likely_cause_corrects_it(
    symkin: Callable, tmp_path: Path
) -> None:
    robot = library.load_mechanism("3RRR")
    plan = library.plan(robot, 9, seed=3)
    taken = library.simulate(robot, plan, seed=2, observe="position").measurements
    turned = taken.readings - np.array([0, 0, np.pi])
    dataclasses.replace(taken, readings=turned).save(tmp_path / "wrong.csv", robot)
    asked = ("identify", "3RRR", tmp_path / "wrong.csv")
    told = "with --out DIR the drawing so corrected is written as DIR/corrected.toml"
    assert symkin(*asked).err.endswith(f"; {told}\n")
    refused = symkin(*asked, "--out", tmp_path / "out")
    drawing = tmp_path / "out" / "corrected.toml"
    assert refused.err.endswith(f"; the drawing so corrected is {drawing}\n")
    cured = symkin("identify", drawing, tmp_path / "wrong.csv")
    assert "nothing speaks against the estimate" in cured.words


@pytest.mark.usefixtures("unillustrated")
def test_the_results_file_of_identify_is_what_json_prints_and_what_save_writes(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    measured = protocol / "measurements.csv"
    command = ("identify", "3RRR", measured, "--cross-validate", 8, "--loss", "cauchy")
    printed = symkin(*command, "--out", tmp_path, "--json").out
    robot = library.load_mechanism("3RRR")
    found = library.identify(robot, library.read_measurements(measured, robot), loss="cauchy")
    with asked_by("command"):  # in whose language remedies are told
        found.cross_validated(8).save(tmp_path / "saved.json")
    for name in ("results.json", "saved.json"):
        assert (tmp_path / name).read_text(encoding="utf-8") == printed


def test_evaluate_writes_its_page_and_the_document_that_json_prints(
    symkin: Callable, refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    command = ("evaluate", "3RRR", "--measurements", protocol / "measurements.csv")
    shown = symkin(*command, "--out", tmp_path)
    assert shown.out.splitlines()[-1] == str(tmp_path / "evaluation.html")
    document = (tmp_path / "evaluation.json").read_text(encoding="utf-8")
    assert document == symkin(*command, "--json").out
    refused(*command, "--out", tmp_path, words="exists")


def test_identify_prints_residuals_parameters_and_cross_validation(
    symkin: Callable, protocol: Path
) -> None:
    measured = protocol / "measurements.csv"
    command = ("identify", "3RRR", measured, "--cross-validate", 8, "--loss", "cauchy")
    shown = symkin(*command, "--verbose")
    assert shown.code == 0
    for words in (
        "Closure residual of all legs",
        "8-fold cross-validation (poses that the fit did not see)",
        "Standard deviation",
        "chi-square",
    ):
        assert words in shown.out
    document = symkin("identify", "3RRR", measured, "--estimator", "paper", "--json").json
    assert document["identification"]["estimator"] == "paper"
    parameter = document["identification"]["params"]["leg3.base_angle"]
    assert abs(parameter["value"] - parameter["nominal"]) < 0.01
    assert 0 < parameter["deviation"] < 0.01


def test_identify_predicts_the_end_effector_at_unseen_poses_in_blocks(
    symkin: Callable, protocol: Path
) -> None:
    command = ("identify", "3RRR", protocol / "measurements.csv", "--cross-validate", 3)
    blocks = symkin(*command, "--cross-validate-blocks", "--verbose")
    assert blocks.code == 0
    assert "As it is, 3-block cross-validation\nunseen position, root mean square" in blocks.out
    random, blocks = (
        symkin(*command, *option, "--json").json["cross_validation"]
        for option in ((), ("--cross-validate-blocks",))
    )
    assert (random["blocks"], blocks["blocks"]) == (False, True)
    errors = [each["evaluation"]["position_rms_m"] for each in (random, blocks)]
    assert 0 < errors[0] != errors[1]


def test_blocks_without_cross_validation_are_refused(refused: Callable, protocol: Path) -> None:
    measured = protocol / "measurements.csv"
    refused("identify", "3RRR", measured, "--cross-validate-blocks", words="--cross-validate")


def test_evaluate_says_first_what_no_frame_explains(symkin: Callable, protocol: Path) -> None:
    command = ("evaluate", "3RRR", "--measurements", protocol / "measurements.csv")
    lines = symkin(*command, "--verbose").out.splitlines()
    first = lines.index("End-effector error")
    labels = [line.split("  ")[0] for line in lines[first + 2 :]]
    assert labels[:2] == [
        "After the best alignment of the frames",
        "aligned position, root mean square",
    ]
    assert labels.index("position, root mean square") < labels.index("mean phi")
    figures = symkin(*command, "--json").json["evaluation"]
    assert 0 < figures["aligned"]["position_rms_m"] < figures["position_rms_m"]
    assert len(figures["aligned"]["base"]) == len(figures["aligned"]["tool"]) == 3
    assert list(figures["mean_difference"]) == ["x_m", "y_m", "phi_rad"]


def test_measurements_are_read_through_a_column_mapping(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    table = (protocol / "measurements.csv").read_text()
    foreign = tmp_path / "foreign.csv"
    foreign.write_text(table.replace("leg,x_m,y_m,phi_rad,psi_1_rad", "set,u,v,turn,one", 1))
    mapping = tmp_path / "mapping.toml"
    mapping.write_text(
        '[measurements]\nposition = ["u", "v"]\nangle = "turn"\nleg = "set"\n'
        'readings = ["one", "psi_2_rad", "psi_3_rad"]\n'
        'position_unit = "m"\norientation_unit = "rad"\nreading_unit = "rad"\n'
    )
    for command in (("identify", "3RRR", foreign), ("evaluate", "3RRR", "--measurements", foreign)):
        read = symkin(*command, "--columns", mapping, "--json")
        assert read.code == 0, read.err


@pytest.mark.parametrize("extension", ["csv", "parquet"])
def test_a_rerun_with_the_same_seed_writes_the_same_bytes(
    symkin: Callable, tmp_path: Path, extension: str
) -> None:
    plan = f"plan.{extension}"
    for name in ("first", "second"):
        out = tmp_path / name
        small = ("--pose-count", 8, "--candidates", 200, "--seed", 7)
        assert symkin("plan", "3RRR", "--out", out, *small).code == 0
        made = library.read_plan(out / "plan.csv", library.load_mechanism("3RRR"))
        made.save(out / plan, overwrite=True)
        simulated = symkin("simulate", "3RRR", "--plan", out / plan, "--out", out, "--seed", 7)
        assert simulated.code == 0
    for name in (plan, "measurements.csv", "actual.toml"):
        assert filecmp.cmp(tmp_path / "first" / name, tmp_path / "second" / name, shallow=False)


def test_a_rerun_of_run_writes_the_same_bytes(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    again = symkin("run", "3RRR", "--out", tmp_path, "--pose-count", 10, "--candidates", 300)
    assert again.code == 0
    names = ["plan.csv", "measurements.csv", "actual.toml", "calibrated.toml", "results.json"]
    _, different, missing = filecmp.cmpfiles(protocol, tmp_path, names, shallow=False)
    assert (different, missing) == ([], [])


@pytest.mark.usefixtures("unillustrated")
def test_another_seed_chooses_other_poses(symkin: Callable, tmp_path: Path) -> None:
    for seed in (1, 2):
        small = ("--pose-count", 8, "--candidates", 200, "--seed", seed)
        symkin("plan", "3RRR", "--out", tmp_path / str(seed), *small)
    plans = (tmp_path / "1" / "plan.csv", tmp_path / "2" / "plan.csv")
    assert not filecmp.cmp(*plans, shallow=False)


def test_a_result_that_did_not_converge_is_told_with_exit_code_1(
    symkin: Callable, protocol: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    identify = library.identify

    def unconverged(*arguments: object, **options: object) -> object:
        found = identify(*arguments, **options)
        return dataclasses.replace(found, converged=False, failure="leg 2 (too few iterations)")

    monkeypatch.setattr(library, "identify", unconverged)
    shown = symkin("identify", "3RRR", protocol / "measurements.csv", "--json")
    assert shown.code == 1
    assert shown.err == "Not converged: leg 2 (too few iterations)\n"
    assert shown.json["identification"]["converged"] is False


def test_an_estimate_that_no_leg_can_have_is_told_with_exit_code_1(
    symkin: Callable, tmp_path: Path
) -> None:
    robot = library.load_mechanism("3RRP")
    sample = library.sample_workspace(robot, 40, 1)
    seen = library.Measurements.of(sample.poses, sample.readings)
    library.write_measurements(seen, tmp_path / "measured.csv", robot)
    values, names = robot.parameters.copy(), robot.parameter_names
    values[1, names.index("proximal_length")] *= 0.1
    values[1, names.index("sensor_offset")] += math.pi
    nominal = robot.replace(symmetry=None).with_parameters(values)
    library.save_mechanism(nominal, tmp_path / "nominal.toml")
    out = tmp_path / "out"
    shown = symkin("identify", tmp_path / "nominal.toml", tmp_path / "measured.csv", "--out", out)
    assert (shown.code, shown.out) == (1, "")
    assert shown.err.startswith("Not converged: the estimate is no mechanism: leg 2 ")
    assert shown.err.count("\n") == 1
    assert not out.exists()


def test_evaluate_says_where_rows_are_those_of_the_calibration(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    rows = (protocol / "measurements.csv").read_text().splitlines(keepends=True)
    seen = "10 of 10 rows are those that the calibration was fitted to"
    (tmp_path / "some.csv").write_text("".join(rows[:11]))
    table = ("--measurements", tmp_path / "some.csv")
    assert seen in symkin("evaluate", protocol / "calibrated.toml", *table).words
    assert "fitted to" not in symkin("evaluate", "3RRR", *table).words


def test_evaluate_shows_the_closures_of_measurements(symkin: Callable, protocol: Path) -> None:
    arguments = ("evaluate", "3RRR", "--measurements", protocol / "measurements.csv")
    closures = symkin(*arguments, "--json").json["evaluation"]["closures"]
    assert len(closures["legs_rms_m"]) == 3
    lines = symkin(*arguments, "--verbose").out.splitlines()
    first = lines.index("How far the legs miss closing") + 2
    shown = [line.split("  ") for line in lines[first : first + 4]]
    expected = [closures["rms_m"], *closures["legs_rms_m"]]
    assert [row[-1].strip() for row in shown] == [
        milli(value, "m").replace("\N{NO-BREAK SPACE}", " ") for value in expected
    ]
    assert [row[0] for row in shown] == ["all legs", "leg 1", "leg 2", "leg 3"]
    against = ("evaluate", "3RRR", "--actual", protocol / "actual.toml", "--candidates", 200)
    assert symkin(*against, "--json").json["evaluation"]["closures"] is None


@pytest.mark.usefixtures("unillustrated")
def test_measurements_of_one_leg_a_row_are_identified_without_end_effector_errors(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    header, *rows = (protocol / "measurements.csv").read_text().splitlines()
    partial = tmp_path / "partial.csv"
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[4:] = [cell if str(leg) == row[0] else "" for leg, cell in enumerate(row[4:], 1)]
    partial.write_text("\n".join([header, *(",".join(row) for row in cells)]) + "\n")
    shown = symkin("identify", "3RRR", partial, "--out", tmp_path / "out")
    assert shown.code == 0, shown.err
    assert "End-effector error" not in shown.out
    assert "No end-effector error" in (tmp_path / "out" / "report.html").read_text()
    assert (tmp_path / "out" / "calibrated.toml").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_shows_an_example(symkin: Callable, command: str) -> None:
    shown = symkin(command, "--help")
    assert shown.code == 0
    assert "\n  Example:\n    symkin " in shown.out
    assert f"    symkin {command} " in shown.out
    assert "--json" in shown.out


@pytest.mark.parametrize("command", ["plan", "identify", "simulate"])
def test_help_leaves_what_is_seldom_used_to_the_whole_help(symkin: Callable, command: str) -> None:
    short, whole = symkin(command, "--help").out, symkin(command, "--help-all").out
    assert "\n  --seed" not in short
    assert "How it is computed:" in whole
    assert "--seed" in whole
    left = whole.count("\n  --") - short.count("\n  --")
    assert f"--help-all has {left} more options." in short
    assert "more options" not in whole


def test_symkin_alone_shows_its_commands(symkin: Callable) -> None:
    shown = symkin()
    assert shown.code == 0
    assert all(f"\n  {command} " in shown.out for command in COMMANDS)


def test_the_last_line_is_the_command_that_settles_what_is_wrong(
    symkin: Callable, tmp_path: Path
) -> None:
    robot = library.load_mechanism("5bar")
    taken = library.simulate(robot, library.plan(robot, 12)).measurements
    turn, (x, y) = 0.3, 1e3 * taken.poses.T
    values = {
        "X [mm]": np.cos(turn) * x - np.sin(turn) * y + 80,
        "Y [mm]": np.sin(turn) * x + np.cos(turn) * y - 20,
        "q1 [rad]": taken.readings[:, 0],
        "q2 [rad]": taken.readings[:, 1],
    }
    rows = np.column_stack(list(values.values())).tolist()
    table, columns = tmp_path / "mine.csv", tmp_path / "columns.toml"
    table.write_text("\n".join([";".join(values), *(";".join(map(str, row)) for row in rows)]))
    refused = symkin("identify", "5bar", table, "--no-report").err
    columns.write_text(refused.partition("(FILE)): ")[2])
    wrong = symkin("identify", "5bar", table, "--columns", columns, "--no-report")
    (command,) = re.findall(r"Next: if that is so, identify so:\n  symkin (.*)", wrong.out)
    assert command == f"identify 5bar --columns {columns} {table} --frames base --out corrected"
    right = symkin(*command.split()[:-1], tmp_path / "corrected", "--no-report")
    assert (right.code, "nothing speaks against" in right.out) == (0, True)
    calibrated = tmp_path / "corrected" / "calibrated.toml"
    assert symkin("evaluate", calibrated, "--measurements", table).code == 0


def test_pixels_of_a_camera_whose_image_is_left_handed_are_identified_as_the_screens_say(
    symkin: Callable, tmp_path: Path
) -> None:
    robot = library.load_mechanism("5bar")
    taken = library.simulate(robot, library.plan(robot, 18)).measurements
    x, y = taken.poses.T / 1e-4
    values = {"u_px": x + 900, "v_px": 4000 - y}
    values |= {f"servo{leg + 1}_rad": taken.readings[:, leg] for leg in range(2)}
    rows = np.column_stack(list(values.values())).tolist()
    table, columns = tmp_path / "camera.csv", tmp_path / "columns.toml"
    table.write_text("\n".join([",".join(values), *(",".join(map(str, row)) for row in rows)]))
    refused = symkin("identify", "5bar", table, "--no-report").err
    assert 'of counts or pixels, the size of one: "360 deg/4096/count", "0.1 mm/px"' in refused
    line = refused.partition("(FILE)): ")[2]
    assert line.count('"?"') == 1
    columns.write_text(line.replace('"?"', '"0.1 mm/px"'))
    asked = ("--columns", columns, "--frames", "base", "--prior", "tolerances", "--no-report")
    wrong = symkin("identify", "5bar", table, *asked, "--out", tmp_path / "wrong")
    assert "left-handed" in wrong.out
    (command,) = re.findall(r"Next: if that is what happened.*\n.*\n  symkin (.*)", wrong.out)
    right = symkin(*command.split()[:-1], tmp_path / "corrected", "--no-report")
    assert (right.code, "nothing speaks against" in right.out) == (0, True)
