# SPDX-License-Identifier: MIT
"""Tables of tries: a line for every attempt to measure a pose, of which not all count.

A guided session appends them, and nothing is ever deleted: a later line takes an earlier one back.
Readers of measurements use the rows that count and pass over what else the lines say.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.data.observables import PAIR
from symkin.storage.tables import Table
from symkin.values import places_of

STATUS, ROW, TIME = "status", "row", "time_s"
LINK = f"{PAIR}1_row"  # the number of the row that one was measured with
COUNTING = ("ok", "repeat")  # and an empty cell, of what somebody else appended
# A line that takes back the line with the same number: somebody erred, or the row is wrong.
UNDONE, DROPPED = "undone", "dropped"
BACK = (UNDONE, DROPPED)
# Columns that say how a line came about, and are no measurement.
NOTES = (ROW, "time", STATUS, "repeat_of", "device", "remark")


def counting_rows(statuses: list[str], numbers: list[str]) -> NDArray[np.intp]:
    """Lines, from 0, that were measured and not taken back; a line without a number has its own."""
    own = [number or str(place) for place, number in enumerate(numbers, 1)]
    back = {number for number, status in zip(own, statuses, strict=True) if status in BACK}
    return np.array(
        [
            place
            for place, (number, status) in enumerate(zip(own, statuses, strict=True))
            if status in ("", *COUNTING) and number not in back
        ],
        dtype=np.intp,
    )


def only_counting(table: Table, robot: str = "") -> Table:
    """Return a table without the lines of tries that do not count, if it is one of tries.

    Numbers of lines are those of each robot, if a column `robot` names several.

    Raises
    ------
    MeasurementError
        If no line counts, or none of a robot.
    """
    if STATUS not in table.names:
        return table
    statuses = table.texts(STATUS)
    numbers = table.texts(ROW) if ROW in table.names else [""] * len(statuses)
    robots = table.texts(robot) if robot in table.names else [""] * len(statuses)
    counting = []
    for name, own in places_of(robots).items():
        places = counting_rows([statuses[line] for line in own], [numbers[line] for line in own])
        if not len(places):
            of = f' of robot "{name}"' if name else ""
            raise table.error(
                f'no row{of} counts by its column "{STATUS}"; expected one that is ok'
            )
        counting.append(np.array(own)[places])
    kept = np.sort(np.concatenate(counting))
    # Who appends a row may not know when the session began: then the order is all there is.
    timed = TIME in table.names and all(np.array(table.texts(TIME))[kept])
    linked = any(name.startswith(PAIR) for name in table.names)
    notes = [name for name in NOTES if not (linked and name == ROW)]
    dropped = (*notes, *(() if timed else (TIME,)))
    return table.subset(kept, without=dropped)
