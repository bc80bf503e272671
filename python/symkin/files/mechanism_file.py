# SPDX-License-Identifier: MIT
"""Reading mechanism files."""

from __future__ import annotations

import dataclasses
import functools
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, overload

import numpy as np

from symkin.data.columns import check_columns
from symkin.data.sensor_tables import read_sensor_table
from symkin.errors import MechanismFileError, SymkinError, did_you_mean, named_legs, printable
from symkin.files.declared_legs import SECTIONS_OF_LEGS, with_declared_chains
from symkin.files.mechanism_schema import (
    ENDS,
    HEADER,
    MEASUREMENTS,
    ReadingUnit,
    covariance_of,
    ends_of,
    mechanism_table,
)
from symkin.model.chains import (
    CURVATURE_TERMS,
    ChainInfo,
    chain_info,
    common_reading_unit,
    require_mixable,
    union_of_names,
)
from symkin.model.devices import device_of, equipped
from symkin.model.file_frames import (
    centres,
    drawn_workspace,
    jacobian,
    own_frames,
    own_workspace,
    polar,
    split_covariance,
)
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.poses import POSE_SPACES
from symkin.model.sensor_table import SensorTable
from symkin.model.settings import (
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
from symkin.model.symmetry import generate_legs, generate_orbits, verify_declared
from symkin.model.symmetry.about_axis import declared_pairs
from symkin.options import checks
from symkin.shell import typed_word
from symkin.storage.shipped import shipped_files
from symkin.storage.toml_file import TomlSource, read_table, read_toml, table, text
from symkin.values import Array

_Values = dict[str, Any]
_Kind = TypeVar("_Kind", bound=Mechanism)
_WRITTEN = ("calibrated.toml", "mechanism.toml", "robot.toml")  # by commands, into their folders


@overload
def read_mechanism(
    path_or_name: str | os.PathLike[str], *, require_symmetry: bool = True
) -> Mechanism: ...


@overload
def read_mechanism(
    path_or_name: str | os.PathLike[str], kind: type[_Kind], *, require_symmetry: bool = True
) -> _Kind: ...


def read_mechanism(
    path_or_name: str | os.PathLike[str],
    kind: type[Mechanism] = Mechanism,
    *,
    require_symmetry: bool = True,
) -> Mechanism:
    """Return what `symkin.load_mechanism` does, as a mechanism of a kind."""
    source = with_declared_chains(read_toml(_located(path_or_name)))
    header = read_table(source, HEADER)
    stated: ReadingUnit | None = header.get("reading_unit")
    platform = header.get("platform", "rigid")
    chains = _chains(source, header, platform)
    kinds, noun = [chain_info(chain, platform) for chain in chains], _noun(header)
    reading = stated or ReadingUnit(
        source.call(("reading_unit",), lambda: common_reading_unit(kinds, noun))
    )
    used = tuple(dict.fromkeys(chains))
    file = read_table(source, mechanism_table(used, platform, reading.unit, header.get("chain")))
    section = _section_of_legs(source, file)
    entries = [file[section]] if section == "reference_leg" else file[section]
    infos = [chain_info(each["chain"], platform) for each in entries]
    entries, points = _points(source, section, entries, infos, file.get("frames", {}))
    legs, symmetry, deviations, curvature = _legs(source, file, section, entries, infos)
    info = infos[0]  # they agree in what follows
    read = sum(chain_info(leg.chain, platform).read for leg in legs)
    workspace, frames, points = _placed(source, file, info, points)
    measured = _measured(source, file, info, frames)
    mechanism = source.call(
        (section,),
        lambda: kind(
            file.get("name") or printable(source.path.stem),
            legs,
            platform=platform,
            reading_unit=reading.unit,
            reading_step=reading.step,
            reading_wraps=header.get("reading_wraps", False),
            symmetry=symmetry,
            workspace=workspace,
            tolerances=Tolerances(**file.get("tolerances", {})),
            protocol=ProtocolSettings(**file.get("protocol", {})),
            joint_limits=_joint_limits(source, file, read),
            deviations=deviations,
            measurement_columns=_columns(source, file, info.pose_space, read, reading.unit),
            source=source.path,
            frames=frames,
            curvature=curvature,
            points=points,
            sensor_table=_sensor_table(source, file, len(legs), reading),
            **measured,
        ),
    )
    if symmetry is not None and require_symmetry:
        source.call(("symmetry",), lambda: verify_declared(mechanism))
    _check_home(source, mechanism)
    return mechanism


@checks()
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
    if not {"chain", *SECTIONS_OF_LEGS} & set(source.values):
        alone = table({"measurements": MEASUREMENTS}, ("measurements",))
        return dataclasses.replace(
            _mapping(read_table(source, alone)["measurements"]), source=Path(path)
        )
    if "measurements" not in source.values:
        raise source.error(("measurements",), "this mechanism file has no such section")
    mapping = _mapping(read_table(source, MEASUREMENTS, ("measurements",)))
    return dataclasses.replace(mapping, source=Path(path))


def shipped_mechanisms() -> list[str]:
    """Return the names of the mechanisms that come with symkin.

    Returns
    -------
    list of str
    """
    return sorted(shipped_files())


def is_shipped(path: Path) -> bool:
    """Whether a file is one of those that come with symkin."""
    return path == shipped_files().get(path.stem)


def _located(path_or_name: str | os.PathLike[str]) -> Path:
    path = Path(path_or_name)
    # A folder is no mechanism, so one with the name of a shipped mechanism does not hide it, not
    # even with the slash that completion adds.
    is_name = path.name == os.fspath(path_or_name).rstrip(os.sep) and path.suffix != ".toml"
    exists = os.path.exists(path)  # noqa: PTH110  # for any name, unlike Path.exists
    is_folder = exists and path.is_dir()
    names = shipped_mechanisms()
    if is_folder and not (is_name and path.name in names):
        raise MechanismFileError(f"is a folder; expected a mechanism file{_within(path)}", path)
    if not is_name or (exists and not is_folder):
        return path
    shipped = shipped_files().get(path.name)
    if shipped is None:
        raise MechanismFileError(
            "is neither a file nor a shipped mechanism (see `symkin list`)"
            f"{did_you_mean(path.name, names)}",
            path,
        )
    return shipped


def _within(folder: Path) -> str:
    """Which file in a folder may be meant, after a sentence."""
    found = (folder / name for name in _WRITTEN if (folder / name).is_file())
    return "".join(f'; did you mean "{each}"?' for each in (*found,)[:1])


def _chains(source: TomlSource, header: _Values, platform: str) -> tuple[str, ...]:
    """The chain of each leg that is described, its own or the one at the top of the file."""
    default = header.get("chain")
    if default is not None:
        source.call(("chain",), lambda: chain_info(default, platform))
    found: list[str] = []
    for section in SECTIONS_OF_LEGS:
        listed = header.get(section, [])
        legs = listed if isinstance(listed, list) else [listed]
        named = [isinstance(leg, dict) and "chain" in leg for leg in legs]
        for number, leg in enumerate(legs):
            place = (section, number, "chain") if isinstance(listed, list) else (section, "chain")
            if named[number]:
                chain = source.call(place, functools.partial(text().read, leg["chain"]))
                source.call(place, functools.partial(chain_info, chain, platform))
                found.append(chain)
            elif default is not None:
                found.append(default)
            elif any(named):
                raise source.error(place, "this key is missing, as there is no chain at the top")
    if not found and default is None:
        raise source.error(("chain",), "this key is missing")
    infos = [chain_info(chain, platform) for chain in found]
    if infos:
        section = next(each for each in SECTIONS_OF_LEGS if each in header)
        source.call((section,), lambda: require_mixable(infos, _noun(header)))
    return tuple(found) or (str(default),)


def _noun(header: _Values) -> str:
    return "reference leg" if "reference_legs" in header else "leg"


def _section_of_legs(source: TomlSource, file: _Values) -> str:
    """Which describes the legs; refuse a file with none, or with two of them."""
    given = [section for section in SECTIONS_OF_LEGS if section in file]
    if not given:
        raise source.error(("reference_leg",), "this table is missing, and so are [[legs]]")
    if len(given) > 1:
        named = {"reference_leg": "[reference_leg]"}
        other = named.get(given[1], f"[[{given[1]}]]")
        raise source.error((given[0],), f"stands beside {other}; expected one of the two")
    return given[0]


def _legs(
    source: TomlSource,
    file: _Values,
    section: str,
    entries: list[_Values],
    infos: Sequence[ChainInfo],
) -> tuple[list[Leg], DeclaredSymmetry | None, Array | None, Array | None]:
    """The legs, the declared symmetry, and where the file has them deviations and curvature."""
    in_space = all(POSE_SPACES[info.pose_space].in_space for info in infos)
    symmetry = _symmetry(source, file, in_space=in_space)
    platform = file.get("platform", "rigid")
    described = []
    for entry, info in zip(entries, infos, strict=True):
        given = {name: entry[name] for name in info.parameter_names if name in entry}
        if section == "legs":  # which has values with standard deviations
            given = {name: value for name, (value, _) in given.items()}
        described.append(Leg(info.name, given, entry.get("working_mode", -1)))
    if section == "legs":
        unknown, names = (math.nan, math.nan), union_of_names(infos)
        deviations = np.array([[leg.get(name, unknown)[1] for name in names] for leg in entries])
        curvature = np.array([[leg.get(e, 0.0) for e in CURVATURE_TERMS] for leg in entries])
        return described, symmetry, None if np.isnan(deviations).all() else deviations, curvature
    if symmetry is None:
        raise source.error(("symmetry",), "this table is missing; it generates the other legs")
    count = file["symmetry"].get("legs")
    if section == "reference_legs":
        legs = source.call((section,), lambda: generate_orbits(described, symmetry, platform))
        if count not in (None, len(legs)):
            raise source.error(
                ("symmetry", "legs"), f"is {count}; the reference legs have {len(legs)} images"
            )
        return legs, symmetry, None, None
    if count is None:
        raise source.error(("symmetry", "legs"), "this key is missing")
    legs = source.call(("symmetry",), lambda: generate_legs(described[0], symmetry, count))
    return legs, symmetry, None, None


def _symmetry(source: TomlSource, file: _Values, *, in_space: bool) -> DeclaredSymmetry | None:
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
    # Of several orbits each has as many legs as it has images.
    if "reference_leg" in file and count is not None and count not in expected:
        counts = " or ".join(map(str, expected))
        what = f"group {group} carries one leg to {counts} legs"
        if elements is not None:
            what = f"{counts} elements carry one leg to {counts} legs"
        raise source.error(place, f"{what}, but the mechanism has {count} legs")
    named = None if elements is None else tuple(elements)
    axis = section.get("axis", 0.0)
    direction = axis if isinstance(axis, tuple) else None
    angle = 0.0 if isinstance(axis, tuple) else axis
    about = direction, section.get("mirror"), section.get("centre")
    made = source.call(("symmetry",), lambda: DeclaredSymmetry(group, angle, named, *about))
    if not made.about_z:
        given = next(key for key in ("axis", "mirror", "centre") if key in section)
        if not in_space:
            raise source.error(
                ("symmetry", given), "is of three numbers; in the plane all symmetries are about Z"
            )
        source.call(("symmetry",), lambda: declared_pairs(made))
    return made


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
    source: TomlSource, file: _Values, info: ChainInfo, points: DrawnPoints | None
) -> tuple[WorkspaceSettings | None, Frames | None, DrawnPoints | None]:
    """Workspace and frames in the mechanism's own frames, and how the file has the first."""
    pose_space = info.pose_space
    workspace = _workspace(file, info)
    section = dict(file.get("frames", {}))
    for end in ("base", "platform"):
        section.pop(f"{end}_centre", None)
    try:
        frames = Frames(**section) if section else None
    except SymkinError as error:
        raise source.error(("frames", "zeros"), str(error)) from None
    if points is None:
        return workspace, frames, None
    points = dataclasses.replace(points, workspace=workspace if points.moved else None)
    return (
        own_workspace(pose_space, workspace, points),
        own_frames(pose_space, frames or Frames(), points),
        points,
    )


def _measured(source: TomlSource, file: _Values, info: ChainInfo, frames: Frames | None) -> _Values:
    """Noise and unknowns as the file has them, and where it has none as its device does."""
    noise, unknown = file.get("noise", {}), dict(file.get("identification", {}))
    if "assumed" in file:
        unknown["assume"] = file["assumed"]
    identification = IdentificationSettings(**unknown) if unknown else None
    if "device" not in file:
        return {"noise": NoiseSettings(**noise), "identification": identification}

    def made() -> _Values:
        others = dict(file["device"])
        device = dataclasses.replace(device_of(others.pop("kind")), **others)
        space = POSE_SPACES[info.pose_space]
        return equipped(device, space, noise, identification, frames)

    return source.call(("device", "kind"), made)


def _points(
    source: TomlSource,
    section: str,
    legs: list[_Values],
    infos: Sequence[ChainInfo],
    frames: _Values,
) -> tuple[list[_Values], DrawnPoints | None]:
    """The tables of legs with all points by parameters, and in which frames they were given.

    Legs of the section "legs" have values with standard deviations; `frames` is the section with
    the centres.
    """
    listed = section == "legs"
    ends = {
        end: [ends_of(info).get(end, {}) for info in infos]
        for end in ENDS
        if any(f"{end}_point" in leg for leg in legs)
    }
    given = {end: frames.get(f"{end}_centre") for end in ENDS}
    for end, centre in given.items():
        if centre is not None:
            _require_points(source, end, centre, ends.get(end, []), infos)
    if not ends:
        return legs, None
    for end, names in ends.items():
        _require_everywhere(source, section, legs, end, names)
    points = {}
    for end, names in ends.items():
        missing = {"value": [np.nan] * max(map(len, names))}
        points[end] = np.array([leg.get(f"{end}_point", missing)["value"] for leg in legs])
    # A guide is given about the origin, and points beside it are too.
    about = {
        end: np.zeros(each.shape[1])
        for end, each in points.items()
        if not listed or np.isnan(each).any()
    }
    about |= {end: np.array(given[end]) for end in ends if given[end] is not None}
    if len(about) < len(ends):
        known = [
            {name: leg[name][0] for name in info.parameter_names if name in leg}
            for leg, info in zip(legs, infos, strict=True)
        ]
        about = centres(infos, known, [leg.get("working_mode", -1) for leg in legs], points, about)
    made = [
        {name: value for name, value in leg.items() if not name.endswith("_point")} for leg in legs
    ]
    correlations = {}
    for end, names in ends.items():
        matrices = []
        for number, (leg, own) in enumerate(zip(legs, names, strict=True)):
            place = points[end][number] - about[end]
            values, matrix = _parameters_of_point(place, leg.get(f"{end}_point"), own)
            made[number] |= values if listed else {n: value for n, (value, _) in values.items()}
            matrices.append(matrix)
        if any(np.any(matrix != np.eye(len(matrix))) for matrix in matrices):
            correlations[end] = tuple(tuple(map(tuple, matrix.tolist())) for matrix in matrices)
    base, platform = (tuple(about[end].tolist()) if end in about else None for end in ENDS)
    return made, DrawnPoints(base, platform, correlations=correlations)


def _parameters_of_point(
    place: Array, said: _Values | None, names: Mapping[str, str]
) -> tuple[dict[str, tuple[float, float]], Array]:
    """Parameters with their deviations, and how these are correlated; of a guide none."""
    if not names or said is None:
        return {}, np.empty((0, 0))
    own = {kind: float(each) for kind, each in polar(place, names).items()}
    deviations, matrix = _errors_of_parameters(own, said)
    beside = zip(names.items(), deviations, strict=True)
    return {name: (own[kind], deviation) for (kind, name), deviation in beside}, matrix


def _require_points(
    source: TomlSource,
    end: str,
    centre: Sequence[float],
    names: Sequence[Mapping[str, str]],
    infos: Sequence[ChainInfo],
) -> None:
    """Refuse a centre about which nothing is given, or a guide beside it."""
    keys = ("frames", f"{end}_centre")
    if not names:
        raise source.error(keys, f"goes with {end}_point, which no leg has")
    if any(centre) and not all(names):
        guide = next(number for number, each in enumerate(names) if not each)
        raise source.error(
            keys,
            f"goes with legs whose {end} ends are all points; leg {guide + 1} "
            f"({infos[guide].name}) has a guide, which is given about the origin as the others are",
        )


def _require_everywhere(
    source: TomlSource,
    section: str,
    legs: list[_Values],
    end: str,
    names: Sequence[Mapping[str, str]],
) -> None:
    """Refuse legs some of which give a point by coordinates and some not."""
    drawn = [f"{end}_point" in leg for leg in legs]
    for number, (has, own) in enumerate(zip(drawn, names, strict=True)):
        if own and not has:
            raise source.error(
                (section, number, own["radius"]),
                f"leg {drawn.index(True) + 1} has {end}_point; expected it in every leg, or in "
                "none",
            )


def _errors_of_parameters(values: _Values, point: _Values) -> tuple[Array, Array]:
    """Standard deviations and correlations of a point's parameters by those of its coordinates."""
    size = len(values)
    if "standard_deviation" not in point:
        return np.full(size, np.nan), np.eye(size)
    covariance = covariance_of(point["standard_deviation"], point.get("correlation", ()))
    inverse = np.linalg.pinv(jacobian(values))
    return split_covariance(inverse @ covariance @ inverse.T)


def _joint_limits(source: TomlSource, file: _Values, legs: int) -> JointLimits:
    section = file.get("joint_limits", {})
    limits = JointLimits(**section)
    source.call(("joint_limits", *section)[:2], lambda: limits.of_legs(legs))
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
    settings = drawn_workspace(mechanism) or mechanism.workspace
    given = settings.home_or_origin
    described = "(" + ", ".join(f"{given[each]:g}" for each in mechanism.free) + ")"
    if np.isnan(readings).any():
        legs = named_legs(np.flatnonzero(np.isnan(readings)))
        raise source.error(
            ("workspace", "home"),
            f"the home pose {described} is beyond the reach of {legs}"
            + _home_in_box(mechanism, settings),
        )
    outside = ~mechanism.within_limits(readings)
    if outside.any():
        legs = named_legs(np.flatnonzero(outside))
        raise source.error(
            ("joint_limits",), f"at the home pose {described} they are exceeded by {legs}"
        )


def _home_in_box(mechanism: Mechanism, drawn: WorkspaceSettings) -> str:
    """What to write for a home that was left out, where the middle of the box can be reached."""
    if drawn.home is not None or drawn != mechanism.workspace:
        return ""
    middle = (np.array(drawn.lower) + np.array(drawn.upper)) / 2
    if np.isnan(mechanism.inverse_kinematics(mechanism.poses_at(middle))[0]).any():
        return ""
    written = ", ".join(f"{each:.4g}" for each in middle)
    return f"; the middle of the box is not: write home = [{written}]"


def typed_name(mechanism: Mechanism) -> str:
    """What a command line takes for a mechanism; ``MECHANISM`` if it comes from no file.

    With the options that say what measures it, how well, in which columns, and what its sensors
    show, where that is not as the file has it.
    """
    source = mechanism.source
    if source is None:
        return "MECHANISM"
    name = source.stem
    typed = typed_word(name if is_shipped(source) else source)
    device = mechanism.device
    try:
        drawn = read_mechanism(source, require_symmetry=False)
    except MechanismFileError:  # as of a result that was loaded on another machine
        return typed
    if device is not None and device != drawn.device:
        typed += f" --device-kind {typed_word(device.kind)}"
        drawn = drawn.with_device(device)
    for kind, value in mechanism.noise.deviations.items():
        if value != getattr(drawn.noise, kind):
            typed += f" --noise {kind}={value:g}"
    columns = mechanism.measurement_columns
    if columns is not None and columns.source and columns != drawn.measurement_columns:
        typed += f" --columns {typed_word(columns.source)}"
    table = mechanism.sensor_table
    if table is not None and table.source and table != drawn.sensor_table:
        typed += f" --sensor-table {typed_word(table.source)}"
    return typed
