# SPDX-License-Identifier: MIT
"""Logs of machines and devices, read as tables of measurements.

A format is a `LogFormat`: whether a file is one, and what it says. `FORMATS` is their table, in the
order in which they are asked.
"""

from __future__ import annotations

import os
from pathlib import Path

from symkin.errors import SymkinError
from symkin.exports.logs.deltas import MARLIN, REPRAP
from symkin.exports.logs.log import Asked, ImportedLog, Log, LogFormat
from symkin.exports.logs.motive import MOTIVE
from symkin.exports.logs.points import POINTS
from symkin.exports.logs.records import EXCEL, JSON, MASLOW
from symkin.exports.logs.ros import ROS
from symkin.exports.logs.vicon import VICON
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.storage.tables import file_bytes

__all__ = ["FORMATS", "ImportedLog", "LogFormat", "import_log", "log_format_of"]

FORMATS: tuple[LogFormat, ...] = (
    *(MOTIVE, VICON, ROS, EXCEL, JSON, MASLOW, MARLIN, REPRAP, POINTS),
)
_MOST_BYTES = 300_000_000  # a take of an hour


def log_format_of(path: str | os.PathLike[str]) -> LogFormat | None:
    """The format of a log, by what it holds; None if it is of none of these.

    Raises
    ------
    SymkinError
        If there is no such file.
    """
    log = _log(path)
    return next((each for each in FORMATS if each.recognises(log)), None)


def import_log(
    path: str | os.PathLike[str],
    beside: str | os.PathLike[str] | None = None,
    *,
    mechanism: MechanismGiven | None = None,
    radius: float | None = None,
    body: str = "",
) -> ImportedLog:
    """Read what was measured from a log, whatever format it has.

    Parameters
    ----------
    path : str or path
        The log.
    beside : str or path, optional
        Of motion capture and ROS: what the encoders showed meanwhile, a table with a time and the
        readings, or a topic of joint states. The clocks are aligned by the speeds, and what comes
        of both are means over rests. Of a list of points: a table with a row a pose, by a column of
        the poses' numbers or in their order.
    mechanism : Mechanism, optional
        The robot, which says where the encoders have it.
    radius : float, optional
        Of Marlin's G33, whose log does not say it: how far from the middle it probed, m.
    body : str
        Of motion capture: the rigid body that is the platform's; by default the first.

    Returns
    -------
    ImportedLog

    Raises
    ------
    SymkinError
        Naming the file and what it lacks.
    """
    log = _log(path)
    found = next((each for each in FORMATS if each.recognises(log)), None)
    if found is None:
        known = ", ".join(each.title for each in FORMATS)
        raise log.error(f"is no log that symkin knows; expected {known}")
    if beside is not None and found not in (MOTIVE, VICON, ROS, POINTS):
        raise SymkinError(
            f"{Path(beside)}: a second log goes with motion capture and lists of points; "
            f"{log.path} is {found.title}"
        )
    if radius is not None and not 0 < radius < 1e3:
        raise SymkinError(f"radius is {radius:g}; expected how far from the middle was probed, m")
    asked = Asked(
        None if mechanism is None else as_mechanism(mechanism),
        None if beside is None else _log(beside),
        radius,
        body,
    )
    try:
        return found.read(log, asked)
    except SymkinError as error:
        named = str(error)
        paths = [str(log.path), *([str(beside)] if beside is not None else [])]
        if any(named.startswith(each) for each in paths):
            raise
        raise log.error(named) from error


def _log(path: str | os.PathLike[str]) -> Log:
    path = Path(path)
    return Log(path, file_bytes(path, lambda said: SymkinError(f"{path}: {said}"), _MOST_BYTES))
