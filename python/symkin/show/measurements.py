# SPDX-License-Identifier: MIT
"""What was measured, of real and of simulated robots, and how devices stand to them."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.alignment import Alignment
from symkin.data.measurements import Measurements
from symkin.files.mechanism_file import typed_name
from symkin.model.poses import POSE_SPACES
from symkin.planning.accuracy import set_name
from symkin.planning.simulation import Simulation
from symkin.present import Group, Headline, Image, Page, Section, Table, page_of
from symkin.show.images import plotted
from symkin.show.units import on_paper
from symkin.show.wording import NONE, count, decimals_of, fixed, milli, plural, significant

_NAMES = ("x", "y", "z", "rx", "ry", "rz")

# Of which each number counts by itself.
_SINGLE = (
    "Distances",
    "Heights",
    "Turns",
    "Distances between rows",
    "Differences of height",
)


@page_of.register(Measurements)
def measurements_page(taken: Measurements) -> Page:
    """Count poses and readings, and show where the poses lie."""
    legs = range(taken.readings.shape[1])
    sets = np.unique(taken.leg_sets).tolist()
    read = np.isfinite(taken.readings)
    rows = [
        (f"leg {leg + 1}", count(int(read[:, leg].sum())), count(len(taken.rows_of(leg))))
        for leg in legs
    ]
    columns = ("Leg", "Readings", "Of them in its set")
    table = Table("Readings of every leg", columns, [Group(rows)], brief=True)
    whole, poses = taken.poses[_whole(taken)], _poses_image(taken)
    headlines = [
        ("Poses", count(len(taken.poses)), f"sets: {', '.join(map(set_name, sets))}"),
        ("Readings", count(int(read.sum())), f"of {count(len(legs))} legs"),
    ]
    headlines += _observed(taken)
    return Page(
        title=f"Measurements{' of ' + taken.named if taken.named else ''}",
        subtitle=f"{taken.pose_space} poses",
        headlines=headlines,
        sections=[
            Section("poses", "Measured poses", [], [table, poses] if len(whole) else [table])
        ],
    )


def _observed(taken: Measurements) -> list[Headline]:
    """How many there are of each kind of observation; nothing where all poses are whole."""
    whole = taken.poses[_whole(taken)]
    headlines = []
    for name, values in (
        ("Poses measured in full", None if len(whole) == len(taken.poses) else whole),
        ("Target points", taken.points),
        ("Distances", taken.distances),
        ("Heights", taken.heights),
        ("Attitudes", taken.attitudes),
        ("Turns", taken.turns),
        ("Distances between rows", taken.separations),
        ("Differences of height", taken.rises),
        ("Offsets between rows", taken.offsets),
        ("Reported poses", taken.reported),
    ):
        if values is not None:
            size = 1 if name in _SINGLE else values.shape[-1]
            seen = np.isfinite(values.reshape(-1, size)).any(axis=1)
            headlines.append((name, count(int(seen.sum())), ""))
    return headlines


def _whole(measurements: Measurements) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(measurements.poses).all(axis=1))


def _poses_image(measurements: Measurements) -> Image:
    """The poses measured in full."""
    whole = _whole(measurements)
    return Image(
        "poses",
        "Scatter plots of the measured poses.",
        "The measured poses." if whole.all() else "The poses measured in full.",
        plotted("poses", measurements.poses[whole], pose_space=measurements.pose_space),
    )


@page_of.register(Simulation)
def simulation_page(simulation: Simulation) -> Page:
    """Tell what was measured of a simulated robot."""
    replaced = simulation.replaced_by_set
    which = ", ".join(f"{name}: {number}" for name, number in replaced.items() if number)
    return Page(
        title=f"{simulation.nominal.name}: measurements of a simulated robot",
        headlines=[
            ("Poses measured", count(len(simulation.measurements.poses)), ""),
            ("Replaced by spares", count(sum(simulation.replaced)), which),
            *_observed(simulation.measurements),
        ],
        sections=[_unprinted(each) for each in measurements_page(simulation.measurements).sections],
        next_step="identify its parameters",
        next_command=f"symkin identify {typed_name(simulation.nominal)} "
        "{folder}/measurements.csv --out identified",
    )


def _unprinted(section: Section) -> Section:
    """The section, of which the command line prints no table."""
    parts = [
        dataclasses.replace(part, brief=False) if isinstance(part, Table) else part
        for part in section.parts
    ]
    return dataclasses.replace(section, parts=parts)


@page_of.register(Alignment)
def alignment_page(found: Alignment) -> Page:
    """Tell the frames, and how well they explain the poses."""
    space = POSE_SPACES[found.pose_space]
    headlines = []
    if space.moves:
        headlines.append(("Position left", milli(found.position_rms, "m"), "root mean square"))
    if space.turns:
        turned = milli(found.orientation_rms, "rad")
        headlines.append(("Orientation left", turned, "root mean square"))
    taken = f'measured poses taken "{found.convention}"'
    return Page(
        title=f"Alignment of frames over {plural(len(found.differences), 'pose')}",
        subtitle="" if found.convention == "as measured" else taken,
        headlines=headlines,
        verdict="good" if found.trustworthy else "doubtful",
        judgement="The frames explain the poses; nothing speaks against them."
        if found.trustworthy
        else "Frames were found, with doubts.",
        doubts=found.doubts,
        next_step="put them into the [frames] of the mechanism's file; symkin identify can refine "
        f"them with the geometry (--frames base,{'points' if found.frames.points else 'target'}).",
        sections=[_frames_section(found), _convention_section(found)],
    )


def _frames_section(found: Alignment) -> Section:
    space = POSE_SPACES[found.pose_space]
    names = [_NAMES[component] for component in space.frame_components]
    names = names if space.in_space else ["x", "y", "phi"]
    groups = []
    for title, values, deviations in (
        ("Base, in the frame of the measuring device", found.frames.base, found.base_deviations),
        ("Target, in the platform's frame", found.frames.target, found.target_deviations),
    ):
        rows = []
        if not values:
            continue
        for name, value, deviation in zip(names, values, deviations.tolist(), strict=True):
            factor, unit = on_paper("m" if name in ("x", "y", "z") else "rad")
            decimals = decimals_of(factor * deviation)
            rows.append(
                [name, unit, fixed(factor * value, decimals), significant(factor * deviation, 2)]
            )
        groups.append(Group(rows, title))
    if found.frames.points:
        factor, unit = on_paper("m")
        rows = [
            [f"point{number}.{axis}", unit, fixed(factor * value, decimals_of(factor * 1e-4)), NONE]
            for number, place in enumerate(found.frames.points, 1)
            for axis, value in zip(space.position, place, strict=True)
        ]
        groups.append(Group(rows, "Points, in the platform's frame"))
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
            milli(each.orientation_rms, "rad"),
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
