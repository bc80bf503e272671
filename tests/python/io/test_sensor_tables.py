# SPDX-License-Identifier: MIT
"""Sensors that a calibration table makes straight, wherever a reading enters or leaves a file."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

import symkin
from symkin.cli import app
from symkin.data.sensor_tables import read_sensor_table
from symkin.errors import MeasurementError, MechanismError, MechanismFileError, SymkinError
from symkin.model.sensor_table import SensorTable
from symkin.planning.simulation import Simulation
from symkin.storage.tables import read_table

STEPS = 72
BENT = 0.01  # rad: an encoder that errs by half a degree, twice and three times a turn


def certificate(seed: int) -> tuple[tuple[float, float], ...]:
    """An encoder's certificate over one turn; the sensor lags behind the joint."""
    shown = np.linspace(0, 2 * math.pi, STEPS + 1)
    phase = np.random.default_rng(seed).uniform(0, 2 * math.pi, 2)
    error = BENT * (np.sin(2 * shown + phase[0]) + 0.5 * np.sin(3 * shown + phase[1]))
    return tuple(zip(shown.tolist(), (shown + error).tolist(), strict=True))


@pytest.fixture(scope="module")
def table() -> SensorTable:
    return SensorTable(tuple(certificate(leg) for leg in range(3)))


@pytest.fixture(scope="module")
def robot(table: SensorTable) -> symkin.Mechanism:
    return symkin.load_mechanism("3RRR").replace(sensor_table=table)


@pytest.fixture(scope="module")
def made(robot: symkin.Mechanism) -> Simulation:
    return symkin.simulate(robot, robot.plan(24, seed=2), seed=5)


def table_file(path: Path, table: SensorTable) -> Path:
    lines = ["leg,reading_deg,joint_deg"]
    lines += [
        f"{leg},{math.degrees(a)!r},{math.degrees(b)!r}"
        for leg, rows in enumerate(table.legs, 1)
        for a, b in rows
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


# The curve.


@given(
    st.lists(st.floats(0.01, 10), min_size=1, max_size=12),
    st.lists(st.floats(0.01, 10), min_size=12, max_size=12),
    st.sampled_from([1, -1]),
    st.lists(st.floats(0, 1), min_size=5, max_size=5),
)
def test_the_way_back_through_any_table_is_the_way_there(steps, rises, sign, shares):
    x = np.cumsum([0, *steps])
    y = sign * np.cumsum([0, *rises[: len(steps)]])
    table = SensorTable((tuple(zip(x.tolist(), y.tolist(), strict=True)),))
    shown = x[-1] * np.array(shares)[:, None]
    straight = table.straight(shown)
    assert table.shown(straight) == pytest.approx(shown, abs=1e-9 * x[-1])
    assert (np.sign(table.slope(shown)) == sign).all()
    assert table.straight(x[:, None])[:, 0] == pytest.approx(y)


def test_between_its_rows_a_table_follows_a_smooth_curve_to_third_order():
    def error(count: int) -> float:
        x = np.linspace(0, 1, count)
        table = SensorTable((tuple(zip(x.tolist(), np.sinh(x).tolist(), strict=True)),))
        between = np.linspace(0.2, 0.8, 501)
        return float(np.abs(table.straight(between[:, None])[:, 0] - np.sinh(between)).max())

    assert error(41) < error(21) / 6


def test_a_table_of_a_whole_turn_goes_on(table):
    shown = np.array([[0.3, 1.0, 6.0]])
    for turns in (-2, -1, 1, 5):
        turn = turns * 2 * math.pi
        assert table.straight(shown + turn) == pytest.approx(table.straight(shown) + turn)
        assert table.shown(shown + turn) == pytest.approx(table.shown(shown) + turn)
    around = np.array([[-1e-7] * 3, [1e-7] * 3])
    assert np.diff(table.slope(around), axis=0) == pytest.approx(0, abs=1e-5)


def test_a_table_that_is_no_turn_ends():
    table = SensorTable((((0, 0), (1, 1.1), (2, 2)),))
    assert np.isnan(table.straight([[-0.1], [2.1]])).all()
    assert table.straight([[2.0], [np.nan]]).ravel() == pytest.approx([2, np.nan], nan_ok=True)


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (((0, 0),), "leg 1: row 1 is alone; expected at least 2 rows"),
        (((0, 0), (1, 1), (1, 2)), "row 3 repeats the reading 1"),
        (((0, 0), (1, 2), (2, 1.5), (3, 4)), "row 3 has 1.5 at the reading 2, after 2 at 1"),
        (((0, 4), (1, 5), (2, 1)), "row 2 has 5 .* expected values that fall throughout"),
        (((0, 0), (1, math.nan)), "row 2 is .* expected two finite numbers"),
    ],
)
def test_a_wrong_table_is_refused_with_its_row(rows, told):
    with pytest.raises(MechanismError, match=told):
        SensorTable((rows,))


def test_a_table_of_another_number_of_legs_is_refused(table):
    with pytest.raises(MechanismError, match="has 3 legs; expected 2, or one for all"):
        symkin.load_mechanism("5bar").replace(sensor_table=table)


# What it is for.


def test_with_the_table_a_bent_sensor_is_as_good_as_a_straight_one(robot, made, tmp_path):
    symkin.data.reading.write_measurements(made.measurements, tmp_path / "m.csv", robot)
    straight = robot.replace(sensor_table=None)
    alike = dataclasses.replace(made.measurements, sensor_table=None)
    best = symkin.identify(straight, alike)
    found = symkin.identify(robot, symkin.read_measurements(tmp_path / "m.csv", robot))
    assert not found.doubts
    assert found.mechanism.parameters == pytest.approx(best.mechanism.parameters, abs=1e-9)
    assert found.after.closure_rms[0] == pytest.approx(best.after.closure_rms[0], rel=1e-6)

    without = symkin.identify(straight, symkin.read_measurements(tmp_path / "m.csv", straight))
    assert any("sensor" in each.options for each in without.doubts)
    assert without.after.closure_rms[0] > 3 * found.after.closure_rms[0]


def test_measurements_that_did_not_go_through_the_table_are_refused(robot, made):
    loose = dataclasses.replace(made.measurements, sensor_table=None)
    for use in (
        lambda: symkin.identify(robot, loose),
        lambda: symkin.evaluate(robot, measurements=loose),
    ):
        with pytest.raises(MeasurementError, match="did not go through the sensor table"):
            use()


# Files.


def test_what_is_written_is_what_the_sensors_show_and_reads_back(robot, made, tmp_path):
    path = tmp_path / "m.csv"
    symkin.data.reading.write_measurements(made.measurements, path, robot)
    written = read_table(path)
    shown = np.column_stack([written.numbers(f"psi_{leg}_rad") for leg in (1, 2, 3)])
    away = robot.sensor_table.straight(shown) - made.measurements.readings
    assert np.abs(away).max() < 1e-9
    assert np.abs(shown - made.measurements.readings).max() > BENT / 2
    again = symkin.read_measurements(path, robot)
    assert again.readings == pytest.approx(made.measurements.readings, abs=1e-9)
    made.measurements.save(tmp_path / "saved.csv")
    assert (tmp_path / "saved.csv").read_bytes() == path.read_bytes()


def test_deviations_of_readings_go_through_the_slope(robot, made, tmp_path):
    own = np.full_like(made.measurements.readings, 1e-4)
    own[:, 1] = np.nan
    taken = dataclasses.replace(made.measurements, reading_deviations=own)
    taken.save(tmp_path / "m.csv")
    shown = read_table(tmp_path / "m.csv").numbers("psi_1_rad")
    written = read_table(tmp_path / "m.csv").numbers("psi_1_sd_rad")
    slopes = robot.sensor_table.slope(np.repeat(shown[:, None], 3, axis=1))[:, 0]
    assert written * slopes == pytest.approx(1e-4)
    assert np.ptp(slopes) > BENT
    again = symkin.read_measurements(tmp_path / "m.csv", robot)
    assert again.reading_deviations == pytest.approx(own, nan_ok=True)


def test_a_plan_commands_what_the_sensors_show(robot, tmp_path):
    plan = robot.plan(10, seed=4)
    plan.save(tmp_path / "plan.csv")
    commanded = read_table(tmp_path / "plan.csv").numbers("psi_2_rad")
    assert np.abs(commanded - plan.readings[:, 1]).max() > BENT / 4
    again = symkin.read_plan(tmp_path / "plan.csv", robot)
    assert again.readings == pytest.approx(plan.readings, abs=1e-9)


def test_the_table_is_part_of_a_mechanisms_file(robot, made, tmp_path):
    found = symkin.identify(robot, made.measurements)
    found.write(tmp_path / "out")
    read = symkin.load_mechanism(tmp_path / "out" / "calibrated.toml")
    assert read == found.mechanism
    assert read.sensor_table == robot.sensor_table
    one = robot.replace(sensor_table=SensorTable((certificate(1),)))
    one.save(tmp_path / "one.toml")
    assert symkin.load_mechanism(tmp_path / "one.toml") == one


def test_a_file_beside_the_mechanisms_file_is_found(table, tmp_path, monkeypatch):
    table_file(tmp_path / "encoders.csv", table)
    file = tmp_path / "robot.toml"
    symkin.load_mechanism("3RRR").save(file)
    file.write_text(file.read_text() + '\n[sensor_table]\nfile = "encoders.csv"\n')
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    read = symkin.load_mechanism(file).sensor_table
    assert read is not None
    assert np.array(read.legs) == pytest.approx(np.array(table.legs))
    assert read.straight([[9.0, 9.0, 9.0]]) == pytest.approx(table.straight([[9.0, 9.0, 9.0]]))


def test_steps_are_counted_in_the_table_too():
    columns = {"reading_step": [0, 80, 160], "joint_mm": [0.0, 1.01, 2.0]}
    read = read_sensor_table(columns, legs=3, reading_unit="m", step="1/80 mm/step")
    assert np.array(read.legs[0]) == pytest.approx(
        np.array([(0, 0), (1e-3, 1.01e-3), (2e-3, 2e-3)])
    )


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("reading_deg,joint_deg\n0,0\n", r"t.csv: row 2 is alone; expected at least 2 rows"),
        (
            "reading_deg,joint_deg\n0,0\n10,9\n20,8\n30,30\n",
            r"t.csv: row 4 has 0.139\d* at the reading 0.349\d*, after .* grow throughout \(rad\)",
        ),
        ("reading_deg,joint_deg\n0,0\n10,9\n10,9.5\n", "t.csv: row 4 repeats the reading"),
        ("reading_deg,joint_deg\n0,0\n10,\n", 't.csv: row 3 is empty in column "joint_deg"'),
        ("reading_mm,joint_deg\n0,0\n1,1\n", 'column "reading_mm" .* expected an angle'),
        ("reading_deg,truth_deg\n0,0\n1,1\n", 'column "joint_rad" .* is missing'),
        ("leg,reading_deg,joint_deg\n1,0,0\n1,1,1\n3,0,0\n3,1,1\n", "no rows of leg 2"),
        (
            "leg,reading_deg,joint_deg\n4,0,0\n4,1,1\n",
            "has 4 in column .leg., and .* expected .* 1 to 3",
        ),
        (None, "t.csv: no such file"),
    ],
)
def test_a_wrong_file_is_refused_with_file_and_row(lines, told, tmp_path):
    file = tmp_path / "robot.toml"
    symkin.load_mechanism("3RRR").save(file)
    text = file.read_text() + '\n[sensor_table]\nfile = "t.csv"\n'
    file.write_text(text)
    if lines is not None:
        (tmp_path / "t.csv").write_text(lines)
    line = text.splitlines().index('file = "t.csv"') + 1
    with pytest.raises(MechanismFileError, match=told) as refused:
        symkin.load_mechanism(file)
    assert f"{file}:{line}" in str(refused.value)


@pytest.mark.parametrize(
    ("section", "told"),
    [
        ("", "has no key; expected one of file, rows and legs"),
        ('file = "t.csv"\nrows = [[0, 0], [1, 1]]', "has file and rows; expected one of"),
        ("rows = [[0, 0], [1, 1], [0.5, 2]]", "row 2 has 1 at the reading 1, after 2"),
        ("rows = [[0, 0]]", "has 1 items; expected 2 to 10000"),
        ('rows = [[0, 0], ["1 mm", 1]]', "expected an angle"),
        ("legs = [[[0, 0], [1, 1]], [[0, 0], [1, 1]]]", "has 2 legs; expected 3, or one for all"),
    ],
)
def test_a_wrong_section_is_refused(section, told, tmp_path):
    file = tmp_path / "robot.toml"
    symkin.load_mechanism("3RRR").save(file)
    file.write_text(f"{file.read_text()}\n[sensor_table]\n{section}\n")
    with pytest.raises(MechanismFileError, match=told):
        symkin.load_mechanism(file)


def test_a_reading_beyond_the_table_is_refused_with_its_row_and_column(made, tmp_path):
    short = SensorTable((((-0.1, -0.1), (0, 0.01), (0.1, 0.1)),))
    robot = symkin.load_mechanism("3RRR").replace(sensor_table=short)
    columns = {"x_m": [0.0, 0.1], "y_m": [0.0, 0.1], "phi_rad": [0.0, 0.1]}
    columns |= {f"psi_{leg}_deg": [3.0, 4.0] for leg in (1, 2, 3)} | {"psi_2_deg": [3.0, 90.0]}
    with pytest.raises(MeasurementError, match=r"row 2 .* 1.5708 rad .* goes from -0.1 to 0.1 rad"):
        symkin.read_measurements(columns, robot)
    with pytest.raises(MeasurementError, match=r"row .*: the table of the sensors has nothing"):
        dataclasses.replace(made.measurements, sensor_table=short).columns()
    with pytest.raises(MeasurementError, match="set joint_limits within the table"):
        robot.plan(10, seed=4).save(tmp_path / "plan.csv")


def test_an_encoder_that_counts_from_0_to_360_degrees_shows_negative_angles_a_turn_further():
    nearly = SensorTable((tuple((a, b + 1e-3 * a) for a, b in certificate(1)),))
    assert nearly.span(0) is not None  # so that nothing goes on by itself
    robot = symkin.load_mechanism("3RRR").replace(sensor_table=nearly)
    sample = symkin.sample_workspace(robot, 50, seed=1)
    assert (sample.readings < 0).any()
    assert np.isfinite(sample.shown).all()
    assert (sample.shown >= 0).all()
    turns = (nearly.straight(sample.shown) - sample.readings) / (2 * math.pi)
    assert turns == pytest.approx(np.round(turns), abs=1e-9)


def test_no_controller_gets_a_table_that_its_format_has_not(robot):
    with pytest.raises(SymkinError, match="made straight by a table, which no format has"):
        symkin.export(robot, "json")


# The command line.


def test_the_commands_take_a_table(robot, table, made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made.measurements.save("m.csv")
    table_file(tmp_path / "encoders.csv", table)
    run = CliRunner().invoke

    identify = ["identify", "3RRR", "m.csv", "--sensor-table", "encoders.csv", "--out", "found"]
    result = run(app, identify)
    assert result.exit_code == 0, result.output
    found = symkin.load_mechanism("found/calibrated.toml")
    best = symkin.identify(robot, made.measurements).mechanism
    assert found.parameters == pytest.approx(best.parameters, abs=1e-8)

    result = run(app, ["evaluate", "found/calibrated.toml", "--measurements", "m.csv"])
    assert result.exit_code == 0, result.output
    # Poses through the table to readings, and back.
    result = run(app, ["kinematics", "found/calibrated.toml", "m.csv", "--out", "there"])
    assert result.exit_code == 0, result.output
    result = run(
        app, ["kinematics", "found/calibrated.toml", "there/readings.csv", "--forward", "--json"]
    )
    assert result.exit_code == 0, result.output
    commanded, measured = read_table("there/readings.csv"), read_table("m.csv")
    assert np.abs(commanded.numbers("psi_1_rad") - measured.numbers("psi_1_rad")).max() < 2e-3
    result = run(app, ["identify", "3RRR", "m.csv", "--sensor-table", "nowhere.csv"])
    assert str(result.exception) == "nowhere.csv: no such file"
