# SPDX-License-Identifier: MIT
"""Reading mechanism files."""

from __future__ import annotations

import dataclasses
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import symkin
from symkin.chains import ChainInfo, chain_info
from symkin.drawing import drawn_workspace, own_frames, own_workspace
from symkin.errors import MechanismFileError, did_you_mean, named_legs, printable
from symkin.io.columns import check_columns
from symkin.io.drawn_points import read_points
from symkin.io.kinds import read_table, table
from symkin.io.mechanism_schema import (
    HEADER,
    MEASUREMENTS,
    ReadingUnit,
    mechanism_table,
)
from symkin.io.sensor_tables import read_sensor_table
from symkin.io.toml_file import TomlSource, read_toml
from symkin.mechanism import Leg, Mechanism
from symkin.sensor_table import SensorTable
from symkin.settings import (
    DeclaredSymmetry,
    DrawnPoints,
    Frames,
    IdentificationSettings,
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)
from symkin.symmetry import generate_legs, verify_declared

__all__ = ["load", "load_columns", "load_mechanism", "shipped_mechanisms"]

_Values = dict[str, Any]


def load_mechanism(
    path_or_name: str | os.PathLike[str], *, require_symmetry: bool = True
) -> Mechanism:
    """Read a mechanism from a TOML file, or one of the shipped mechanisms by name.

    Parameters
    ----------
    path_or_name : str or path
        A file, or a name such as ``"3RRR"``; `shipped_mechanisms` lists them.
    require_symmetry : bool
        Whether legs that do not have the symmetry declared beside them are an error. Without,
        `check_mechanism` tells what breaks it.

    Returns
    -------
    Mechanism
        In SI units, with the settings of the file; its `source` is the file.

    Raises
    ------
    MechanismFileError
        With the file, the line and the key at fault, the expectation, and for a misspelt key the
        nearest valid one.
    """
    source = read_toml(_located(path_or_name))
    header = read_table(source, HEADER)
    stated: ReadingUnit | None = header.get("reading_unit")
    expected = source.call(
        ("chain",),
        lambda: mechanism_table(
            header["chain"], header.get("platform", "rigid"), stated.unit if stated else None
        ),
    )
    file = read_table(source, expected)
    info = chain_info(file["chain"], file.get("platform", "rigid"))
    reading = stated or ReadingUnit(info.reading_unit)
    _require_legs(source, file)
    file, points = read_points(source, file, info)
    legs, symmetry, deviations, curvature = _legs(source, file)
    workspace, frames, points = _placed(file, info, points)
    mechanism = source.call(
        ("reference_leg",) if "legs" not in file else ("legs",),
        lambda: Mechanism(
            file.get("name") or printable(source.path.stem),
            legs,
            platform=file.get("platform", "rigid"),
            reading_unit=reading.unit,
            reading_step=reading.step,
            symmetry=symmetry,
            workspace=workspace,
            noise=NoiseSettings(**file.get("noise", {})),
            tolerances=Tolerances(**file.get("tolerances", {})),
            protocol=ProtocolSettings(**file.get("protocol", {})),
            joint_limits=_joint_limits(source, file),
            deviations=deviations,
            measurement_columns=_columns(source, file, info.pose_space, len(legs), reading.unit),
            source=source.path,
            frames=frames,
            identification=_identification(file),
            curvature=curvature,
            points=points,
            sensor_table=_sensor_table(source, file, len(legs), reading),
        ),
    )
    if symmetry is not None and require_symmetry:
        source.call(("symmetry",), lambda: verify_declared(mechanism))
    _check_home(source, mechanism)
    return mechanism


load = load_mechanism


def load_columns(path: str | os.PathLike[str]) -> MeasurementColumns:
    """Read a column mapping: the ``[measurements]`` section of a TOML file.

    Parameters
    ----------
    path : str or path
        A file with this section alone, or a mechanism file.

    Returns
    -------
    MeasurementColumns

    Raises
    ------
    MechanismFileError
        With the file, the line and the key.
    """
    source = read_toml(Path(path))
    if "chain" not in source.values:
        alone = table({"measurements": MEASUREMENTS}, ("measurements",))
        return _mapping(read_table(source, alone)["measurements"])
    if "measurements" not in source.values:
        raise source.error(("measurements",), "this mechanism file has no such section")
    return _mapping(read_table(source, MEASUREMENTS, ("measurements",)))


def shipped_mechanisms() -> list[str]:
    """Return the names of the mechanisms that come with symkin.

    Returns
    -------
    list of str
    """
    return sorted(path.stem for path in _shipped_folder().glob("*.toml"))


def _shipped_folder() -> Path:
    package = Path(symkin.__file__).parent
    installed = package / "mechanisms"
    return installed if installed.is_dir() else package.parents[1] / "mechanisms"


def _located(path_or_name: str | os.PathLike[str]) -> Path:
    path = Path(path_or_name)
    # A folder is no mechanism, so one with the name of a shipped mechanism does not hide it, not
    # even with the slash that completion adds.
    is_name = path.name == os.fspath(path_or_name).rstrip(os.sep) and path.suffix != ".toml"
    exists = os.path.exists(path)  # noqa: PTH110  # for any name, unlike Path.exists
    if not is_name or (exists and not path.is_dir()):
        return path
    shipped = _shipped_folder() / f"{path}.toml"
    names = shipped_mechanisms()
    if shipped.stem not in names:
        raise MechanismFileError(
            "is neither a file nor a shipped mechanism (see `symkin list`)"
            f"{did_you_mean(path.name, names)}",
            path,
        )
    return shipped


def _identification(file: _Values) -> IdentificationSettings | None:
    section = file.get("identification")
    return IdentificationSettings(**section) if section else None


def _require_legs(source: TomlSource, file: _Values) -> None:
    """Refuse a file without legs, or with two descriptions of them."""
    listed, reference = "legs" in file, "reference_leg" in file
    if not listed and not reference:
        raise source.error(("reference_leg",), "this table is missing, and so are [[legs]]")
    if listed and reference:
        raise source.error(("reference_leg",), "stands beside [[legs]]; expected one of the two")


def _legs(
    source: TomlSource, file: _Values
) -> tuple[
    list[Leg], DeclaredSymmetry | None, NDArray[np.float64] | None, NDArray[np.float64] | None
]:
    """The legs, the declared symmetry, and where the file has them deviations and curvature."""
    chain, reference, listed = file["chain"], file.get("reference_leg"), file.get("legs")
    symmetry = _symmetry(source, file)
    if listed is not None:
        names = chain_info(chain, file.get("platform", "rigid")).parameter_names
        legs = [
            Leg(
                chain,
                {name: leg[name][0] for name in names if name in leg},
                leg.get("working_mode", -1),
            )
            for leg in listed
        ]
        unknown = math.nan, math.nan
        deviations = np.array([[leg.get(name, unknown)[1] for name in names] for leg in listed])
        terms = ("sensor_quadratic", "sensor_cosine", "sensor_sine")
        curvature = np.array([[leg.get(term, 0.0) for term in terms] for leg in listed])
        return legs, symmetry, None if np.isnan(deviations).all() else deviations, curvature
    if symmetry is None:
        raise source.error(("symmetry",), "this table is missing; it generates the other legs")
    if "legs" not in file["symmetry"]:
        raise source.error(("symmetry", "legs"), "this key is missing")
    parameters = dict(reference or {})
    first = Leg(chain, parameters, parameters.pop("working_mode", -1))
    count = file["symmetry"]["legs"]
    legs = list(source.call(("symmetry",), lambda: generate_legs(first, symmetry, count)))
    return legs, symmetry, None, None


def _symmetry(source: TomlSource, file: _Values) -> DeclaredSymmetry | None:
    section = file.get("symmetry")
    if section is None:
        return None
    group, elements = section["group"], section.get("elements")
    count = len(file["legs"]) if "legs" in file else section.get("legs")
    if "legs" in file and section.get("legs") not in (None, count):
        legs = section["legs"]
        raise source.error(("symmetry", "legs"), f"is {legs}; the file lists {count} legs")
    if elements is not None:
        place, expected = ("symmetry", "elements"), [len(elements)]
    else:
        place, order = ("symmetry", "legs"), int(group[1:])
        expected = [order] if group[0] == "C" else [order, 2 * order]
    if count is not None and count not in expected:
        counts = " or ".join(map(str, expected))
        what = f"group {group} carries one leg to {counts} legs"
        if elements is not None:
            what = f"{counts} elements carry one leg to {counts} legs"
        raise source.error(place, f"{what}, but the mechanism has {count} legs")
    named = None if elements is None else tuple(elements)
    return source.call(
        ("symmetry",), lambda: DeclaredSymmetry(group, section.get("axis", 0.0), named)
    )


def _workspace(file: _Values, info: ChainInfo) -> WorkspaceSettings | None:
    if "workspace" not in file:
        return None
    others = dict(file["workspace"])
    bounds = [others.pop(coordinate) for coordinate in info.box]
    lower, upper = (info.whole(each) for each in zip(*bounds, strict=True))
    if "home" in others:
        others["home"] = info.whole(others["home"])
    return WorkspaceSettings(lower, upper, **others)


def _placed(
    file: _Values, info: ChainInfo, points: DrawnPoints | None
) -> tuple[WorkspaceSettings | None, Frames | None, DrawnPoints | None]:
    """Workspace and frames in the mechanism's own frames, and how the file has the first."""
    pose_space = info.pose_space
    workspace = _workspace(file, info)
    section = dict(file.get("frames", {}))
    for end in ("base", "platform"):
        section.pop(f"{end}_centre", None)
    frames = Frames(**section) if section else None
    if points is None:
        return workspace, frames, None
    points = dataclasses.replace(points, workspace=workspace if points.moved else None)
    return (
        own_workspace(pose_space, workspace, points),
        own_frames(pose_space, frames or Frames(), points),
        points,
    )


def _joint_limits(source: TomlSource, file: _Values) -> JointLimits:
    limits = JointLimits(**file.get("joint_limits", {}))
    if not limits.lower < limits.upper:
        raise source.error(
            ("joint_limits", "lower"),
            f"is {limits.lower}; expected less than the upper limit, {limits.upper}",
        )
    return limits


def _sensor_table(
    source: TomlSource, file: _Values, leg_count: int, reading: ReadingUnit
) -> SensorTable | None:
    """The table in the file, or in one beside it."""
    section = file.get("sensor_table")
    if section is None:
        return None
    if len(section) != 1:
        raise source.error(
            ("sensor_table",),
            f"has {' and '.join(section) or 'no key'}; expected one of file, rows and legs",
        )
    if "file" in section:
        step = "" if reading.step is None else f"{reading.step!r} {reading.unit}/step"
        return source.call(
            ("sensor_table", "file"),
            lambda: read_sensor_table(
                source.path.parent / section["file"],
                legs=leg_count,
                reading_unit=reading.unit,
                step=step,
            ),
        )

    def made() -> SensorTable:
        table = SensorTable(section.get("legs") or (section["rows"],))
        table.require_legs(leg_count)
        return table

    return source.call(("sensor_table", *section), made)


def _columns(
    source: TomlSource, file: _Values, pose_space: str, leg_count: int, reading_unit: str
) -> MeasurementColumns | None:
    if "measurements" not in file:
        return None
    columns = _mapping(file["measurements"])
    source.call(
        ("measurements",), lambda: check_columns(columns, pose_space, leg_count, reading_unit)
    )
    return columns


def _mapping(section: _Values) -> MeasurementColumns:
    values: _Values = {"position": ()}
    values |= {
        name: tuple(value) if isinstance(value, list) else value for name, value in section.items()
    }
    return MeasurementColumns(**values)


def _check_home(source: TomlSource, mechanism: Mechanism) -> None:
    """Refuse a home pose that a leg cannot reach, or where a joint is beyond its limits."""
    if mechanism.workspace is None:
        return
    readings = mechanism.inverse_kinematics(mechanism.home)[0]
    limits = mechanism.joint_limits
    settings = drawn_workspace(mechanism) or mechanism.workspace
    given = settings.home or (0.0,) * len(settings.lower)
    described = "(" + ", ".join(f"{given[each]:g}" for each in mechanism.free) + ")"
    if np.isnan(readings).any():
        legs = named_legs(np.flatnonzero(np.isnan(readings)))
        raise source.error(
            ("workspace", "home"), f"the home pose {described} is beyond the reach of {legs}"
        )
    outside = (readings < limits.lower) | (readings > limits.upper)
    if outside.any():
        legs = named_legs(np.flatnonzero(outside))
        raise source.error(
            ("joint_limits",),
            f"at the home pose {described} they are exceeded by {legs}",
        )
