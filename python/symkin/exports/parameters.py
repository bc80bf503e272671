# SPDX-License-Identifier: MIT
"""Parameters as they are, with units and standard deviations: JSON, YAML and a C header."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from symkin.chains import legs_in_words
from symkin.exports.exported import ExportOptions, Written
from symkin.mechanism import Mechanism

__all__ = ["write_c_header", "write_json", "write_yaml"]

_SENSOR = "joint = sensor_gain * reading + sensor_offset"
_NAN = " NAN stands where a leg has no such parameter."
_CURVES = ("sensor_quadratic", "sensor_cosine", "sensor_sine")


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
        columns += zip(_CURVES, mechanism.curvature.T, ways, strict=True)
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
        for name, value, unit in zip(_CURVES, mechanism.curvature[leg], bent, strict=True):
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
