# SPDX-License-Identifier: MIT
"""Writing mechanism files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from symkin.errors import SymkinError, known_extension
from symkin.files.declared_legs import PARTS
from symkin.files.mechanism_comments import with_comments
from symkin.files.mechanism_file import is_shipped, read_mechanism
from symkin.files.mechanism_schema import ends_of
from symkin.model.canonical import canonical
from symkin.model.chains import CURVATURE_TERMS
from symkin.model.declared import declared_chain, label_of
from symkin.model.devices import DEVICES, Device
from symkin.model.file_frames import (
    cartesian,
    drawn_frames,
    drawn_workspace,
    jacobian,
    point_parameters,
    split_covariance,
)
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.sensor_table import SensorTable
from symkin.model.settings import DeclaredSymmetry, Frames, MeasurementColumns, NoiseSettings
from symkin.model.symmetry import generate_legs, generate_orbits, verify_declared
from symkin.options import checks
from symkin.storage.output_files import OutputFiles
from symkin.storage.quantities import MOST, MOST_OF_DIRECTION
from symkin.storage.toml_file import read_toml, toml_key, toml_value

# Editors that know TOML look there for what a file may say.
SCHEMA_LINE = "#:schema mechanism.schema.json"

_Values = dict[str, Any]
_ROWS_IN_LINE = 4
_CHAIN_NOTE = "joints from base to platform, the actuated one in brackets"
_SI = "# Lengths are m and angles rad unless a unit is written."


@checks()
def save_mechanism(
    mechanism: MechanismGiven,
    path: str | os.PathLike[str],
    *,
    header: str = "",
    overwrite: bool = False,
) -> None:
    """Write a mechanism as a TOML file that reads back to the same mechanism.

    Points with negative radii are written as the same points with positive ones. The comments of
    the file that the mechanism was read from are carried over, unless it comes with symkin; one
    beside a value that has changed says of which value it was.

    Parameters
    ----------
    mechanism : Mechanism
        Its legs are listed in full, each parameter with its standard deviation if `deviations` has
        one, unless its symmetry generates exactly these legs.
    path : str or path
        The file to write.
    header : str
        Where the parameters come from; written as comments at the top.
    overwrite : bool
        Whether `path` may exist, be it the file that the mechanism was read from.

    Raises
    ------
    SymkinError
        If `path` exists without `overwrite`, if the declared symmetry does not hold, or if the file
        could not be read, as for a home pose out of reach.
    """
    mechanism = as_mechanism(mechanism)
    known_extension(Path(path), ".toml")
    with OutputFiles(overwrite=overwrite) as outputs:
        target = outputs.file(Path(path))
        text = _commented(mechanism_text(mechanism, header=header), mechanism.source)
        target.write_text(text, encoding="utf-8", newline="")
        try:
            read_mechanism(target)
        except SymkinError as error:
            reason = str(error).replace(str(target), str(path))
            raise SymkinError(f"a file of this mechanism could not be read: {reason}") from error


def can_be_read(mechanism: Mechanism) -> bool:
    """Whether a file of this mechanism would be one that can be used."""
    with TemporaryDirectory() as folder:
        try:
            save_mechanism(mechanism, Path(folder) / "robot.toml")
        except SymkinError:
            return False
    return True


def _commented(text: str, source: Path | None) -> str:
    """The text with the comments of the file that its mechanism was read from, if it still is."""
    if source is None or source.suffix != ".toml" or is_shipped(source):
        return text
    try:
        theirs, before = read_toml(source), read_mechanism(source)
    except SymkinError:
        return text
    references = _written_legs(before)[1]
    return with_comments(text, theirs, mechanism_text(before), references, (SCHEMA_LINE, _SI))


def mechanism_text(mechanism: Mechanism, *, header: str = "") -> str:
    """Return the text that `save_mechanism` writes."""
    values, signs = canonical(mechanism, mechanism.parameters)
    if (signs < 0).any():
        mechanism = mechanism.with_parameters(values, mechanism.deviations)
    if mechanism.symmetry is not None:
        verify_declared(mechanism)
    start = {
        "schema": 1,
        "name": mechanism.name,
        **({} if mechanism.mixed else {"chain": mechanism.chain}),
        "platform": mechanism.platform,
        "reading_unit": mechanism.step or mechanism.reading_unit,
        **({"reading_wraps": True} if mechanism.reading_wraps else {}),
    }
    notes = {"chain": _CHAIN_NOTE, "reading_unit": "of the sensors"}
    above = [f"# {line}".rstrip() for line in header.splitlines()]
    parts = ["\n".join([SCHEMA_LINE, *above, *(["#"] if above else []), _SI]) + "\n"]
    parts += [_section("", start, notes), *_declared(mechanism), *_legs(mechanism)]
    for name, (settings, units) in _settings(mechanism).items():
        if settings:
            parts.append(_section(f"[{name}]", settings, units))
    if mechanism.sensor_table is not None:
        parts.append(_sensor_table(mechanism.sensor_table, mechanism.reading_unit))
    return "\n".join(parts)


def _section(heading: str, values: _Values, notes: Mapping[str, str]) -> str:
    lines = [heading] if heading else []
    for name, value in values.items():
        note = f"  # {notes[name]}" if notes.get(name) else ""
        lines.append(f"{name} = {toml_value(value)}{note}")
    return "\n".join(lines) + "\n"


def _declared(mechanism: Mechanism) -> list[str]:
    """The chains that the file must declare."""
    sections = []
    found = [declared_chain(chain) for chain in mechanism.chains]
    for declared in {each.leg: each for each in found if each is not None}.values():
        lines = [f"[chains.{toml_key(declared.table_name)}]"]
        for name, value in declared.table.items():
            if name in PARTS:
                items = "".join(f"  {toml_value(each)},\n" for each in value)
                lines.append(f"{name} = [\n{items}]")
            else:
                lines.append(f"{name} = {toml_value(value)}")
        sections.append("\n".join(lines) + "\n")
    return sections


def _legs(mechanism: Mechanism) -> list[str]:
    """The symmetry, and one reference leg if it generates the others, else all legs."""
    sections = []
    if mechanism.symmetry is not None:
        declared = mechanism.symmetry
        values: _Values = {"group": declared.group, "legs": len(mechanism.legs)}
        if declared.direction is not None:
            values["axis"] = list(declared.direction)
        elif declared.axis:
            values["axis"] = declared.axis
        for name in ("mirror", "centre", "elements"):
            if (said := getattr(declared, name)) is not None:
                values[name] = list(said)
        units = {"centre": "m"} | ({"axis": "rad"} if declared.direction is None else {})
        sections = [_section("[symmetry]", values, units)]
    heading, written = _written_legs(mechanism)
    for leg in written:
        number = "" if heading == "[reference_leg]" else f"  # leg {leg + 1}"
        values, notes = _leg_values(mechanism, leg), _leg_notes(mechanism, leg)
        sections.append(_section(heading + number, values, notes))
    return sections


def _written_legs(mechanism: Mechanism) -> tuple[str, Sequence[int]]:
    """Those (from 0) from which the declared symmetry generates exactly the others, else all."""
    legs, symmetry, every = mechanism.legs, mechanism.symmetry, range(len(mechanism.legs))
    if symmetry is None or mechanism.deviations is not None or mechanism.curvature is not None:
        return "[[legs]]", every
    if not mechanism.mixed and _from_one(mechanism, symmetry) == list(legs):
        return "[reference_leg]", [0]
    references: list[int] = []
    made: list[Leg] = []
    while len(made) < len(legs):
        references.append(len(made))
        made += generate_orbits([legs[references[-1]]], symmetry, mechanism.platform)
    return ("[[reference_legs]]", references) if made == list(legs) else ("[[legs]]", every)


def _from_one(mechanism: Mechanism, symmetry: DeclaredSymmetry) -> list[Leg]:
    """What the symmetry makes of the first leg; nothing where it makes another number of them."""
    try:
        return generate_legs(mechanism.legs[0], symmetry, len(mechanism.legs))
    except SymkinError:
        return []


def _leg_notes(mechanism: Mechanism, leg: int) -> dict[str, str]:
    notes = dict(zip(mechanism.parameter_names, mechanism.parameter_units(leg), strict=True))
    for end in () if mechanism.points is None else mechanism.points.ends:
        notes[f"{end}_point"] = "m"
    return {**notes, "chain": _CHAIN_NOTE, "working_mode": mechanism.leg_info(leg).description}


def _leg_values(mechanism: Mechanism, leg: int) -> _Values:
    """The table of a leg (from 0), each standard deviation beside its parameter."""
    values: _Values = {"chain": label_of(mechanism.chains[leg])} if mechanism.mixed else {}
    values["working_mode"] = mechanism.legs[leg].working_mode
    ends = () if mechanism.points is None else mechanism.points.ends
    info, units = mechanism.leg_info(leg), mechanism.parameter_units(leg)
    drawn = {name: end for end in ends for name in point_parameters(info, end).values()}
    for index, name in enumerate(mechanism.parameter_names):
        if name not in info.parameter_names:
            continue
        if name in drawn:
            end = drawn[name]
            values.setdefault(f"{end}_point", _point(mechanism, leg, end))
            continue
        value: float | str = mechanism.legs[leg].parameters[name]
        if units[index] == "rad" and abs(float(value)) > MOST_OF_DIRECTION:
            value = f"{value!r} rad"  # without its unit a file with it would be refused
        values[name] = value
        if mechanism.deviations is not None and mechanism.deviations[leg, index] < MOST:
            deviation = float(mechanism.deviations[leg, index])
            values[name] = {"value": value, "standard_deviation": deviation}
    if mechanism.curvature is not None:
        curved = zip(CURVATURE_TERMS, mechanism.curvature[leg].tolist(), strict=True)
        values |= {name: value for name, value in curved if value}
    return values


def _point(mechanism: Mechanism, leg: int, end: str) -> Any:
    """A leg's point (leg from 0) in the file's frame, with the errors of its coordinates if known.

    Errors are carried over to first order.
    """
    drawn = mechanism.points
    assert drawn is not None
    names = ends_of(mechanism.leg_info(leg))[end]
    own = {kind: mechanism.legs[leg].parameters[name] for kind, name in names.items()}
    at = cartesian({kind: np.array(each) for kind, each in own.items()})
    point = (at + np.array(getattr(drawn, end))).tolist()
    if mechanism.deviations is None:
        return point
    columns = [mechanism.parameter_names.index(name) for name in names.values()]
    sigma = np.nan_to_num(mechanism.deviations[leg, columns])
    if not sigma.any():
        return point
    correlations = drawn.correlations.get(end)
    matrix = np.eye(len(names)) if correlations is None else np.array(correlations[leg])
    by_own = jacobian(own)
    deviations, correlation = split_covariance(
        by_own @ (matrix * np.outer(sigma, sigma)) @ by_own.T
    )
    upper = correlation[np.triu_indices(len(names), 1)]
    return {
        "value": point,
        "standard_deviation": deviations.tolist(),
        "correlation": upper.tolist(),
    }


def _settings(mechanism: Mechanism) -> dict[str, tuple[_Values, Mapping[str, str]]]:
    """The other sections with notes; one that the mechanism does not have is empty."""
    workspace: _Values = {}
    coordinates = mechanism.leg_info(0).box
    settings = drawn_workspace(mechanism)
    if settings is not None:
        free = mechanism.free
        bounds = ((settings.lower[each], settings.upper[each]) for each in free)
        workspace = dict(zip(coordinates, bounds, strict=True))
        others = asdict(settings)
        if settings.home is not None:
            others["home"] = tuple(settings.home[each] for each in free)
        names = ("home", "reach_margin", "conditioning_limit", "characteristic_length")
        workspace |= {name: others[name] for name in names if others[name] is not None}
    points, frames = mechanism.points, _given(drawn_frames(mechanism))
    for end in () if points is None else points.ends:
        frames[f"{end}_centre"] = getattr(points, end)
    unit, limits = mechanism.reading_unit, asdict(mechanism.joint_limits)
    unknown = dict(vars(mechanism.identification)) if mechanism.identification else {}
    assumed = unknown.pop("assume", None)
    return {
        "workspace": (
            workspace,
            coordinates
            | {"reach_margin": mechanism.space.closure_unit, "characteristic_length": "m"},
        ),
        "joint_limits": (
            {name: each for name, each in limits.items() if np.isfinite(each).any()},
            {"lower": unit, "upper": unit},
        ),
        "device": (_device(mechanism.device), {"kind": "symkin list --devices", "distance": "m"}),
        "noise": (
            _noise(mechanism.noise),
            {"position": "m, standard deviation", "orientation": "rad", "reading": unit},
        ),
        "tolerances": (
            asdict(mechanism.tolerances),
            {"length": "m, standard deviation", "angle": "rad", "gain": "of the gain"},
        ),
        "protocol": (asdict(mechanism.protocol), {"pose_count": "for each leg"}),
        "measurements": (_given(mechanism.measurement_columns), {}),
        "frames": (
            frames,
            {
                "base": "of the robot in the frame of the measuring device",
                "target": "in the platform's frame",
                "points": "in the platform's frame",
                "anchors": "in the frame of the measuring device",
                "zeros": "m, by how much more the distances are than is shown",
                "plane": "c0, c1, c2 of z = c0 + c1 x + c2 y; of a bowed bed: its bow, its radius",
                "base_centre": "m: of the parameters that base_point stands for",
                "platform_centre": "m: of those that platform_point stands for",
            },
        ),
        "identification": ({k: v for k, v in unknown.items() if v is not None}, {}),
        "assumed": (dict(assumed or {}), {}),
    }


def _noise(noise: NoiseSettings) -> dict[str, Any]:
    """What is said of it beside what is usual."""
    usual = {"per_metre": 0.0, "along": None, "along_per_metre": 0.0, "direction": "beam"}
    return {k: v for k, v in asdict(noise).items() if k not in usual or v != usual[k]}


def _device(device: Device | None) -> _Values:
    """What is not as the table of devices has it."""
    if device is None:
        return {}
    usual = DEVICES[device.kind]
    names = ("distance", "visit")
    own = {name: getattr(device, name) for name in names}
    changed = {name: value for name, value in own.items() if value != getattr(usual, name)}
    return {"kind": device.kind, **changed}


def _given(settings: Frames | MeasurementColumns | None) -> _Values:
    """What is said, but for the file that says it."""
    said = {} if settings is None else asdict(settings)
    return {name: each for name, each in said.items() if each and name != "source"}


def _sensor_table(table: SensorTable, unit: str) -> str:
    """The last section, since a table may be long; some rows in a line."""
    lines = [f"[sensor_table]  # {unit}: what the sensor shows, what a straight one would show"]
    legs = [
        [
            ", ".join(toml_value(row) for row in rows[start : start + _ROWS_IN_LINE]) + ","
            for start in range(0, len(rows), _ROWS_IN_LINE)
        ]
        for rows in table.legs
    ]
    if len(legs) == 1:
        return "\n".join([*lines, "rows = [", *legs[0], "]"]) + "\n"
    for leg in legs:
        leg[0], leg[-1] = f"[{leg[0]}", f"{leg[-1]}],"
    return "\n".join([*lines, "legs = [", *(line for leg in legs for line in leg), "]"]) + "\n"
