# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from symkin.errors import MeasurementError
from symkin.files.measurements import read_measurements, write_measurements
from symkin.measurements import Measurements
from symkin.mechanism import Leg, Mechanism

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
