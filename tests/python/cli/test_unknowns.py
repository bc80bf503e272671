# SPDX-License-Identifier: MIT
"""What is unknown, said on the command line."""

import json

import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.cli import main


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    paper = symkin.load_mechanism("3RRR")
    observe = Observed("pose", base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17))
    made = symkin.simulate(paper, paper.plan(12, seed=3), seed=4, observe=observe)
    path = tmp_path_factory.mktemp("measured") / "tracked.csv"
    made.measurements.save(path)
    return path


def identified(capsys, *arguments):
    assert main(["identify", "3RRR", *map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)["identification"]


def test_options_say_what_is_unknown(measured, capsys):
    found = identified(
        capsys, measured, "--frames", "base,target", "--shared", "sensor_gain",
        "--fixed", "leg[12].base_radius, leg3.*_length", "--prior", "base_angle=0.5 mrad",
        "--gauge", "nominal", "--sensor", "eccentric",
    )  # fmt: skip
    status = {name: each["status"] for name, each in found["params"].items()}
    assert status["leg1.sensor_gain"] == "shared"
    assert status["leg2.base_radius"] == status["leg3.distal_length"] == "held"
    assert status["leg3.base_radius"] != "held"
    assert "leg1.sensor_sine" in status
    priors = {name: each["prior"] for name, each in found["params"].items()}
    assert priors["leg2.base_angle"] == pytest.approx(5e-4)
    assert found["frames"]["base"][0] == pytest.approx(1.0, abs=0.02)


def test_the_folder_holds_everything_and_the_verdict_comes_first(measured, tmp_path, capsys):
    folder = tmp_path / "out"
    arguments = [str(measured), "--frames", "base", "--frames", "target", "--out", str(folder)]
    assert main(["identify", "3RRR", *arguments]) == 0
    assert capsys.readouterr().out.splitlines()[2].startswith("Converged")
    names = {"calibrated.toml", "latent_poses.csv", "report.html", "residuals.csv", "results.json"}
    assert {each.name for each in folder.iterdir()} == names
    lines = (folder / "latent_poses.csv").read_text().splitlines()
    assert lines[0].startswith("row,x_m,y_m,phi_rad,error_1_rad")
    assert len(lines) == 37
    page = (folder / "report.html").read_text()
    assert "What no observation shows" in page
    assert 'id="t_values' in page
    again = [str(folder / "calibrated.toml"), "--measurements", str(measured)]
    assert main(["evaluate", *again, "--json"]) == 0
    evaluated = json.loads(capsys.readouterr().out)["evaluation"]
    assert evaluated["position_rms_m"] < 3e-4


@pytest.mark.usefixtures("unillustrated")
def test_a_file_says_what_is_unknown_unless_an_option_does(measured, tmp_path, capsys):
    symkin.load_mechanism("3RRR").save(tmp_path / "robot.toml")
    with (tmp_path / "robot.toml").open("a") as file:
        file.write('\n[identification]\nframes = ["base", "target"]\nshared = ["sensor_gain"]\n')
    arguments = [str(tmp_path / "robot.toml"), str(measured), "--json"]
    for options, expected in (([], "shared"), (["--shared", "base_radius"], "free")):
        assert main(["identify", *arguments, *options]) == 0
        found = json.loads(capsys.readouterr().out)["identification"]
        status = {name: each["status"] for name, each in found["params"].items()}
        assert status["leg1.sensor_gain"] == expected


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--free", "sensor_ofset"], 'did you mean "sensor_offset"?'),
        (["--frames", "bases"], "frames is 'bases'; expected \"base\""),
        (
            ["--prior", "base_radius"],
            'expected "tolerances", "fitted", or patterns with a standard',
        ),
        (["--prior", "base_radius=1 deg"], 'the prior of "base_radius"'),
        (["--estimator", "paper", "--shared", "sensor_gain"], 'expected "joint" here, since'),
        (["--sensor", "cubic"], "--sensor"),
    ],
)
def test_wrong_options_are_refused_in_one_sentence(measured, capsys, options, message):
    assert main(["identify", "3RRR", str(measured), *options]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert len(told.splitlines()) == 1


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ('[identification]\nfrees = ["base"]', 'frees: unknown key; did you mean "free"'),
        ('[identification]\nframes = ["bases"]', "identification.frames[1]: is 'bases'"),
        ("[identification]\nprior = 3", "identification.prior: is 3; expected 'tolerances'"),
        ("[frames]\nbase = [1, 2]", "frames.base: has 2 values; expected 3"),
        ("[frames]\nplane = [1, 2, 3]", "frames.plane: unknown key"),
    ],
)  # fmt: skip
def test_wrong_sections_are_refused_with_line_and_key(tmp_path, section, message):
    symkin.load_mechanism("3RRR").save(tmp_path / "robot.toml")
    with (tmp_path / "robot.toml").open("a") as file:
        file.write(f"\n{section}\n")
    with pytest.raises(symkin.errors.MechanismFileError) as error:
        symkin.load_mechanism(tmp_path / "robot.toml")
    assert message in str(error.value)


@pytest.mark.usefixtures("unillustrated")
def test_a_plan_is_for_what_will_be_observed_and_is_unknown(tmp_path, capsys):
    asked = ["--design", "mechanism", "--observe", "position", "--prior", "tolerances"]
    asked += ["--fixed", "sensor_gain", "--base", "1 m, 0, 90 deg", "--candidates", "500"]
    arguments = ["plan", "3RRR", "--out", str(tmp_path / "out"), "--pose-count", "20", *asked]
    assert main([*arguments, "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    survey = made["selection"]["survey"]
    assert survey["observed"]["kinds"] == ["position"]
    assert survey["observed"]["base"] == pytest.approx([1.0, 0.0, 1.5707963], abs=1e-6)
    assert len(survey["unknowns"]) == len(made["unknowns"]) == 21
    page = (tmp_path / "out/plan.html").read_text()
    assert "Observed will be the readings and position of the target" in page
    assert main(["pose-count", "3RRR", *asked, "--accuracy", "0.1mm", "--json"]) == 0
    needed = json.loads(capsys.readouterr().out)
    assert needed["settings"]["estimator"] == "joint"
    assert needed["accuracy"]["expected"]["position_rms_m"] <= 1e-4
    legs = ["plan", "3RRR", "--out", str(tmp_path / "legs"), "--observe", "position"]
    assert main([*legs, "--design", "legs"]) == 2
    assert 'choose the design "mechanism"' in capsys.readouterr().err


@pytest.mark.usefixtures("unillustrated")
def test_a_delta_is_calibrated_from_points_to_size(tmp_path, capsys):
    folder, probed = tmp_path / "probe", tmp_path / "probed"
    heights = ["linear_delta", "--observe", "height", "--out"]
    assert main(["plan", *heights, str(folder), "--candidates", "300", "--spares", "0"]) == 0
    points = (folder / "points.csv").read_text().splitlines()
    assert points[0] == "x_mm,y_mm"
    assert len(points) == 22
    plan = str(folder / "plan.csv")
    assert main(["simulate", *heights, str(probed), "--plan", plan, "--seed", "3"]) == 0
    capsys.readouterr()
    length = ["--printed", "100 mm = 100.2 mm +- 0.02 mm"]
    table = str(probed / "measurements.csv")
    assert main(["identify", "linear_delta", table, *length, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["identification"]["frames"]["plane"]
    heights = found["heights"]
    assert 0 < heights["size_after"] < heights["size_before"]
    assert any("one more length" in note["cause"] for note in found["identification"]["notes"])


def test_a_printed_length_does_not_go_with_frames(tmp_path, capsys):
    table = tmp_path / "probe.csv"
    table.write_text("psi_1_mm,psi_2_mm,psi_3_mm,height_mm\n180,181,182,0\n170,185,190,0\n")
    length = ["--printed", "100 mm = 100.2 mm", "--frames", "plane"]
    assert main(["identify", "linear_delta", str(table), *length]) == 2
    assert "--fixed instead" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["100 mm", "100 mm = 3 kg", "100 mm = 100 m"])
def test_a_printed_length_that_is_none_is_refused(text, tmp_path, capsys):
    table = tmp_path / "probe.csv"
    table.write_text("psi_1_mm,psi_2_mm,psi_3_mm,height_mm\n180,181,182,0\n170,185,190,0\n")
    assert main(["identify", "linear_delta", str(table), "--printed", text]) == 2
    assert "printed" in capsys.readouterr().err
