# SPDX-License-Identifier: MIT
from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from symkin.data.measurements import Measurements
from symkin.data.reading import read_measurements, write_measurements
from symkin.errors import MeasurementError
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.poses import quaternions_from_rotation_vectors

Write = Callable[..., Path]


@pytest.mark.parametrize(
    ("columns", "scale", "words"),
    [
        ("readings", 180 / np.pi, ["readings", '"psi_1_rad"', "stated in rad but fit in deg"]),
        ("readings", 1 / (2 * np.pi), ["readings", "stated in rad but fit in rev"]),
        ("positions", 1e3, ["positions", '"x_m"', "stated in m but fit in mm"]),
        ("angles", 180 / np.pi, ["angles", '"phi_rad"', "stated in rad but fit in deg"]),
    ],
)
def test_values_in_another_unit_than_the_name_says_are_refused(
    write: Write,
    paper: Mechanism,
    measured: Measurements,
    columns: str,
    scale: float,
    words: list[str],
) -> None:
    poses, readings = measured.poses.copy(), measured.readings.copy()
    {"readings": readings, "positions": poses[:, :2], "angles": poses[:, 2]}[columns][...] *= scale
    path = write("", "m.csv")
    write_measurements(
        replace(measured, poses=poses, readings=readings), path, paper, overwrite=True
    )
    with pytest.raises(MeasurementError) as error:
        read_measurements(path, paper)
    for word in words:
        assert word in str(error.value)


def test_radians_in_a_column_of_degrees_are_refused(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    text = path.read_text().replace(
        "psi_1_rad,psi_2_rad,psi_3_rad", "psi_1_deg,psi_2_deg,psi_3_deg"
    )
    with pytest.raises(MeasurementError, match=r'"psi_1_deg".* stated in deg but fit in rad'):
        read_measurements(write(text, "deg.csv"), paper)


def test_a_badly_built_mechanism_is_not_mistaken_for_a_wrong_unit(
    write: Write, paper: Mechanism, measured: Measurements
) -> None:
    legs = [
        Leg(
            leg.chain,
            {**leg.parameters, "sensor_offset": leg.parameters["sensor_offset"] + 0.5},
            -1,
        )
        for leg in paper.legs
    ]
    path = write("", "m.csv")
    write_measurements(measured, path, paper, overwrite=True)
    assert len(read_measurements(path, paper.replace(legs=legs, symmetry=None)).poses) == 12


def _scaled(measured: Measurements, scales: dict[str, float]) -> Measurements:
    poses, readings = measured.poses.copy(), measured.readings.copy()
    parts = {"readings": readings, "positions": poses[:, :2], "angles": poses[:, 2]}
    for name, scale in scales.items():
        parts[name][...] *= scale
    return replace(measured, poses=poses, readings=readings)


@pytest.mark.parametrize("readings", [1.0, 180 / np.pi, 1 / (2 * np.pi)])
@pytest.mark.parametrize("positions", [1.0, 1e3, 1e2])
@pytest.mark.parametrize("angles", [1.0, 180 / np.pi])
def test_wrong_units_of_several_columns_are_named_together(
    tmp_path: Path,
    paper: Mechanism,
    measured: Measurements,
    readings: float,
    positions: float,
    angles: float,
) -> None:
    scales = {"readings": readings, "positions": positions, "angles": angles}
    path = tmp_path / "m.csv"
    write_measurements(_scaled(measured, scales), path, paper)
    wrong = {name for name, scale in scales.items() if scale != 1}
    if not wrong:
        assert len(read_measurements(path, paper).poses) == 12
        return
    with pytest.raises(MeasurementError) as error:
        read_measurements(path, paper)
    assert {name for name in scales if f"the {name} (column" in str(error.value)} == wrong


def test_rotation_vectors_in_degrees_are_refused(write: Write, hexapod: Mechanism) -> None:
    random = np.random.default_rng(2)
    vectors = random.uniform(-0.2, 0.2, (20, 3))
    positions = random.uniform([-0.05, -0.05, 0.7], [0.05, 0.05, 0.8], (20, 3))
    poses = np.hstack([positions, quaternions_from_rotation_vectors(vectors)])
    psi = hexapod.inverse_kinematics(poses)
    header = "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad," + ",".join(f"psi_{leg}_rad" for leg in range(1, 7))
    for scale, words in ((1.0, ""), (180 / np.pi, 'column "rx_rad") are stated in rad but fit in')):
        rows = np.hstack([positions, vectors * scale, psi]).tolist()
        lines = [",".join(map(repr, row)) for row in rows]
        path = write("\n".join([header, *lines]) + "\n", "m.csv")
        if words:
            with pytest.raises(MeasurementError, match=re.escape(words)):
                read_measurements(path, hexapod)
        else:
            assert np.allclose(read_measurements(path, hexapod).poses, poses)


@pytest.mark.parametrize("far", [50.0, 1e9])
def test_a_single_wrong_pose_is_not_mistaken_for_a_wrong_unit(
    tmp_path: Path, paper: Mechanism, measured: Measurements, far: float
) -> None:
    poses = measured.poses.copy()
    poses[4, 0] += far
    path = tmp_path / "m.csv"
    write_measurements(replace(measured, poses=poses), path, paper)
    assert len(read_measurements(path, paper).poses) == 12


@pytest.mark.parametrize("fault", ["other mode", "swapped legs", "sign", "half a turn", "noise"])
@pytest.mark.parametrize("zero_at_home", [False, True])
def test_what_no_unit_explains_is_left_to_the_identification(
    tmp_path: Path, paper: Mechanism, measured: Measurements, fault: str, zero_at_home: bool
) -> None:
    mechanism = paper
    if zero_at_home:  # poses and readings that shrink to nothing then fit
        offset = paper.inverse_kinematics(paper.home)[0]
        parameters = paper.parameters.copy()
        names = paper.parameter_names
        parameters[:, names.index("sensor_offset")] += (
            parameters[:, names.index("sensor_gain")] * offset
        )
        mechanism = paper.replace(symmetry=None).with_parameters(parameters)
    modes = [Leg(leg.chain, leg.parameters, 1) for leg in mechanism.legs]
    made = mechanism.replace(legs=modes, symmetry=None) if fault == "other mode" else mechanism
    readings = made.inverse_kinematics(measured.poses)
    if fault == "swapped legs":
        readings = readings[:, [1, 0, 2]]
    elif fault == "sign":
        readings = -readings
    elif fault == "half a turn":
        readings = readings + np.pi
    elif fault == "noise":
        readings = np.random.default_rng(3).uniform(-3, 3, readings.shape)
    path = tmp_path / "m.csv"
    write_measurements(replace(measured, readings=readings), path, mechanism)
    assert len(read_measurements(path, mechanism).poses) == 12
