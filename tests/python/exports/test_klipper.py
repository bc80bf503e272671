# SPDX-License-Identifier: MIT
"""Printers read from Klipper's configuration."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.probing import PrintedLength, with_printed_length
from symkin.cli import main
from symkin.errors import SymkinError
from symkin.exports.reading import import_mechanism

DRAWN = {"radius": 105.6, "angles": (210.0, 330.0, 90.0), "stops": (212.7, 212.7, 212.7)}
BUILT = {"radius": 106.1, "angles": (210.3, 329.8, 90.0), "stops": (212.9, 212.3, 213.1)}
ARM = 215.0
STEP = 40 / (200 * 16)  # mm
MAIN = """# a printer
[include pins.cfg]
[printer]
kinematics: delta
max_velocity: 300  # mm/s
delta_radius: 105.6
print_radius: 80
[stepper_a]
rotation_distance = 40
microsteps: 16
position_endstop: 212.7
arm_length: 215
[stepper_b]
rotation_distance: 80
microsteps: 16
gear_ratio: 3:2, 4:3
[stepper_c]
rotation_distance: 20
microsteps: 8
[gcode_macro G29]
gcode:
  G28  ; home
  {% if printer %}

  M117 level: 1
  {% endif %}
"""
SAVED = """#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
"""


def carriages(printer: dict, points: np.ndarray) -> np.ndarray:
    """Heights of the carriages as klippy/kinematics/delta.py has them, mm."""
    angles = np.radians(printer["angles"])
    towers = printer["radius"] * np.column_stack([np.cos(angles), np.sin(angles)])
    away = ((points[:, None, :2] - towers) ** 2).sum(axis=2)
    return points[:, 2:] + np.sqrt(printer.get("arm", ARM) ** 2 - away)


def stable(printer: dict, points: np.ndarray) -> np.ndarray:
    """Steps below the endstops (calc_stable_position of the same file)."""
    arm = printer.get("arm", ARM)
    stops = np.array(printer["stops"]) + math.sqrt(arm**2 - printer["radius"] ** 2)
    return (stops - carriages(printer, points)) / STEP


def probed() -> np.ndarray:
    """Nozzle where the probe of the printer as built meets the bed, mm."""
    around = np.radians(90 + 60 * np.arange(6))
    circle = np.column_stack([np.cos(around), np.sin(around)])
    distances = np.array([0.95, 0.9, 0.85, 0.7, 0.75, 0.8])[:, None] * 60
    points = np.vstack([np.zeros((1, 2)), distances * circle, 30 * circle])
    return np.hstack([points, np.full((len(points), 1), 0.3)])


def records(points: np.ndarray, prefix: str = "height") -> str:
    return "".join(
        f"#*# {prefix}{row} = {point[2]}\n"
        f"#*# {prefix}{row}_pos = {steps[0]:.3f},{steps[1]:.3f},{steps[2]:.3f}\n"
        for row, (point, steps) in enumerate(zip(points, stable(BUILT, points), strict=True))
    )


@pytest.fixture
def config(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        (tmp_path / "printer.cfg").write_text(text)
        return tmp_path / "printer.cfg"

    return write


@pytest.fixture
def printer(config: Callable[[str], Path]) -> Path:
    saved = "#*# [delta_calibrate]\n" + records(probed()) + "#*# distance0 = 65.1\n"
    return config(MAIN + SAVED + saved)


def test_a_printer_commands_its_carriages_as_klipper_does(printer: Path) -> None:
    mechanism = import_mechanism(printer).mechanism
    points = symkin.sample_workspace(mechanism, 100).poses
    # The joint limit is the endstop, at zero.
    assert (mechanism.joint_limits.upper, mechanism.reading_unit) == (0.0, "m")
    expected = -stable(DRAWN, points * 1e3) * STEP * 1e-3
    np.testing.assert_allclose(mechanism.inverse_kinematics(points), expected, atol=1e-15)


def test_probed_heights_lead_to_the_printer_as_it_was_built(printer: Path) -> None:
    found = import_mechanism(printer)
    assert found.measurements is not None
    np.testing.assert_allclose(found.measurements.heights, 3e-4)
    fit = symkin.identify(found.mechanism, found.measurements)
    assert fit.options.noise == "estimate"  # since nobody knows how well the probe repeats
    names = fit.mechanism.parameter_names
    values = fit.mechanism.parameters
    stops = np.array(BUILT["stops"]) + math.sqrt(ARM**2 - BUILT["radius"] ** 2)
    expected = {
        "base_radius": np.full(3, BUILT["radius"] * 1e-3),
        "base_azimuth": np.radians(BUILT["angles"]),
        "sensor_offset": stops * 1e-3,
    }
    # Klipper writes a thousandth of a step.
    for name, value in expected.items():
        np.testing.assert_allclose(values[:, names.index(name)], value, atol=2e-6)
    np.testing.assert_allclose(values[:, names.index("distal_length")], ARM * 1e-3)


def test_the_noise_is_estimated_where_enough_was_probed_to_tell_it(config: Callable) -> None:
    for count, noise in ((10, None), (11, "estimate")):
        text = MAIN + SAVED + "#*# [delta_calibrate]\n" + records(probed()[:count])
        settings = import_mechanism(config(text)).mechanism.identification
        assert settings is not None
        assert settings.noise == noise


def test_a_printed_length_goes_with_an_imported_printer(printer: Path) -> None:
    found = import_mechanism(printer)
    assert found.measurements is not None
    built = symkin.identify(found.mechanism, found.measurements).mechanism
    ends = np.array([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]])
    taken, _ = built.forward_kinematics(found.mechanism.inverse_kinematics(ends))
    piece = PrintedLength(0.1, float(np.linalg.norm(taken[1, :2] - taken[0, :2])))
    with_piece = with_printed_length(found.mechanism, found.measurements, piece)
    fit = symkin.identify(found.mechanism, with_piece, noise=found.mechanism.noise)
    assert fit.converged
    assert fit.chi_square_ratio < 0.01
    radius = fit.mechanism.parameter_names.index("base_radius")
    np.testing.assert_allclose(
        fit.mechanism.parameters[:, radius], BUILT["radius"] * 1e-3, atol=2e-6
    )


def test_what_klipper_is_given_comes_back(made: Callable, tmp_path: Path) -> None:
    robot = made("linear_delta")
    symkin.export(robot, "klipper", tmp_path / "printer.cfg", endstops=0.42)
    once = import_mechanism(tmp_path / "printer.cfg").mechanism
    again = symkin.export(once, "klipper")
    assert again.loss is not None
    assert again.loss.position_max < 1e-8
    numbers = r"^(?:angle|\w+_length|\w+_radius|\w+_endstop): (\S+)$"
    first, second = (
        [float(each) for each in re.findall(numbers, text, re.MULTILINE)]
        for text in ((tmp_path / "printer.cfg").read_text(), again.text)
    )
    assert len(first) == 10
    np.testing.assert_allclose(first, second, rtol=0, atol=2e-5)


def test_what_was_saved_and_entered_by_hand_counts_and_the_rest_is_said(
    config: Callable[[str], Path],
) -> None:
    saved = "#*# [printer]\n#*# delta_radius = 106.5\n#*#\n#*# [stepper_c]\n#*# arm_length = 216\n"
    saved += "#*#\n#*# [delta_calibrate]\n#*# distance0 = 65.1\n#*# distance1 = 65.2\n"
    by_hand = records(probed()[:2], "manual_height")
    found = import_mechanism(config(MAIN + SAVED + saved + by_hand + records(probed()[2:5])))
    names = found.mechanism.parameter_names
    radius = found.mechanism.parameters[:, names.index("base_radius")]
    np.testing.assert_allclose(radius, 0.1065)
    rods = found.mechanism.parameters[:, names.index("distal_length")]
    np.testing.assert_allclose(rods, [0.215, 0.215, 0.216])
    assert found.measurements is not None
    assert len(found.measurements.readings) == 5
    assert any(note.startswith("2 distances of printed objects are left") for note in found.notes)
    assert any("[include pins.cfg] was not read" in note for note in found.notes)


def distances(built: dict, ends: np.ndarray, error: float = 0.0) -> str:
    """What DELTA_ANALYZE keeps of distances between two nozzle positions each, mm."""
    steps = stable(built, ends.reshape(-1, 3)).reshape(-1, 2, 3)
    return "".join(
        f"#*# distance{k} = {np.linalg.norm(pair[1] - pair[0]) + error:.6f}\n"
        + "".join(
            f"#*# distance{k}_pos{end} = {row[0]:.3f},{row[1]:.3f},{row[2]:.3f}\n"
            for end, row in enumerate(of, 1)
        )
        for k, (pair, of) in enumerate(zip(ends, steps, strict=True))
    )


def test_distances_that_were_told_are_rows_in_pairs_and_show_the_rods_in_one_command(
    config: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    built = BUILT | {"arm": 216.3}
    around = np.radians(np.arange(6) * 60)
    rim = 60 * np.column_stack([np.cos(around), np.sin(around), np.zeros(6)]) + [0, 0, 0.3]
    ends = np.stack([np.tile([0.0, 0.0, 0.3], (6, 1)), rim], axis=1)
    heights = "".join(
        f"#*# height{row} = {0.3 + 0.02 * math.sin(9 * row)}\n"
        f"#*# height{row}_pos = {a:.3f},{b:.3f},{c:.3f}\n"
        for row, (a, b, c) in enumerate(stable(built, probed()).tolist())
    )
    told = heights + distances(built, ends, 0.01)
    file = config(MAIN + SAVED + "#*# [delta_calibrate]\n" + told)
    found = import_mechanism(file)
    assert found.measurements is not None
    assert found.measurements.separations is not None
    known = np.isfinite(found.measurements.separations[:, 0])
    np.testing.assert_allclose(found.measurements.separations[known, 0], 0.06001, atol=1e-8)
    assert np.flatnonzero(known).tolist() == [14, 15, 16, 17, 18, 19]  # from one pillar, row 13
    assert any("6 distances of printed objects are between two rows" in n for n in found.notes)
    out = tmp_path / "printer"
    assert main(["import", str(file), "--out", str(out)]) == 0
    files = [str(out / name) for name in ("mechanism.toml", "probed.csv")]
    assert main(["identify", *files, "--out", str(out / "calibrated")]) == 0
    piece = with_printed_length(found.mechanism, found.measurements, PrintedLength(0.1, 0.1001))
    assert piece.partners is not None
    assert piece.partners[-2:].tolist() == [[0], [0]]
    capsys.readouterr()
    robot = symkin.load_mechanism(out / "calibrated" / "calibrated.toml")
    rods = robot.parameters[:, robot.parameter_names.index("distal_length")]
    np.testing.assert_allclose(rods, 0.2163, atol=3e-4)
    radius = robot.parameters[:, robot.parameter_names.index("base_radius")]
    np.testing.assert_allclose(radius, BUILT["radius"] * 1e-3, atol=3e-4)


def test_distances_alone_are_rows_too_and_those_without_positions_are_left(
    config: Callable[[str], Path],
) -> None:
    ends = np.array([[[-30.0, 0.0, 0.2], [35.0, 0.0, 0.2]]])
    text = "#*# [delta_calibrate]\n" + distances(BUILT, ends) + "#*# distance1 = 60\n"
    found = import_mechanism(config(MAIN + SAVED + text))
    assert found.measurements is not None
    assert found.measurements.heights is None
    steps = stable(BUILT, ends[0])
    np.testing.assert_allclose(found.measurements.readings, -steps * STEP * 1e-3, atol=1e-8)
    assert found.measurements.partners is not None
    assert found.measurements.partners.tolist() == [[0], [1]]
    assert any(note.startswith("1 distances of printed objects are left") for note in found.notes)


def test_an_exported_printer_leaves_what_is_probed_to_the_user(made: Callable) -> None:
    assert (
        "delta_calibrate" not in symkin.export(made("linear_delta"), "klipper", endstops=0.42).text
    )


def test_a_printer_without_records_needs_no_motors(config: Callable[[str], Path]) -> None:
    text = re.sub(r"(rotation_distance|microsteps|gear_ratio).*\n", "", MAIN)
    assert import_mechanism(config(text)).measurements is None
    with pytest.raises(SymkinError, match=r"\[stepper_a\] rotation_distance: is missing"):
        import_mechanism(config(text + "[delta_calibrate]\nheight0: 0\nheight0_pos: 1,2,3\n"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("kinematics: delta", "kinematics: corexy", '[printer] kinematics: is "corexy"; symkin'),
        ("kinematics: delta", "", "[printer] kinematics: is missing ([include pins.cfg] was not"),
        ("delta_radius: 105.6", "delta_radius: wide", 'delta_radius: is "wide"; expected a number'),
        ("delta_radius: 105.6", "delta_radius: nan", 'delta_radius: is "nan"; expected a number'),
        ("delta_radius: 105.6", "delta_radius: -1", "is -1; expected more than 0"),
        ("arm_length: 215", "arm_length: 99", "arm_length: is 99; expected more than 105.6"),
        ("position_endstop: 212.7", "position_endstop: 1", "leave no room to print"),
        ("# a printer", "colour = red", "is not a printer.cfg"),
        ("3:2, 4:3", "3:2, 4", 'gear_ratio: is "4"; expected such as "80:16"'),
        ("3:2, 4:3", "3:0", 'gear_ratio: is "3:0"; expected'),
        ("height0_pos: 1,2,3", "height0_pos: 1,2", "height0_pos: has 2 numbers; expected 3"),
        ("height0_pos: 1,2,3", "", "height0_pos: is missing"),
    ],
)
def test_a_wrong_configuration_is_refused_at_its_option(
    config: Callable[[str], Path], old: str, new: str, words: str
) -> None:
    text = MAIN + "[delta_calibrate]\nheight0: 0\nheight0_pos: 1,2,3\n"
    assert old in text
    with pytest.raises(SymkinError, match=re.escape(words)):
        import_mechanism(config(text.replace(old, new)))


def test_a_file_without_a_printer_is_none(config: Callable[[str], Path]) -> None:
    with pytest.raises(SymkinError, match=r"is not a printer.cfg: has no \[printer\]"):
        import_mechanism(config("[1, 2]\n"))


CRANKED = {"radius": 90.0, "height": 360.0, "crank": 100.0, "rod": 320.0, "angles": (30, 150, 270)}
ENDSTOPS = (120.0, 119.2, 120.9)  # heights of the nozzle
STEP_RAD = 2 * math.pi / (200 * 16 * 107 / 16)


def nozzle_height(raised: float) -> float:
    """Height of a nozzle in the middle with all cranks raised so far, mm."""
    across = CRANKED["radius"] + CRANKED["crank"] * math.cos(raised)
    below = math.sqrt(CRANKED["rod"] ** 2 - across**2)
    return CRANKED["height"] + CRANKED["crank"] * math.sin(raised) - below


def raised_at(height: float) -> float:
    """The angle of a crank with the nozzle in the middle, by bisection."""
    low, high = -1.4, 1.4
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if nozzle_height(middle) < height else (low, middle)
    return low


def rotary_config(heights: int = 12) -> tuple[str, np.ndarray]:
    """A rotary delta that probed its bed where the readings of legs say."""
    stops = [raised_at(each) for each in ENDSTOPS]
    text = ["[printer]", "kinematics: rotary_delta", f"shoulder_radius: {CRANKED['radius']}",
            f"shoulder_height: {CRANKED['height']}"]  # fmt: skip
    for tower, stop in zip("abc", ENDSTOPS, strict=True):
        text += [f"[stepper_{tower}]", "gear_ratio: 107.000:16", "microsteps: 16",
                 f"position_endstop: {stop}", f"upper_arm_length: {CRANKED['crank']}",
                 f"lower_arm_length: {CRANKED['rod']}"]  # fmt: skip
    random = np.random.default_rng(1)
    places = random.uniform(-60, 60, (heights, 2))
    record, taken = ["[delta_calibrate]"], []
    for i, (x, y) in enumerate(places):
        steps = []
        for stop, degrees in zip(stops, CRANKED["angles"], strict=True):
            a = math.radians(degrees)
            along, aside = x * math.cos(a) + y * math.sin(a), -x * math.sin(a) + y * math.cos(a)
            best = min(  # the elbow is outwards
                np.linspace(-1.4, 1.4, 20001),
                key=lambda r: abs(
                    math.hypot(
                        CRANKED["radius"] + CRANKED["crank"] * math.cos(r) - along,
                        aside,
                        CRANKED["height"] + CRANKED["crank"] * math.sin(r),
                    )
                    - CRANKED["rod"]
                ),
            )
            steps.append((stop - best) / STEP_RAD)
        taken.append([x, y])
        record += [f"height{i}: 0.0", f"height{i}_pos: " + ",".join(f"{s:.3f}" for s in steps)]
    return "\n".join(text + record) + "\n", np.array(taken)


def test_a_rotary_delta_stands_where_its_steps_say(tmp_path: Path) -> None:
    text, places = rotary_config()
    (tmp_path / "printer.cfg").write_text(text, encoding="utf-8")
    found = import_mechanism(tmp_path / "printer.cfg")
    assert found.mechanism.chain == "[R]US"
    assert found.measurements is not None
    poses, reached = found.mechanism.forward_kinematics(found.measurements.readings)
    assert reached.all()
    assert poses[:, :2] == pytest.approx(places * 1e-3, abs=2e-5)
    assert np.abs(poses[:, 2]).max() < 2e-5  # on the bed
    said = symkin.identify(found.mechanism, found.measurements, noise=found.mechanism.noise)
    assert said.converged


def test_a_rotary_delta_that_cannot_reach_its_endstop_is_refused(tmp_path: Path) -> None:
    text = rotary_config(2)[0].replace("position_endstop: 120.0", "position_endstop: 900")
    (tmp_path / "printer.cfg").write_text(text, encoding="utf-8")
    with pytest.raises(SymkinError, match=r"stepper_a.*position_endstop.*do not reach"):
        import_mechanism(tmp_path / "printer.cfg")
