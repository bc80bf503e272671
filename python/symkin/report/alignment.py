# SPDX-License-Identifier: MIT
"""Where a measuring device stands, and what it measures."""

from __future__ import annotations

import numpy as np

from symkin.alignment import Alignment
from symkin.poses import POSE_SPACES
from symkin.report.content import Group, Page, Section, Table, Verdict
from symkin.report.wording import decimals_of, fixed, milli, plural, significant

__all__ = ["alignment_page"]

_NAMES = ("x", "y", "z", "rx", "ry", "rz")


def alignment_page(found: Alignment) -> Page:
    """Tell the frames, and how well they explain the poses."""
    verdict: Verdict = "good" if found.trustworthy else "doubtful"
    space = POSE_SPACES[found.pose_space]
    headlines = []
    if space.moves:
        headlines.append(("Position left", milli(found.position_rms, "m"), "root mean square"))
    if space.turns:
        degrees = np.degrees(found.orientation_rms)
        headlines.append(
            ("Orientation left", f"{significant(degrees)}\N{DEGREE SIGN}", "root mean square")
        )
    return Page(
        title=f"Alignment of frames over {plural(len(found.differences), 'pose')}",
        subtitle=f'measured poses taken "{found.convention}"'
        if found.convention != "as measured"
        else "",
        headlines=headlines,
        verdict=verdict,
        judgement={
            "good": "The frames explain the poses; nothing speaks against them.",
            "doubtful": "Frames were found, with doubts.",
        }[verdict],
        doubts=found.doubts,
        next_step="put them into the [frames] of the mechanism's file; symkin identify can refine "
        "them with the geometry (--frames base,target).",
        sections=[_frames_section(found), _convention_section(found)],
    )


def _frames_section(found: Alignment) -> Section:
    space = POSE_SPACES[found.pose_space]
    names = [_NAMES[component] for component in space.frame_components]
    names = names if space.in_space else ["x", "y", "phi"]
    groups = [
        Group(
            [
                [
                    name,
                    "m" if name in ("x", "y", "z") else "rad",
                    fixed(value, decimals_of(deviation)),
                    significant(deviation, 2),
                ]
                for name, value, deviation in zip(names, values, deviations.tolist(), strict=True)
            ],
            title,
        )
        for title, values, deviations in (
            (
                "Base, in the frame of the measuring device",
                found.frames.base,
                found.base_deviations,
            ),
            ("Target, in the platform's frame", found.frames.target, found.target_deviations),
        )
    ]
    columns = ("", "Unit", "Value", "Standard deviation")
    table = Table("Frames", columns, groups, brief=True)
    words = (
        "Standard deviations follow from what is left, which holds the noise of the device and the "
        "errors of the robot alike."
    )
    return Section("frames", "Frames", [words], [table])


def _convention_section(found: Alignment) -> Section:
    moves = POSE_SPACES[found.pose_space].moves
    rows = [
        (
            each.convention,
            *([milli(each.position_rms, "m")] if moves else []),
            f"{significant(np.degrees(each.orientation_rms))}\N{DEGREE SIGN}",
        )
        for each in found.conventions
    ]
    position = ["Position left"] if moves else []
    columns = ("Measured poses taken", *position, "Orientation left")
    table = Table("Which convention fits", columns, [Group(rows)], brief=len(rows) > 1)
    words = (
        "Devices give the pose of the target in their frame, or the inverse; rotations either way "
        "round; quaternions with the scalar first or last. A wrong one leaves errors as large as "
        "the movements."
    )
    return Section("conventions", "Conventions", [words], [table])
