# SPDX-License-Identifier: MIT
"""Write reference_numbers.hpp from a JSON file of planar chains.

Usage: python make_reference_numbers.py planar_chains.json | clang-format > reference_numbers.hpp

The JSON file has, for each chain, ``parameters`` (name: value) and ``cases``; a case has a ``pose``
(x, y, phi), the ``roots`` (``psi``, ``dg_dparam``, ``dg_dpose``) and ``h_at_psi_0p5``. Metres and
radians. The first case of each chain is taken.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

# One entry of the file stands for each pair of chains that shares a closure.
TWINS = {"[P]PR": "P[P]R", "R[P]P": "RP[P]"}

HEADER = """\
// SPDX-License-Identifier: MIT
// Written by make_reference_numbers.py; do not edit.
#pragma once

#include <array>
#include <string>
#include <vector>

// Numbers that were made independently of this library, by another program: all readings psi that
// close the leg, found by a dense scan over psi and polished, with derivatives by automatic
// differentiation of the closure. Accurate to about 1e-12 relative. Metres and radians.
namespace symkin::reference {

struct Reading {
  double psi;
  std::vector<double> by_parameters;  // dg/dparam
  std::array<double, 3> by_pose;      // dg/d(x, y, phi)
};

struct Case {
  std::string chain;
  std::vector<std::string> parameter_names;
  std::vector<double> parameters;
  std::array<double, 3> pose;
  std::vector<Reading> readings;
  double closure_at_half;  // h at psi = 0.5
};

inline const std::vector<Case> cases = {
"""

FOOTER = """\
};

}  // namespace symkin::reference
"""


def braced(items: Iterable[str]) -> str:
    return "{" + ", ".join(items) + "}"


def numbers(values: Iterable[float]) -> str:
    return braced(repr(float(value)) for value in values)


def reading(root: dict[str, Any]) -> str:
    return f"{{{root['psi']!r},\n{numbers(root['dg_dparam'])},\n{numbers(root['dg_dpose'])}}}"


def case(chain: str, entry: dict[str, Any]) -> str:
    first = entry["cases"][0]
    return ",\n".join(
        [
            f'{{"{chain}"',
            braced(f'"{name}"' for name in entry["parameters"]),
            numbers(entry["parameters"].values()),
            numbers(first["pose"]),
            "{" + ",\n".join(reading(root) for root in first["roots"]) + "}",
            f"{first['h_at_psi_0p5']!r}}},\n",
        ]
    )


def main() -> None:
    chains = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    cases = []
    for chain, entry in chains.items():
        cases.append(case(chain, entry))
        if chain in TWINS:
            cases.append(case(TWINS[chain], entry))
    sys.stdout.write(HEADER + "".join(cases) + FOOTER)


if __name__ == "__main__":
    main()
