# SPDX-License-Identifier: MIT
"""Poses in a topic of a ROS bag."""

from __future__ import annotations

import re

from symkin.exports.logs.log import Asked, Log
from symkin.exports.logs.takes import Take, take_format
from symkin.exports.logs.topics import is_topic, topic_column, topic_table


def _read_ros(log: Log, _asked: Asked) -> Take:
    names, values = topic_table(log)
    place = [
        topic_column(names, f"position.{axis}", f"translation.{axis}", f"point.{axis}")
        for axis in "xyz"
    ]
    if None in place:
        raise log.error(
            "has no position.x, position.y, position.z, as poses do; a table of joint states is "
            "the second file, beside one of poses"
        )
    turn = [topic_column(names, f"orientation.{a}", f"rotation.{a}") for a in "xyzw"]
    used = [each for each in place if each is not None]
    seen = {"positions": values[:, used]}
    if None not in turn:
        columns = [each for each in turn if each is not None]
        seen["quaternions"] = values[:, columns]
        used += columns
    others = [name for k, name in enumerate(names) if k and k not in used]
    took = (f"{len(values)} poses of {re.sub(r'[./]x$', '', names[used[0]])}",)
    left = (f"columns {', '.join(others[:6])}{' ...' if len(others) > 6 else ''}",) * bool(others)
    return Take.of(values[:, 0], took, left, **seen)


ROS = take_format("ros", "a topic of a ROS bag", is_topic, _read_ros)
