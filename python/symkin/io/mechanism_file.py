# SPDX-License-Identifier: MIT
"""Reading mechanism files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import symkin
from symkin.errors import MechanismFileError, did_you_mean, named_legs, printable
from symkin.io.column_mapping import check_columns, columns_of_section
from symkin.io.mechanism_schema import COORDINATES, MechanismHeader, mechanism_model
from symkin.io.toml_source import TomlSource, read_toml
from symkin.io.validation import validate
from symkin.mechanism import DeclaredSymmetry, Leg, Mechanism
from symkin.settings import (
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)
from symkin.symmetry import generate_legs, verify_declared

__all__ = ["load_mechanism", "shipped_mechanisms"]


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
    header = validate(source, MechanismHeader)
    model = source.call(
        ("chain",),
        lambda: mechanism_model(header.chain, header.platform, header.reading_unit),
    )
    file: Any = validate(source, model)
    legs, symmetry, deviations = _legs(source, file)
    mechanism = source.call(
        ("reference_leg",) if file.legs is None else ("legs",),
        lambda: Mechanism(
            file.name or printable(source.path.stem),
            legs,
            platform=file.platform,
            reading_unit=file.reading_unit,
            symmetry=symmetry,
            workspace=_workspace(file),
            noise=NoiseSettings(**dict(file.noise)),
            tolerances=Tolerances(**dict(file.tolerances)),
            protocol=ProtocolSettings(**dict(file.protocol)),
            joint_limits=_joint_limits(source, file),
            deviations=deviations,
            measurement_columns=_columns(source, file, len(legs)),
            source=source.path,
        ),
    )
    if symmetry is not None and require_symmetry:
        source.call(("symmetry",), lambda: verify_declared(mechanism))
    _check_home(source, mechanism)
    return mechanism


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
            "is neither a file nor a shipped mechanism"
            f"{did_you_mean(path.name, names)} (shipped: {', '.join(names)})",
            path,
        )
    return shipped


def _legs(
    source: TomlSource, file: Any
) -> tuple[list[Leg], DeclaredSymmetry | None, NDArray[np.float64] | None]:
    """The legs, the declared symmetry, and the standard deviations where the file has them."""
    if file.legs is None and file.reference_leg is None:
        raise source.error(("reference_leg",), "this table is missing, and so are [[legs]]")
    if file.legs is not None and file.reference_leg is not None:
        raise source.error(("reference_leg",), "stands beside [[legs]]; expected one of the two")
    symmetry = _symmetry(source, file)
    if file.reference_leg is None:
        return _listed_legs(file), symmetry, _deviations(file)
    if symmetry is None:
        raise source.error(("symmetry",), "this table is missing; it generates the other legs")
    count = file.symmetry.legs
    if count is None:
        raise source.error(("symmetry", "legs"), "this key is missing")
    reference = Leg(file.chain, *_parameters_and_mode(file.reference_leg))
    legs = source.call(("symmetry",), lambda: generate_legs(reference, symmetry, count))
    return list(legs), symmetry, None


def _symmetry(source: TomlSource, file: Any) -> DeclaredSymmetry | None:
    section = file.symmetry
    if section is None:
        return None
    elements = None if section.elements is None else tuple(section.elements)
    count = len(file.legs) if file.legs is not None else section.legs
    if file.legs is not None and section.legs not in (None, count):
        raise source.error(("symmetry", "legs"), f"is {section.legs}; the file lists {count} legs")
    if elements is not None:
        place, expected = ("symmetry", "elements"), [len(elements)]
    else:
        place, order = ("symmetry", "legs"), int(section.group[1:])
        expected = [order] if section.group[0] == "C" else [order, 2 * order]
    if count is not None and count not in expected:
        counts = " or ".join(map(str, expected))
        what = f"group {section.group} carries one leg to {counts} legs"
        if elements is not None:
            what = f"{counts} elements carry one leg to {counts} legs"
        raise source.error(place, f"{what}, but the mechanism has {count} legs")
    return source.call(
        ("symmetry",), lambda: DeclaredSymmetry(section.group, section.axis, elements)
    )


def _parameters_and_mode(leg: Any) -> tuple[dict[str, Any], int]:
    parameters = dict(leg)
    return parameters, parameters.pop("working_mode")


def _listed_legs(file: Any) -> list[Leg]:
    legs = []
    for listed in file.legs:
        estimates, mode = _parameters_and_mode(listed)
        values = {name: estimate.value for name, estimate in estimates.items()}
        legs.append(Leg(file.chain, values, mode))
    return legs


def _deviations(file: Any) -> NDArray[np.float64] | None:
    """Standard deviations, legs x p; NaN where not given, None where no parameter has one."""
    names = symkin.chain_info(file.chain, file.platform).parameter_names
    deviations = np.array(
        [[getattr(leg, name).standard_deviation for name in names] for leg in file.legs]
    )
    return None if np.isnan(deviations).all() else deviations


def _workspace(file: Any) -> WorkspaceSettings | None:
    section = file.workspace
    if section is None:
        return None
    pose_space = symkin.chain_info(file.chain, file.platform).pose_space
    bounds = [getattr(section, coordinate) for coordinate in COORDINATES[pose_space]]
    return WorkspaceSettings(
        lower=tuple(lower for lower, _ in bounds),
        upper=tuple(upper for _, upper in bounds),
        reach_margin=section.reach_margin,
        conditioning_limit=section.conditioning_limit,
        characteristic_length=section.characteristic_length,
        home=section.home,
    )


def _joint_limits(source: TomlSource, file: Any) -> JointLimits:
    section = file.joint_limits
    given = {name: value for name, value in dict(section).items() if value is not None}
    limits = JointLimits(**given)
    if not limits.lower < limits.upper:
        raise source.error(
            ("joint_limits", "lower"),
            f"is {limits.lower}; expected less than the upper limit, {limits.upper}",
        )
    return limits


def _columns(source: TomlSource, file: Any, leg_count: int) -> MeasurementColumns | None:
    if file.measurements is None:
        return None
    columns = columns_of_section(file.measurements)
    info = symkin.chain_info(file.chain, file.platform)
    reading_unit = file.reading_unit or info.reading_unit
    source.call(
        ("measurements",), lambda: check_columns(columns, info.pose_space, leg_count, reading_unit)
    )
    return columns


def _check_home(source: TomlSource, mechanism: Mechanism) -> None:
    """Refuse a home pose that a leg cannot reach, or where a joint is beyond its limits."""
    if mechanism.workspace is None:
        return
    readings = mechanism.inverse_kinematics(mechanism.home)[0]
    limits = mechanism.joint_limits
    given = mechanism.workspace.home or (0.0,) * len(mechanism.workspace.lower)
    described = "(" + ", ".join(f"{value:g}" for value in given) + ")"
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
