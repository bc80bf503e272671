# SPDX-License-Identifier: MIT
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from symkin.analysis.workspace import sample_workspace
from symkin.data.measurements import Measurements
from symkin.data.reading import read_measurements, write_measurements
from symkin.errors import MeasurementError, NotIdentifiableError
from symkin.estimate import identify
from symkin.model.mechanism import Mechanism
from symkin.model.settings import MeasurementColumns
from symkin.planning import make_plan
from symkin.planning.simulation import simulate

Write = Callable[..., Path]


@pytest.mark.parametrize("name", ["m.csv", "m.parquet"])
def test_measurements_read_back_to_the_same_numbers(
    tmp_path: Path, paper: Mechanism, measured: Measurements, name: str
) -> None:
    for sets in (np.repeat([0, 1, 2], 4), np.full(12, -1)):
        write_measurements(replace(measured, leg_sets=sets), tmp_path / name, paper, overwrite=True)
        read = read_measurements(tmp_path / name, paper)
        assert np.array_equal(read.poses, measured.poses)
        assert np.array_equal(read.readings, measured.readings)
        assert np.array_equal(read.leg_sets, sets)
        first = 2 if name.endswith("csv") else 1  # a CSV has its header above
        assert read.row_numbers.tolist() == list(range(first, first + 12))
        assert read.source == tmp_path / name


def test_simulated_rows_are_numbered_as_the_table_that_is_written(
    tmp_path: Path, paper: Mechanism
) -> None:
    plan = make_plan(paper, sample_workspace(paper, 60), 8, spares=4)
    simulated = simulate(paper, plan).measurements
    write_measurements(simulated, tmp_path / "m.csv", paper)
    read = read_measurements(tmp_path / "m.csv", paper)
    assert read.row_numbers.tolist() == simulated.row_numbers.tolist()


def test_spatial_poses_read_back_to_the_same_numbers(tmp_path: Path, hexapod: Mechanism) -> None:
    random = np.random.default_rng(1)
    quaternions = random.normal(size=(20, 4)) * [0.1, 0.1, 0.1, 0] + [0, 0, 0, 1]
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    positions = random.uniform([-0.1, -0.1, 0.6], [0.1, 0.1, 0.8], (20, 3))
    poses = np.hstack([positions, quaternions])
    measured = Measurements.of(poses, hexapod.inverse_kinematics(poses))
    write_measurements(measured, tmp_path / "m.csv", hexapod)
    read = read_measurements(tmp_path / "m.csv", hexapod)
    assert np.array_equal(read.poses, measured.poses)
    assert np.array_equal(read.readings, measured.readings)


def test_the_mapping_of_the_mechanism_file_reads_a_foreign_table(
    write: Write, hexapod: Mechanism
) -> None:
    # Two rows of Jugglebot's own table, cut to eight digits: too few poses to identify.
    rows = (
        "1.6767652,1.22339,1.2163502,1.8778893,1.9548622,1.8523405,"
        "5.6816964,-2.3655965,751.52844,0.072182291,-0.013575723,0.0060130821,0.99728094\n"
        "1.5469415,2.1703525,2.1010568,1.2076908,1.2095655,1.545841,"
        "8.4064875,3.5683901,751.11786,-0.091929952,0.036352644,0.0052026612,0.9950881\n"
    )
    legs = ",".join(f"leg_length_{leg}" for leg in range(1, 7))
    header = f"{legs},position_x,position_y,position_z," + ",".join(
        f"orientation_{axis}" for axis in "xyzw"
    )
    path = write(f"{header}\n{rows}", "poses.csv")
    assert len(read_measurements(path, hexapod).poses) == 2
    one_leg = path.read_text().replace("leg_length_1", "other")
    mapping = hexapod.measurement_columns
    assert mapping is not None
    read = read_measurements(write(one_leg, "one.csv"), hexapod, mapping)
    assert np.allclose(read.poses[0, :3], [5.6816964e-3, -2.3655965e-3, 0.75152844])
    assert np.allclose(np.linalg.norm(read.poses[:, 3:], axis=1), 1)
    assert np.isnan(read.readings[:, 0]).all()
    assert np.isclose(read.readings[0, 1], 1.22339 * 2 * math.pi)
    assert read.measured_legs == (1, 2, 3, 4, 5)


def test_a_column_mapping_given_in_code_wins(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    foreign = path.read_text().replace("x_m,y_m,phi_rad", "a,b,c").replace("psi_", "q")
    columns = MeasurementColumns(
        ("a", "b"), ("q1_rad", "q2_rad", "q3_rad"), angle="c",
        position_unit="m", orientation_unit="rad",
    )  # fmt: skip
    read = read_measurements(write(foreign, "foreign.csv"), paper, columns)
    assert np.array_equal(read.poses, measured.poses)
    assert np.array_equal(read.readings, measured.readings)
    with pytest.raises(MeasurementError, match="position of the column mapping has 1 columns"):
        read_measurements(path, paper, replace(columns, position=("a",)))


def test_extra_columns_are_ignored(write: Write, paper: Mechanism, measured: Measurements) -> None:
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    lines = path.read_text().splitlines()
    wider = "\n".join([f"note,{lines[0]}", *(f"taken on Monday,{line}" for line in lines[1:])])
    read = read_measurements(write(wider, "wider.csv"), paper)
    assert np.array_equal(read.readings, measured.readings)


def test_a_file_of_one_leg_leaves_the_others_unmeasured(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    text = path.read_text().replace("psi_1_rad", "a").replace("psi_3_rad", "b")
    read = read_measurements(write(text, "one.csv"), paper)
    assert read.measured_legs == (1,)
    assert np.isnan(read.readings[:, [0, 2]]).all()
    assert read.rows_of(1).tolist() == list(range(12))
    read.require(8)
    with pytest.raises(NotIdentifiableError, match=r"leg 2 has 12 .* its 13 parameters"):
        read.require(13)


def test_cells_of_legs_that_a_row_does_not_serve_may_be_empty(
    tmp_path: Path, paper: Mechanism, measured: Measurements
) -> None:
    sets = np.repeat([0, 1, 2], 12)
    readings = np.tile(measured.readings, (3, 1))
    own = np.arange(3) == sets[:, None]
    poses = np.tile(measured.poses, (3, 1))
    written = Measurements.of(poses, np.where(own, readings, np.nan), sets)
    path = tmp_path / "m.csv"
    write_measurements(written, path, paper, overwrite=True)
    read = read_measurements(path, paper)
    assert read.leg_sets.tolist() == sets.tolist()
    assert read.rows_of(1).tolist() == list(range(12, 24))


@pytest.mark.parametrize("sets", [np.full(12, -1), np.repeat([0, 1, 2], 4)])
def test_an_empty_cell_is_a_reading_that_was_not_taken(
    tmp_path: Path, paper: Mechanism, measured: Measurements, sets: np.ndarray
) -> None:
    readings = measured.readings.copy()
    readings[2, 0] = readings[7, 0] = readings[7, 1] = np.nan
    path = tmp_path / "m.csv"
    write_measurements(replace(measured, readings=readings, leg_sets=sets), path, paper)
    read = read_measurements(path, paper)
    assert np.array_equal(read.readings, readings, equal_nan=True)
    assert 2 not in read.rows_of(0)
    path.write_text(path.read_text().replace(f",{float(readings[7, 2])!r}\n", ",\n"))
    with pytest.raises(MeasurementError, match="row 9 has no reading of any leg"):
        read_measurements(path, paper)


def test_a_mapping_of_the_mechanism_goes_before_the_standard_names(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    header, *rows = path.read_text().splitlines()
    tracker = [f"{row},{row.split(',')[0]}" for row in rows]
    wider = write("\n".join([f"{header},tx_m", *tracker]) + "\n", "wider.csv")
    columns = MeasurementColumns(
        ("tx_m", "y_m"), tuple(f"psi_{leg}_rad" for leg in (1, 2, 3)), angle="phi_rad"
    )
    mapped = paper.replace(measurement_columns=columns)
    wrong_x = wider.read_text().replace("x_m", "commanded_x_m", 1)
    read = read_measurements(write(wrong_x, "mapped.csv"), mapped)
    assert np.array_equal(read.poses, measured.poses)
    shifted = "\n".join([f"{header},tx_m", *(f"{row},{k}" for k, row in enumerate(rows))]) + "\n"
    read = read_measurements(write(shifted, "shifted.csv"), mapped)
    assert read.poses[:, 0].tolist() == list(range(12))
    assert np.array_equal(read_measurements(path, mapped).poses, measured.poses)


def test_repeated_rows_are_refused_and_named(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    lines = path.read_text().splitlines()
    with pytest.raises(MeasurementError, match=r"row 14 repeats row 4 \(2 repeated rows in all\)"):
        read_measurements(write("\n".join(lines + lines[3:5]), "repeated.csv"), paper)


def test_fewer_poses_than_parameters_are_read_and_do_not_identify_a_leg(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    lines = path.read_text().splitlines()
    few = read_measurements(write("\n".join(lines[:8]), "few.csv"), paper)
    with pytest.raises(NotIdentifiableError, match="leg 1 has 7 measured poses; its 8 parameters"):
        identify(paper, few, "implicit")
    read_measurements(write("\n".join(lines[:9]), "enough.csv"), paper).require(8)


def test_a_leg_number_that_the_mechanism_does_not_have_is_refused(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    path = write("", "m.csv")
    write_measurements(replace(measured, leg_sets=np.full(12, 2)), path, paper, overwrite=True)
    text = path.read_text().replace("\n3,", "\n4,", 1)
    with pytest.raises(MeasurementError, match='row 2 has 4 in column "leg"'):
        read_measurements(write(text, "leg4.csv"), paper)


def test_arrays_of_unequal_length_are_refused(measured: Measurements) -> None:
    with pytest.raises(MeasurementError, match="11 readings for 12 poses"):
        replace(measured, readings=measured.readings[1:])
    with pytest.raises(MeasurementError, match="legs 0 to 2, or -1 for all"):
        replace(measured, leg_sets=np.full(12, 3))


def test_measurements_without_any_reading_identify_nothing(measured: Measurements) -> None:
    with pytest.raises(NotIdentifiableError, match="no leg has a measured pose"):
        replace(measured, readings=np.full((12, 3), np.nan)).require(8)
