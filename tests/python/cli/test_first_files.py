# SPDX-License-Identifier: MIT
"""Files as somebody writes them on the first day: no margins, whole boxes as workspaces."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import symkin as library
from symkin.analysis.workspace import least_reach_margin

FIVE_BAR = """
schema = 1
name = "five-bar"
chain = "[R]RR"
platform = "point"

[symmetry]
group = "D1"
axis = "90 deg"
legs = 2

[reference_leg]
working_mode = -1
proximal_length = "90 mm"
distal_length = "90 mm"
base_radius = "59 mm"
base_angle = "180 deg"
sensor_gain = 1
sensor_offset = 0

[workspace]
x = ["-60 mm", "60 mm"]
y = ["50 mm", "170 mm"]
home = ["0 m", "120 mm"]
"""

SLIDERS = """
schema = 1
name = "three sliders"
chain = "[P]RR"

[symmetry]
group = "C3"
legs = 3

[reference_leg]
working_mode = 1
distal_length = "350 mm"
base_radius = "300 mm"
base_angle = "-90 deg"
platform_radius = "100 mm"
platform_angle = "-90 deg"
sensor_gain = 1
sensor_offset = 0

[workspace]
x = ["-200 mm", "200 mm"]
y = ["-200 mm", "200 mm"]
phi = ["-40 deg", "40 deg"]
"""

SMALL = ("--pose-count", 12, "--candidates", 3000)


def with_margin(text: str, margin: str) -> str:
    return f'{text}reach_margin = "{margin}"\n'


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        path = tmp_path / "robot.toml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("text", [FIVE_BAR, SLIDERS], ids=["five-bar", "sliders"])
def test_a_first_file_is_run(
    symkin: Callable, written: Callable, tmp_path: Path, text: str
) -> None:
    made = symkin("run", written(text), "--out", tmp_path / "out", *SMALL, "--json")
    assert made.code == 0, made.err
    figures = made.json["evaluation"]
    # Within the margin that the tolerances ask for, the calibrated robot takes every pose.
    assert figures["expected"]["failed"] == figures["after"]["failed"] == 0
    assert figures["after"]["position_rms_m"] < 3 * figures["expected"]["position_rms_m"]


def test_poses_without_an_expected_accuracy_are_left_out_and_counted(
    symkin: Callable, written: Callable, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    file = written(with_margin(FIVE_BAR, "0 mm"))
    made = symkin("run", file, "--out", out, *SMALL, "--verbose")
    assert made.code == 0, made.err
    figures = library.read_results(out / "results.json")["evaluation"]
    failed = [figures[column]["failed"] for column in ("before", "after", "expected")]
    assert failed[2] > 0
    assert figures["expected"]["evaluated"] == 3000 - failed[2]
    rows = [line.split() for line in made.out.splitlines()]
    assert ["failed", *map(str, failed)] in rows
    report = (out / "report.html").read_text()
    assert f"{failed[2]} of 3" in report[: report.index("<main>")].split("after and ")[1]


def test_the_margin_of_reach_grows_with_the_tolerances(written: Callable) -> None:
    margins = []
    for length in ("0.1 mm", "1 mm", "5 mm"):
        tolerances = f'\n[tolerances]\nlength = "{length}"\nangle = 1e-6\ngain = 1e-6\n'
        mechanism = library.load_mechanism(written(FIVE_BAR + tolerances))
        margins.append(least_reach_margin(mechanism))
        sample = library.sample_workspace(mechanism, 2000)
        reached = library._core.reach_margin(mechanism.core, sample.poses)
        assert margins[-1] <= reached.min() < 2 * margins[-1]
    assert margins[1] == pytest.approx(10 * margins[0], rel=1e-3)
    assert margins[2] == pytest.approx(50 * margins[0], rel=1e-3)


def test_tolerances_never_put_home_out_of_reach(written: Callable) -> None:
    coarse = '\n[tolerances]\nlength = "1 m"\n'
    mechanism = library.load_mechanism(written(FIVE_BAR + coarse))
    home = library._core.reach_margin(mechanism.core, mechanism.home[None]).min()
    assert least_reach_margin(mechanism) == pytest.approx(home / 2)
    assert len(library.sample_workspace(mechanism, 100).poses) == 100


@pytest.mark.parametrize("margin", ["0 mm", "7 mm"])
def test_a_margin_that_the_file_gives_is_kept(written: Callable, margin: str) -> None:
    mechanism = library.load_mechanism(written(with_margin(FIVE_BAR, margin)))
    assert least_reach_margin(mechanism) == pytest.approx(float(margin[0]) / 1000)
