# SPDX-License-Identifier: MIT
"""Poses alone, from tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.data.columns import own_columns, read_pose_values
from symkin.model.file_frames import from_drawing
from symkin.model.mechanism import Mechanism
from symkin.storage.tables import TableSource, read_table

__all__ = ["read_pose_list"]


def read_pose_list(source: TableSource, mechanism: Mechanism) -> NDArray[np.float64]:
    """Read poses from a table with pose columns as `write_plan` names them, any unit.

    Parameters
    ----------
    source : str, path, stream, DataFrame or dict of arrays
        As `read_measurements` takes it; further columns are not read.
    mechanism : Mechanism
        Its kind of platform says which columns there must be.

    Returns
    -------
    ndarray, shape (N, coordinates)
        m and rad (spatial: position and unit quaternion), in the mechanism's own frames. A table
        is in those of the mechanism's file, see `DrawnPoints`.

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column.
    """
    table = read_table(source)
    columns = own_columns(table, mechanism.pose_space, len(mechanism.legs))
    return from_drawing(mechanism, read_pose_values(table, columns).poses())
