# SPDX-License-Identifier: MIT
"""Write declared_numbers.hpp from a JSON file of declared legs.

Usage: python make_declared_numbers.py declared_legs.json [--all] > declared_numbers.hpp

Without ``--all`` the legs named below, with their first case each.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

KEPT = (
    "planar [R]RR",
    "planar [R][R]R (redundant encoder)",
    "planar four-bar crank {R}RR",
    "U[P]S imperfect U, S cut",
    "3-UPU U[P]U",
    "Orthoglide ideal Pa, translating",
    "Orthoglide real, two rods",
    "Tripteron [P]RRR, translating",
    "H4 ideal leg [R]US, Schoenflies",
    "H4 real half: 2 cranks, 4 rods, plate joint",
    "spherical [R]RR",
    "five-bar [R]RR point",
    "S[P]S with a rod that spins",
)

HEADER = """\
// SPDX-License-Identifier: MIT
// Written by make_declared_numbers.py; do not edit.
#pragma once

#include "declared/declared_cases.hpp"

// Numbers that were made independently of this library, with complex steps and singular values.
// Metres and radians.
namespace symkin::declared::reference {

// clang-format off
inline const std::vector<Leg> legs = {
"""


def braced(items: Iterable[str]) -> str:
    return "{" + ", ".join(items) + "}"


def numbers(values: Iterable[float]) -> str:
    return braced(repr(float(value)) for value in values)


def roll_pitch_yaw(quaternion: list[float]) -> tuple[float, float, float]:
    x, y, z, w = quaternion
    sine = max(-1.0, min(1.0, 2 * (w * y - z * x)))
    if abs(sine) > 1 - 1e-14:
        return 0.0, math.copysign(math.pi / 2, sine), -2 * math.copysign(1, sine) * math.atan2(x, w)
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(sine),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def joint(entry: dict[str, Any]) -> str:
    kind = "JointKind::turn" if entry["kind"] == "R" else "JointKind::slide"
    follows = entry.get("follows", "Joint::kOwn")
    if follows == "pose yaw":
        follows = "Joint::kPoseYaw"
    if follows[1:].isdigit():
        follows = follows[1:]
    read = "true" if entry.get("read") else "false"
    ratio, offset = entry.get("ratio", 1.0), entry.get("offset", 0.0)
    axis = "Eigen::Vector3d" + numbers(entry["axis"])
    return f"{{{kind}, {axis}, {read}, {follows}, {ratio!r}, {offset!r}}}"


def transform(entry: dict[str, Any]) -> str:
    return "{" + numbers([0.0, *entry["xyz"], *roll_pitch_yaw(entry["quaternion"]), 0, 0, 0]) + "}"


def step(name: str) -> str:
    if name == "pose":
        return "{Step::Kind::pose}"
    kind = {"T": "transform", "J": "joint"}[name[0]]
    return f"{{Step::Kind::{kind}, {name[1:]}}}"


def loop(entry: dict[str, Any]) -> str:
    sides = [braced(step(each) for each in entry[side]) for side in ("left", "right")]
    return braced([*sides, "Compares::" + entry["compares"].replace(" ", "_"), "-1", "-1"])


def case(entry: dict[str, Any]) -> str:
    rows = "{" + ",\n".join(numbers(row) for row in entry["reduced_rows"]) + "}"
    pivots = braced(map(str, entry["pivot_columns"]))
    return braced([numbers(entry["pose"]), numbers(entry["joints"]), pivots, rows])


def leg(entry: dict[str, Any], first: bool) -> str:
    cases = entry["cases"][:1] if first else entry["cases"]
    name = f"{entry['name']}, {entry['note'].rstrip('.')}"
    fields = [
        f'"{name}"',
        f'"{entry["platform"]}"',
        braced(map(joint, entry["joints"])),
        braced(map(transform, entry["transforms"])),
        braced(map(loop, entry["loops"])),
        numbers(entry["home"]["pose"]),
        numbers(entry["home"]["joints"]),
        str(entry["counts"]["closures"]),
        braced(map(case, cases)),
    ]
    return "{" + ",\n".join(fields) + "}"


def main() -> None:
    legs = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["legs"]
    everything = "--all" in sys.argv
    chosen = [each for each in legs if everything or each["name"] in KEPT]
    text = ",\n".join(leg(each, not everything) for each in chosen)
    sys.stdout.write(
        HEADER + text + "};\n// clang-format on\n\n}  // namespace symkin::declared::reference\n"
    )


if __name__ == "__main__":
    main()
