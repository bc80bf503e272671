# SPDX-License-Identifier: MIT
"""Writes the table of the page "Symmetry": the groups of every mechanism that comes with symkin.

Usage: .venv/bin/python docs/figures/groups.py
"""

from pathlib import Path

import symkin
from symkin.model.symmetry import compare_symmetry, symmetry_pairs
from symkin.model.symmetry.groups import mechanism_groups
from symkin.storage.shipped import shipped_files

FOLDER = Path(__file__).parent
HEADER = (
    "| mechanism | legs | $G_M$, in the paper | usually | with the working modes | $G_C$ | "
    "symmetries in all | keep the working modes |\n|---|---|---|---|---|---|---|---|\n"
)


def groups_of(path: Path) -> str:
    """A row of the table."""
    robot = symkin.load(path)
    structure, modes, observability = mechanism_groups(robot, compare_symmetry(robot).found)
    pairs = symmetry_pairs(robot)
    cells = (
        f"`{path.stem}`",
        len(robot.legs),
        structure.paper_name,
        structure.name,
        modes.name,
        observability.name,
        len(pairs.pairs),
        len(pairs.keep_modes),
    )
    return "| " + " | ".join(map(str, cells)) + " |\n"


def table() -> str:
    """The table, in Markdown."""
    return HEADER + "".join(map(groups_of, sorted(shipped_files().values())))


if __name__ == "__main__":
    (FOLDER / "groups.md").write_text(table(), encoding="utf-8")
