# SPDX-License-Identifier: MIT
"""Poses alone, from tables."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from symkin.data.columns import own_columns, read_pose_values
from symkin.model.file_frames import from_drawing
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.options import checks
from symkin.storage.tables import TableSource, read_table
from symkin.values import Array


@checks()
def read_pose_list(source: TableSource, mechanism: MechanismGiven) -> Array:
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
    mechanism = as_mechanism(mechanism)
    table = read_table(source)
    columns = own_columns(table, mechanism.pose_space, mechanism.reading_count)
    return from_drawing(mechanism, read_pose_values(table, columns).poses())


def as_poses(given: Any, mechanism: Mechanism) -> Array:
    """Return poses, from the path of a table or as `pose_rows` takes them."""
    is_array = hasattr(given, "poses") or not (
        isinstance(given, str | os.PathLike | Mapping) or hasattr(given, "columns")
    )
    return pose_rows(given) if is_array else read_pose_list(given, mechanism)
