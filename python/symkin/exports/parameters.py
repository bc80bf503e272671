# SPDX-License-Identifier: MIT
"""Numbers for controllers: parameters with units and deviations, and a correction table.

The table is for controllers that know nothing but the nominal kinematics. At a pose the calibrated
robot's readings are g(pose), and the nominal mechanism believes that they mean another pose. A
controller that is told to go there commands these readings, and the robot goes to the first.
Between rows the difference of the two is interpolated linearly in each coordinate.
"""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from symkin.analysis.evaluation import Evaluation, evaluate
from symkin.analysis.workspace import interpolated, workspace_coordinates
from symkin.errors import SymkinError
from symkin.exports.common import ExportOptions, Loss, Written, workspace_poses
from symkin.model.chains import CURVATURE_TERMS, legs_in_words
from symkin.model.mechanism import Mechanism, require_same_shape
from symkin.model.poses import between, poses_from_bounds, transforms
from symkin.values import Array

_SENSOR = "joint = sensor_gain * reading + sensor_offset"
_NAN = " NAN stands where a leg has no such parameter."
_GRID = {2: 21, 3: 21, 4: 11, 6: 5}  # poses of a table along each coordinate, by how many there are
_MOST = 10**6  # rows of it


def write_json(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write all parameters as JSON."""
    return Written(json.dumps(_document(mechanism), indent=2, ensure_ascii=False) + "\n")


def write_yaml(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write the document of `write_json` as YAML."""
    return Written("\n".join(_yaml(_document(mechanism))) + "\n")


def write_c_header(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write all parameters as constants of C and C++, an array over the legs for each."""
    name = re.sub(r"\W", "_", mechanism.name, flags=re.ASCII)
    prefix = name if re.match("[A-Za-z]", name) else f"robot_{name}"
    guard = f"{prefix.upper()}_GEOMETRY_H"
    count = len(mechanism.legs)
    lines = [
        f"/* {_in_comment(mechanism.name)}: {legs_in_words(mechanism.legs)}, "
        f"{mechanism.pose_space}; written by symkin. Lengths are m, angles rad. "
        f"{_SENSOR}.{_NAN * mechanism.mixed} */",
        f"#ifndef {guard}",
        f"#define {guard}",
        *(["#include <math.h>"] if mechanism.mixed else []),
        "",
        f"#define {prefix.upper()}_LEGS {count}",
        "",
        _array("int", f"{prefix}_working_mode", [str(mode) for mode in mechanism.working_modes]),
    ]
    if mechanism.mixed:
        names = [json.dumps(chain) for chain in mechanism.chains]
        lines.append(_array("char *const", f"{prefix}_chain", names))
    has, units = mechanism.has_parameter, [mechanism.parameter_units(leg) for leg in range(count)]
    columns = [
        (name, np.where(has, mechanism.parameters, np.nan)[:, at], [each[at] for each in units])
        for at, name in enumerate(mechanism.parameter_names)
    ]
    if mechanism.curvature is not None:
        bent = [_curve_units(mechanism, leg) for leg in range(count)]
        ways = map(list, zip(*bent, strict=True))
        columns += zip(CURVATURE_TERMS, mechanism.curvature.T, ways, strict=True)
    for parameter, values, of_legs in columns:
        said = ["NAN" if math.isnan(value) else repr(value) for value in values.tolist()]
        known = {unit or "1" for unit, each in zip(of_legs, said, strict=True) if each != "NAN"}
        unit = known.pop() if len(known) == 1 else ", ".join(each or "1" for each in of_legs)
        comment = f" /* {unit} */" if unit != "1" else ""
        lines.append(_array("double", f"{prefix}_{parameter}", said) + comment)
    return Written("\n".join([*lines, "", "#endif"]) + "\n")


def _document(mechanism: Mechanism) -> dict[str, Any]:
    return {
        "name": mechanism.name,
        "chain": mechanism.chain,
        "platform": mechanism.platform,
        "reading_unit": mechanism.reading_unit,
        "sensor": _SENSOR,
        "legs": [
            {
                "leg": leg + 1,
                **({"chain": mechanism.chains[leg]} if mechanism.mixed else {}),
                "working_mode": mechanism.working_modes[leg],
                "parameters": dict(_leg(mechanism, leg)),
            }
            for leg in range(len(mechanism.legs))
        ],
    }


def _leg(mechanism: Mechanism, leg: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """Value, unit and standard deviation of each parameter, the last if it is known."""
    units = mechanism.parameter_units(leg)
    for column, name in enumerate(mechanism.parameter_names):
        if not mechanism.has_parameter[leg, column]:
            continue
        said: dict[str, Any] = {"value": float(mechanism.parameters[leg, column])}
        said["unit"] = units[column] or "1"
        if mechanism.deviations is not None:
            deviation = float(mechanism.deviations[leg, column])
            if math.isfinite(deviation):
                said["standard_deviation"] = deviation
        yield name, said
    if mechanism.curvature is not None:
        bent = _curve_units(mechanism, leg)
        for name, value, unit in zip(CURVATURE_TERMS, mechanism.curvature[leg], bent, strict=True):
            yield name, {"value": float(value), "unit": unit}


def _curve_units(mechanism: Mechanism, leg: int) -> tuple[str, ...]:
    """Units of c psi^2 + a cos(psi) + b sin(psi)."""
    joint = mechanism.leg_info(leg).reading_unit
    return f"{joint}/{mechanism.reading_unit}^2", joint, joint


def _yaml(value: Any, depth: int = 0) -> Iterator[str]:
    """Lines of a mapping whose keys are plain words; text and numbers as JSON has them."""
    space = "  " * depth
    for key, each in value.items():
        if isinstance(each, Mapping):
            yield f"{space}{key}:"
            yield from _yaml(each, depth + 1)
        elif isinstance(each, list):
            yield f"{space}{key}:"
            for item in each:
                first, *others = _yaml(item, depth + 1)
                yield f"{space}- {first.lstrip()}"
                yield from others
        else:
            yield f"{space}{key}: {_scalar(each)}"


def _scalar(value: Any) -> str:
    said = json.dumps(value, ensure_ascii=False)
    # YAML 1.1 takes 1e-05 for text.
    return re.sub(r"^(-?\d+)e", r"\1.0e", said) if isinstance(value, float) else said


def _array(kind: str, name: str, values: list[str]) -> str:
    return f"static const {kind} {name}[{len(values)}] = {{{', '.join(values)}}};"


def _in_comment(text: str) -> str:
    return text.replace("*/", "* /").replace("/*", "/ *")


def write_table(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a CSV: pose wanted, then pose to command; what is out of reach has no row."""
    nominal = options.nominal
    if nominal is None:
        raise SymkinError(
            "a correction table needs the mechanism that the controller computes with (--nominal)"
        )
    require_same_shape(mechanism, nominal)
    if mechanism.bound:
        raise SymkinError(
            f'the legs of "{mechanism.name}" bind its platform; expected a mechanism whose '
            "coordinates can all be commanded"
        )
    test = workspace_poses(mechanism)
    assert mechanism.workspace is not None  # or there were no poses
    lower, upper = mechanism.workspace.lower, mechanism.workspace.upper
    count = options.grid or _GRID[len(lower)]
    flat = [a == b for a, b in zip(lower, upper, strict=True)]
    if count < 2 or float(count) ** flat.count(False) > _MOST:
        raise SymkinError(
            f"a grid of {count} poses along each of {len(lower)} coordinates; expected at least 2, "
            f"and at most {_MOST} poses in all"
        )
    bounds = zip(lower, upper, flat, strict=True)
    axes = [np.linspace(a, b, 1 if level else count) for a, b, level in bounds]
    nodes = np.array(list(itertools.product(*axes)))
    commands = _commands(mechanism, nominal, nodes)
    shape = tuple(len(axis) for axis in axes)
    corrections = (commands - nodes).reshape(*shape, len(axes))
    wanted = workspace_coordinates(mechanism, test)
    told = wanted + interpolated(axes, corrections, wanted)
    covered = np.isfinite(told).all(axis=1)
    if not covered.any():
        raise SymkinError(
            "no cell of the grid is in reach with all its corners; make the workspace's box "
            "smaller, or the grid finer"
        )
    after = _evaluated(mechanism, nominal, test[covered], told[covered])
    before = evaluate(nominal, actual=mechanism, poses=test[covered])
    means = "by the nominal mechanism"
    loss = Loss.of(after, means)
    notes = [f"Without the table the errors are {Loss.of(before, means)}"]
    missing = len(test) - int(covered.sum())
    if missing:
        notes.append(
            f"{missing} of {len(test)} poses of the workspace lie in cells of the grid with a "
            "corner out of reach: the table says nothing of them, nor do the errors"
        )
    return Written(_csv(mechanism, nodes, commands), tuple(notes), loss)


def _commands(mechanism: Mechanism, nominal: Mechanism, nodes: Array) -> Array:
    """Coordinates to command to go to others; NaN where the robot, or its model, cannot go."""
    poses = poses_from_bounds(mechanism.pose_space, nodes)
    readings = mechanism.inverse_kinematics(poses)
    commands = np.full(nodes.shape, np.nan)
    reached = np.flatnonzero(np.isfinite(readings).all(axis=1))
    if len(reached):
        believed, converged = nominal.forward_kinematics(readings[reached], start=poses[reached])
        taken = reached[converged]
        commands[taken] = workspace_coordinates(nominal, believed[converged])
    if mechanism.space.has_angle:
        # The same turn as the pose wanted, which may be beyond half of one.
        turns = np.rint((commands[:, -1] - nodes[:, -1]) / (2 * np.pi))
        commands[:, -1] -= 2 * np.pi * turns
    return commands


def _evaluated(mechanism: Mechanism, nominal: Mechanism, wanted: Array, told: Array) -> Evaluation:
    """Errors of the poses that the robot takes when other poses are commanded."""
    readings = nominal.inverse_kinematics(poses_from_bounds(nominal.pose_space, told))
    taken = mechanism.forward_kinematics(readings, start=wanted)[0]
    missed = between(*(transforms(mechanism.pose_space, poses) for poses in (wanted, taken)))
    return Evaluation.of(missed[:, mechanism.space.components], wanted, mechanism)


def _csv(mechanism: Mechanism, nodes: Array, commands: Array) -> str:
    names = [f"{name}_{unit}" for name, unit in mechanism.space.units.items()]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*names, *(f"command_{name}" for name in names)])
    rows = np.hstack([nodes, commands])
    writer.writerows(rows[np.isfinite(rows).all(axis=1)].tolist())
    return text.getvalue()
