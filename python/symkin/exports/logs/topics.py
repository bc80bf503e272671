# SPDX-License-Identifier: MIT
"""Tables that topics of ROS bags are exported to."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from symkin.exports.logs.log import Log, numbers_of, rows_of
from symkin.values import Array

# Of a header's time whole seconds and the rest, as the two ROS name them.
_STAMPS = (("stamp.sec", "stamp.nanosec"), ("stamp.secs", "stamp.nsecs"))


def is_topic(log: Log) -> bool:
    """Whether it is one: by the time of its header."""
    head = log.data[:20_000].lstrip(b"\xef\xbb\xbf").partition(b"\n")[0]
    if re.match(rb"(%time|__time)[,;]", head):
        return True
    names = _names_of(head.decode("latin-1"))
    return len(names) > 2 and _stamp_of(names) is not None


def _names_of(head: str) -> list[str]:
    return [each.strip().strip('"') for each in re.split("[,;]", head)]


def _stamp_of(names: Sequence[str]) -> tuple[int, int] | None:
    """The columns of a header's time in seconds and nanoseconds."""
    for ends in _STAMPS:
        first, second = (topic_column(names, end) for end in ends)
        if first is not None and second is not None:
            return first, second
    return None


def topic_table(log: Log) -> tuple[list[str], Array]:
    """Names of the columns that hold numbers, time first in s, and their values."""
    rows = rows_of(log)
    names = [each.strip() for each in rows[0]]
    width = len(names)
    body = [row for row in rows[1:] if any(cell.strip() for cell in row)]
    if not body:
        raise log.error("has no rows below its header")
    stamp = None if names[0] in ("%time", "__time") else _stamp_of(names)
    times = (0,) if stamp is None else stamp
    plain = [*times, *(k for k in range(width) if k not in times and _is_number(body[0], k))]
    values = numbers_of(log, [[row[k] if k < len(row) else "" for k in plain] for row in body], 2,
                      len(plain))  # fmt: skip
    since = values[:, : len(times)] - values[0, : len(times)]
    if stamp is not None:
        seconds = since[:, 0] + 1e-9 * since[:, 1]
        return ["stamp", *(names[k] for k in plain[2:])], np.column_stack([seconds, values[:, 2:]])
    values[:, 0] = since[:, 0] * (1e-9 if names[0] == "%time" else 1.0)  # nanoseconds
    return [names[k] for k in plain], values


def _is_number(row: Sequence[str], k: int) -> bool:
    try:
        float(row[k])
    except (ValueError, IndexError):
        return False
    return True


def topic_column(names: Sequence[str], *ends: str) -> int | None:
    """The column whose name ends so, with ``.`` or ``/`` before."""
    for k, name in enumerate(names):
        plain = name.replace("/", ".")
        if any(plain == end or plain.endswith(f".{end}") for end in ends):
            return k
    return None
