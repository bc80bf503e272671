# SPDX-License-Identifier: MIT
"""Lists of poses, and of readings."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.io.columns import (
    own_columns,
    pose_column_names,
    read_poses,
    read_readings,
    reading_column_names,
)
from symkin.io.tables import read_table

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism

__all__ = ["pose_and_reading_columns", "read_pose_list", "read_reading_list"]


def read_pose_list(path: str | os.PathLike[str], mechanism: Mechanism) -> NDArray[np.float64]:
    """Read poses from a table with pose columns as `write_plan` names them, any unit.

    Parameters
    ----------
    path : str or path
        CSV or Parquet, by extension; further columns are not read.
    mechanism : Mechanism
        Its kind of platform says which columns there must be.

    Returns
    -------
    ndarray, shape (N, coordinates)
        m and rad (spatial: position and unit quaternion).

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column.
    """
    table = read_table(Path(path))
    return read_poses(table, own_columns(table, mechanism.pose_space, len(mechanism.legs)))


def read_reading_list(path: str | os.PathLike[str], mechanism: Mechanism) -> NDArray[np.float64]:
    """Read readings of all legs from a table with columns as `write_plan` names them, any unit.

    Parameters
    ----------
    path : str or path
        CSV or Parquet, by extension; further columns are not read.
    mechanism : Mechanism
        Its legs and its sensor say which columns there must be.

    Returns
    -------
    ndarray, shape (N, legs)
        In the sensor's unit.

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column.
    """
    table = read_table(Path(path))
    columns = own_columns(table, mechanism.pose_space, len(mechanism.legs))
    readings = read_readings(table, columns, mechanism.reading_unit)
    missing = np.argwhere(np.isnan(readings))
    if len(missing):
        row, leg = missing[0].tolist()
        raise table.row_error(row, f"has no reading of leg {leg + 1}; a pose takes those of all")
    return readings


def pose_and_reading_columns(
    mechanism: Mechanism, poses: NDArray[np.float64], readings: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Return poses and readings as the columns of symkin's files."""
    names = pose_column_names(mechanism.pose_space)
    names += reading_column_names(len(mechanism.legs), mechanism.reading_unit)
    return dict(zip(names, [*poses.T, *readings.T], strict=True))
