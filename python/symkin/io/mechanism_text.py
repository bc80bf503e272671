# SPDX-License-Identifier: MIT
"""What a mechanism looks like as TOML values, and edits that keep a template's text."""

from __future__ import annotations

import copy
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import tomlkit
from tomlkit.items import AoT, Table

from symkin.io.mechanism_schema import COORDINATES
from symkin.io.quantities import MOST, MOST_OF_DIRECTION
from symkin.io.toml_source import MARK

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism

__all__ = ["commented_out", "leg_values", "settings_values", "update_table"]

Values = dict[str, Any]


def settings_values(mechanism: Mechanism) -> dict[str, Values]:
    """Return the sections other than the legs and the symmetry, as plain TOML values in SI.

    A section that the mechanism does not have is empty.
    """
    limits = mechanism.joint_limits
    return {
        "workspace": _workspace_values(mechanism),
        "noise": asdict(mechanism.noise),
        "tolerances": asdict(mechanism.tolerances),
        "joint_limits": {
            name: value
            for name, value in (("lower", limits.lower), ("upper", limits.upper))
            if math.isfinite(value)
        },
        "protocol": asdict(mechanism.protocol),
        "measurements": _measurement_values(mechanism),
    }


def leg_values(mechanism: Mechanism, leg: int) -> Values:
    """Return the table of a leg (from 0), each standard deviation beside its parameter."""
    values: Values = {"working_mode": int(mechanism.legs[leg].working_mode)}
    for index, name in enumerate(mechanism.parameter_names):
        value: float | str = float(mechanism.legs[leg].parameters[name])
        if mechanism.parameter_units[index] == "rad" and abs(float(value)) > MOST_OF_DIRECTION:
            value = f"{value!r} rad"  # without its unit a file with it would be refused
        deviations = mechanism.deviations
        if deviations is None or not deviations[leg, index] < MOST:
            values[name] = value
        else:
            deviation = float(deviations[leg, index])
            values[name] = {"value": value, "standard_deviation": deviation}
    return values


def update_table(table: Any, values: Values, present: Values) -> None:
    """Set what differs from the `present` values; what agrees keeps its expression and comment."""
    for name in [name for name in table if name not in values]:
        table.remove(name)
    for name, value in values.items():
        if name not in present or present[name] != value:
            table[name] = _toml_value(value)


def commented_out(text: str, name: str, replacement: str = "") -> str:
    """Turn a section into comments, followed by a replacement.

    The comments of the section and those above the next one stay as they are.
    """
    document = tomlkit.parse(text)
    if name not in document:
        return text + replacement
    lines = text.split("\n")
    headers = _header_rows(document)
    ends = [row for row, _ in headers[1:]] + [len(lines)]
    spans = [(row, end) for (row, key), end in zip(headers, ends, strict=True) if key == name]
    if not spans:
        document.remove(name)  # an inline table, or dotted keys
        return document.as_string() + replacement
    for start, end in spans:
        content = [row for row in range(start, end) if _is_content(lines[row])]
        for row in content:
            lines[row] = f"# {lines[row]}"
    lines[content[-1]] += "\n" + replacement.rstrip("\n")
    return "\n".join(lines)


def _workspace_values(mechanism: Mechanism) -> Values:
    workspace = mechanism.workspace
    if workspace is None:
        return {}
    names = COORDINATES[mechanism.pose_space]
    bounds = zip(names, workspace.lower, workspace.upper, strict=True)
    values: Values = {name: [float(lower), float(upper)] for name, lower, upper in bounds}
    if workspace.home is not None:
        values["home"] = [float(value) for value in workspace.home]
    if workspace.reach_margin is not None:
        values["reach_margin"] = workspace.reach_margin
    values["conditioning_limit"] = workspace.conditioning_limit
    if workspace.characteristic_length is not None:
        values["characteristic_length"] = workspace.characteristic_length
    return values


def _measurement_values(mechanism: Mechanism) -> Values:
    if mechanism.measurement_columns is None:
        return {}
    values = asdict(mechanism.measurement_columns)
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in values.items()
        if value
    }


def _toml_value(value: Any) -> Any:
    if isinstance(value, dict):
        table = tomlkit.inline_table()
        table.update(value)
        return table
    return value


def _header_rows(document: tomlkit.TOMLDocument) -> list[tuple[int, str]]:
    """Rows, from 0, of the headers of top-level tables, with their names."""
    marked = copy.deepcopy(document)
    for name, item in marked.items():
        for table in item if isinstance(item, AoT) else [item]:
            if isinstance(table, Table) and not table.is_super_table():
                table.comment(f"{MARK}{name}")
    lines = enumerate(marked.as_string().split("\n"))
    return [(row, line.partition(MARK)[2].strip()) for row, line in lines if MARK in line]


def _is_content(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")
