# SPDX-License-Identifier: MIT
"""Lists of poses."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.io.columns import own_columns, read_poses
from symkin.io.tables import read_table

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism

__all__ = ["read_pose_list"]


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
