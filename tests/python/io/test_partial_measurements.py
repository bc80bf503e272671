# SPDX-License-Identifier: MIT
from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from symkin.data.measurements import Measurements
from symkin.data.reading import read_measurements, write_measurements
from symkin.data.writing import measurement_columns
from symkin.errors import MeasurementError, MechanismFileError, NotIdentifiableError
from symkin.files.mechanism_file import load_columns
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.settings import MeasurementColumns, NoiseSettings
from symkin.robot import load_mechanism

Write = Callable[..., Path]
ROWS = 12


@functools.cache
def mechanism(name: str) -> Mechanism:
    return load_mechanism(Path(__file__).parents[3] / "mechanisms" / f"{name}.toml")


@functools.cache
def exact(name: str) -> Measurements:
    """Full poses in the workspace, and the readings there."""
    made = mechanism(name)
    poses = made.sample_workspace(ROWS, seed=1).poses
    return Measurements.of(poses, made.inverse_kinematics(poses), reading_unit=made.reading_unit)


@st.composite
def observed(draw: st.DrawFn) -> tuple[Mechanism, Measurements]:
    """Any mixture of observations of a mechanism of each kind, with holes."""
    name = draw(st.sampled_from(["3RRR", "5bar", "hexapod_jugglebot"]))
    made, full = mechanism(name), exact(name)
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    size = 3 if made.pose_space == "spatial" else 2
    dof = made.core.dof

    def holes(values: Any) -> np.ndarray:
        values = np.array(values, dtype=float)
        values[random.random(values.shape) < draw(st.sampled_from([0.0, 0.3, 1.0]))] = np.nan
        return values

    poses = holes(full.poses)
    if size == 3:
        poses[np.isnan(poses[:, 3]), 3:] = np.nan
        poses[:, 3:] = np.where(np.isnan(poses[:, 3:4]), np.nan, full.poses[:, 3:])
    readings = holes(full.readings)
    readings[:, 0] = full.readings[:, 0]  # each row has one
    shapes = {
        "pose_deviations": (ROWS, dof),
        "reading_deviations": (ROWS, len(made.legs)),
        "points": (ROWS, 2, size),
        "distances": (ROWS, 3),
        "reported": full.poses.shape,
    }
    if size == 3:
        shapes["heights"] = (ROWS,)
    chosen = {k: v for k, v in shapes.items() if draw(st.booleans())}
    others = {k: holes(np.abs(random.normal(size=shape))) for k, shape in chosen.items()}
    for name in ("points", "distances", "heights"):
        if name in others and draw(st.booleans()):
            others[f"{name[:-1]}_deviations"] = holes(np.abs(random.normal(size=chosen[name])))
    if "reported" in others:
        others["reported"] = full.poses[random.permutation(ROWS)]
        if draw(st.booleans()):
            others["reported_deviations"] = holes(np.abs(random.normal(size=(ROWS, dof))))
    partial = replace(full, poses=poses, readings=readings, **others)
    return made, partial


def is_anything_observed(data: Measurements) -> bool:
    names = ("poses", "reported", "points", "distances", "heights")
    values = [getattr(data, name) for name in names]
    return any(each is not None and np.isfinite(each).any() for each in values)


@settings(max_examples=60, deadline=None)
@given(observed())
def test_what_was_written_reads_back_to_the_same_measurements(
    case: tuple[Mechanism, Measurements],
) -> None:
    made, data = case
    columns = measurement_columns(data, made.reading_unit)
    text = ",".join(columns) + "\n"
    rows = zip(*(each.tolist() for each in columns.values()), strict=True)
    text += "\n".join(",".join("" if v != v else repr(v) for v in row) for row in rows)
    if not is_anything_observed(data):
        with pytest.raises(MeasurementError, match=r"no pose was measured|is missing"):
            read_measurements(StringIO(text), made)
        return
    for source in (StringIO(text), columns):
        read = read_measurements(source, made)
        assert replace(read, row_numbers=data.row_numbers) == data


@pytest.mark.parametrize("name", ["m.csv", "m.parquet", "m.csv.gz"])
def test_a_file_of_partial_measurements_reads_back(tmp_path: Path, name: str) -> None:
    made, full = mechanism("hexapod_jugglebot"), exact("hexapod_jugglebot")
    poses = full.poses.copy()
    poses[:, 3:] = np.nan
    poses[3] = np.nan
    heights = np.where(np.arange(ROWS) % 2, 0.0, np.nan)
    data = replace(full, poses=poses, heights=heights, height_deviations=heights + 1e-4)
    write_measurements(data, tmp_path / name, made)
    read = read_measurements(tmp_path / name, made)
    assert replace(read, row_numbers=data.row_numbers, source=None) == data


def lines(**columns: Any) -> dict[str, Any]:
    """The exact columns of the planar robot, changed: None takes one out."""
    made = {**measurement_columns(exact("3RRR"), "rad"), **columns}
    return {name: each for name, each in made.items() if each is not None}


def test_positions_alone_are_read_and_refused_by_the_legs_own_estimators() -> None:
    made = mechanism("3RRR")
    read = read_measurements(lines(phi_rad=None), made)
    assert np.isnan(read.poses[:, 2]).all()
    assert np.array_equal(read.poses[:, :2], exact("3RRR").poses[:, :2])
    assert not read.complete
    assert read.incomplete_because == "row 1 has no measured phi"
    with pytest.raises(NotIdentifiableError, match=r"row 1 has no measured phi; .* full poses"):
        read.require_complete()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x_m": [*[0.1] * 11, np.nan]}, "row 12 has no measured x"),
        ({"height_m": 1.0}, ""),  # of a planar robot: a further column, which is not read
        ({"distance_1_m": [np.nan, *[1.0] * 11]}, "row 2 has more than a pose .*: distances"),
        ({"reported_time_s": 1.0}, ""),
        ({"p1_x_m": 1.0}, "row 1 has more than a pose and readings: points"),
        ({"reported_x_m": 1.0}, "row 1 has more than a pose and readings: reported"),
        ({"x_sd_m": [*[np.nan] * 11, 0.1]}, "row 12 has standard deviations of its own"),
        ({"psi_2_sd_deg": 1.0}, "row 1 has standard deviations of its own"),
        ({"distance_1_m": np.nan, "x_sd_m": np.nan}, ""),
    ],
)
def test_the_reason_why_measurements_are_not_complete_names_the_row(
    change: dict[str, Any], words: str
) -> None:
    columns = {name: np.broadcast_to(value, ROWS) for name, value in change.items()}
    read = read_measurements(lines(**columns), mechanism("3RRR"))
    assert read.complete == (not words)
    if words:
        with pytest.raises(NotIdentifiableError, match=words):
            read.require_complete()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x_sd_m": -1e-3}, 'row 1 has -0.001 in column "x_sd_m"; expected 0 or more'),
        ({"x_sd_rad": 1e-3}, '"1 rad" is an angle; expected a length'),
        ({"distance_2_m": 1.0}, 'column "distance_2_m" has number 2; expected 1 to 1'),
        ({"p0_x_m": 1.0}, 'column "p0_x_m" has number 0; expected 1 to 1'),
        ({"distance_1_sd_m": 1.0}, "standard deviation, but there is no column of distance_1"),
        ({"phi_sd_rad": 1.0, "phi_rad": None}, "but there is no column of phi"),
        ({"reported_phi_sd_rad": 1.0}, "but there is no column of reported_phi"),
        ({"distance_1_m": 1.0, "distance_1_mm": 1.0}, "both hold distance_1"),
        ({"phi_rad": None, "Phii_rad": 1.0}, 'column "phi_rad" .* did you mean "Phii_rad"'),
        ({"x_m": None, "y_m": None, "phi_rad": None}, 'column "x_m" .position. is missing'),
        ({"x_m": np.nan, "y_m": np.nan, "phi_rad": np.nan}, "no pose was measured"),
        ({"p1_x_m": np.inf}, "expected a finite number"),
    ],
)
def test_columns_that_cannot_be_meant_are_refused_by_name(
    change: dict[str, Any], words: str
) -> None:
    columns = {
        name: None if value is None else np.broadcast_to(value, ROWS)
        for name, value in change.items()
    }
    with pytest.raises(MeasurementError, match=words):
        read_measurements(lines(**columns), mechanism("3RRR"))


def test_a_quaternion_is_measured_as_a_whole() -> None:
    made = mechanism("hexapod_jugglebot")
    columns = measurement_columns(exact("hexapod_jugglebot"), made.reading_unit)
    columns["qy"] = columns["qy"].copy()
    columns["qy"][4] = np.nan
    with pytest.raises(MeasurementError, match="row 5 has an empty cell in one of qx, qy, qz, qw"):
        read_measurements(columns, made)
    del columns["qy"]
    with pytest.raises(MeasurementError, match='column "qy"'):
        read_measurements(columns, made)
    poses = exact("hexapod_jugglebot").poses.copy()
    poses[2, 5] = np.nan
    with pytest.raises(MeasurementError, match="row 3 has a part of a quaternion"):
        Measurements.of(poses, np.zeros((ROWS, 6)))
    turned = np.tile([np.nan, 0.0, 0.0, 1.0], (2, 1))
    with pytest.raises(MeasurementError, match="row 1 has a part of a quaternion"):
        Measurements.of(turned, np.zeros((2, 3)), pose_space="spherical")


def test_readings_alone_serve_a_mechanism_with_more_legs_than_degrees_of_freedom() -> None:
    made = mechanism("3RRR")
    leg = replace(made.legs[0], parameters={**made.legs[0].parameters, "base_angle": 0.3})
    redundant = made.replace(legs=[*made.legs, Leg(leg.chain, leg.parameters)], symmetry=None)
    readings = np.random.default_rng(1).normal(size=(ROWS, 4))
    columns = {f"psi_{k + 1}_rad": readings[:, k] for k in range(4)}
    read = read_measurements(columns, redundant)
    assert np.isnan(read.poses).all()
    assert read.poses.shape == (ROWS, 3)
    assert read.incomplete_because == "no pose was measured"


MAPPING = """\
[measurements]
position = ["tx", "", "tz"]
position_unit = "mm"
readings = ["m1", "m2", "m3", "m4", "m5", "m6"]
reading_unit = "rev"
names = { height_mm = "probe", x_sd_um = "tx error" }
"""


def test_a_mapping_names_what_was_observed_in_a_foreign_table(write: Write) -> None:
    made, full = mechanism("hexapod_jugglebot"), exact("hexapod_jugglebot")
    mapping = load_columns(write(MAPPING))
    assert mapping.names == {"height_mm": "probe", "x_sd_um": "tx error"}
    columns = {f"m{k + 1}": full.readings[:, k] / (2 * np.pi) for k in range(6)}
    columns |= {"tx": full.poses[:, 0] * 1e3, "tz": full.poses[:, 2] * 1e3}
    columns |= {"probe": np.full(ROWS, 2.0), "tx error": np.full(ROWS, 50.0)}
    columns |= {"distance_1_m": np.ones(ROWS)}  # the mapping does not name it
    read = read_measurements(columns, made, mapping)
    assert read.heights == pytest.approx(np.full(ROWS, 2e-3))
    assert read.pose_deviations is not None
    assert read.pose_deviations[:, 0] == pytest.approx(np.full(ROWS, 5e-5))
    assert read.distances is None
    assert np.isnan(read.poses[:, 1]).all()
    assert np.isnan(read.poses[:, 3:]).all()
    assert read.poses[:, 2] == pytest.approx(full.poses[:, 2])
    del columns["probe"]
    with pytest.raises(MeasurementError, match=r'column "probe" \(height_mm\) is missing'):
        read_measurements(columns, made, mapping)
    wrong = replace(mapping, names={"hight_mm": "tx"})
    with pytest.raises(MeasurementError, match='"hight_mm"; did you mean "height_m"'):
        read_measurements(columns, made, wrong)


@pytest.mark.parametrize(
    ("values", "scale", "words"),
    [
        ("readings", 180 / np.pi, r"readings .* stated in rad but fit in deg"),
        ("positions", 1e3, r"positions .* stated in m but fit in mm"),
        ("nothing", 1.0, ""),
        ("frame", 1.0, ""),
    ],
)
def test_wrong_units_of_positions_without_orientation_are_found(
    values: str, scale: float, words: str
) -> None:
    columns = lines(phi_rad=None)
    chosen = {"readings": "psi", "positions": ("x", "y")}.get(values, "none")
    columns = {k: v * scale if k.startswith(chosen) else v for k, v in columns.items()}
    if values == "frame":  # that of a tracker, 30 m away and turned
        columns["x_m"], columns["y_m"] = 30 - columns["y_m"], 20 + columns["x_m"]
    if words:
        with pytest.raises(MeasurementError, match=words):
            read_measurements(columns, mechanism("3RRR"))
    else:
        assert len(read_measurements(columns, mechanism("3RRR")).poses) == ROWS


def sliding(reading_unit: str) -> str:
    """The file of a robot with sliding joints and this unit of its readings."""
    file = Path(__file__).parents[3] / "mechanisms" / "3RPR.toml"
    first, rest = file.read_text(encoding="utf-8").split("schema = 1", 1)
    return f'{first}schema = 1\nreading_unit = "{reading_unit}"{rest}'


def test_readings_may_be_counted_in_steps(write: Write, tmp_path: Path) -> None:
    made = load_mechanism(write(sliding("1/80 mm/step")))
    assert (made.reading_unit, made.reading_step) == ("m", pytest.approx(1.25e-5, rel=1e-15))
    poses = made.sample_workspace(ROWS, seed=1).poses
    steps = np.round(made.inverse_kinematics(poses) / 1.25e-5)
    columns = dict(zip(("x_m", "y_m", "phi_rad"), poses.T, strict=True))
    for unit in ("step", "count"):
        counted = {f"psi_{k + 1}_{unit}": steps[:, k] for k in range(3)}
        counted[f"psi_2_sd_{unit}"] = np.full(ROWS, 0.5)
        read = read_measurements(columns | counted, made)
        assert np.allclose(read.readings, steps * 1.25e-5, rtol=1e-15)
        assert read.reading_deviations is not None
        assert np.allclose(read.reading_deviations[:, 1], 0.625e-5)
    made.save(tmp_path / "again.toml")
    assert load_mechanism(tmp_path / "again.toml") == made

    del counted["psi_2_sd_count"]
    plain = load_mechanism(write(sliding("m")))
    with pytest.raises(MeasurementError, match='"psi_1_count" counts steps of unknown size'):
        read_measurements(columns | counted, plain)
    mapping = MeasurementColumns(
        ("x_m", "y_m"), tuple(counted), "phi_rad", reading_unit="0.0125 mm/step"
    )
    assert read_measurements(columns | counted, plain, mapping) == replace(
        read, reading_deviations=None
    )
    wrong = replace(mapping, reading_unit="0.1 mm/step")
    with pytest.raises(MeasurementError, match=r"stated in 0\.1 mm/step but fit in"):
        read_measurements(columns | {k: v * 1.25e-5 for k, v in counted.items()}, plain, wrong)


@pytest.mark.parametrize(
    ("unit", "words"),
    [
        ("80 step/mm", 'expected a length per step such as "1/80 mm/step"'),
        ("-1/80 mm/step", "expected a positive size of a step"),
        ("-1.8 deg/step", "expected a positive size of a step"),
        ("mm", "or the size of a step such as '1/80 mm/step'"),
        ("1/80 mm/stp", "or the size of a step"),
    ],
)
def test_a_step_of_no_size_is_refused(unit: str, words: str, write: Write) -> None:
    with pytest.raises(MechanismFileError, match=f"reading_unit: .*{words}"):
        load_mechanism(write(sliding(unit)))


def test_observations_take_the_noise_where_a_row_has_no_deviation_of_its_own() -> None:
    full = exact("hexapod_jugglebot")
    deviations = np.full((ROWS, 6), np.nan)
    deviations[2, 4] = 0.5
    data = replace(full, pose_deviations=deviations, points=np.ones((ROWS, 2, 3)))
    noise = NoiseSettings(position=1e-3, orientation=2e-3, reading=3e-3)
    found = data.standard_deviations(noise)
    expected = np.tile([1e-3] * 3 + [2e-3] * 3, (ROWS, 1))
    expected[2, 4] = 0.5
    assert np.array_equal(found["poses"], expected)
    assert np.array_equal(found["readings"], np.full((ROWS, 6), 3e-3))
    assert np.array_equal(found["points"], np.full((ROWS, 2, 3), 1e-3))
    assert set(found) == {"poses", "readings", "points"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"heights": np.zeros(ROWS)}, "expected none, since the robot is planar"),
        ({"heights": np.zeros((ROWS, 1))}, "heights have shape"),
        ({"points": np.zeros((ROWS, 1, 3))}, r"expected \(N, n, 2\)"),
        ({"reported": np.zeros((ROWS, 2))}, "expected \\(12, 3\\)"),
        ({"distances": np.zeros((3, 1))}, "3 distances for 12 poses"),
        ({"distances": np.full((ROWS, 1), np.inf)}, "row 1 has an infinite value in distances"),
        ({"distance_deviations": np.ones((ROWS, 1))}, "without distances"),
        ({"pose_deviations": np.ones((ROWS, 2))}, r"expected \(12, 3\)"),
        ({"reading_deviations": -np.ones((ROWS, 3))}, "row 1 has a negative or infinite value"),
    ],
)
def test_arrays_of_observations_that_do_not_fit_are_refused(
    change: dict[str, Any], words: str
) -> None:
    with pytest.raises(MeasurementError, match=words):
        replace(exact("3RRR"), **change)


def test_a_subset_keeps_what_was_observed_of_its_rows() -> None:
    data = replace(exact("3RRR"), distances=np.arange(ROWS)[:, None], distance_deviations=None)
    rows = np.array([3, 1])
    assert data.subset(rows).distances.tolist() == [[3.0], [1.0]]
    assert data.subset(rows).for_all_legs().points is None


def test_a_mapping_without_names_reads_poses_and_readings_alone() -> None:
    columns = lines(distance_1_m=np.ones(ROWS))
    mapping = MeasurementColumns(
        ("x_m", "y_m"), tuple(f"psi_{k}_rad" for k in (1, 2, 3)), angle="phi_rad"
    )
    assert read_measurements(columns, mechanism("3RRR"), mapping).complete


def test_many_tables_that_are_looked_through_at_once_know_what_each_says_by_itself() -> None:
    whole = exact("3RRR")
    gap = whole.poses.copy()
    gap[-1, 2] = np.nan
    changes: list[dict[str, Any]] = [
        {},
        {"poses": gap},
        {"distances": np.ones((ROWS, 1)), "distance_deviations": None},
        {"pose_deviations": np.full((ROWS, 3), np.nan)},
        {},
    ]
    tables = [replace(whole, **change) for change in changes]
    tables.insert(1, whole.subset(np.arange(0)))
    reasons = [replace(each).incomplete_because for each in tables]
    Measurements.look_through(tables)
    known = [vars(each).get("incomplete_because") for each in tables]
    assert known == ["", None, None, None, None, ""]
    assert [each.incomplete_because for each in tables] == reasons
