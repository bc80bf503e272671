# SPDX-License-Identifier: MIT
"""What a mechanism file may say, as pydantic models.

The keys of a leg and of the workspace depend on the chain, so the model of a whole file is made for
one chain, platform and reading unit.
"""

from __future__ import annotations

import functools
import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, create_model

from symkin.errors import printable
from symkin.io.quantity_fields import (
    Estimate,
    EstimateOf,
    IntervalOf,
    Quantity,
    QuantityList,
    Sign,
)
from symkin.io.validation import Section

__all__ = [
    "COORDINATES",
    "MappingFile",
    "MeasurementSection",
    "MechanismHeader",
    "SymmetrySection",
    "mechanism_model",
]

# Coordinates of bounds and home, position then orientation, and their units.
COORDINATES: dict[str, dict[str, str]] = {
    "planar": {"x": "m", "y": "m", "phi": "rad"},
    "point": {"x": "m", "y": "m"},
    "spatial": {"x": "m", "y": "m", "z": "m", "rx": "rad", "ry": "rad", "rz": "rad"},
}
# More would be slow beyond use, and no such mechanism is known.
_MOST_LEGS = 64
_LegCount = Annotated[int, Field(strict=True, ge=1, le=_MOST_LEGS)]


def _check_plain(value: object) -> object:
    """TOML's true and 1.0 equal 1, but are not meant."""
    if isinstance(value, bool | float):
        raise ValueError(f"is {str(value).lower()}; expected a whole number")
    return value


_WholeNumber = BeforeValidator(_check_plain)


def _check_name(name: str) -> str:
    if not name.isprintable():
        raise ValueError(f"is {printable(name)!r}; expected characters that can be printed")
    return name


def _check_group(group: str) -> str:
    number = re.fullmatch("[CD]([1-9][0-9]*)", group, re.ASCII)
    if not number:
        raise ValueError(
            f'is "{group}"; expected C (rotations) or D (rotations and reflections) and the number '
            'of rotations, such as "C3" or "D3"'
        )
    if len(number[1]) > len(str(_MOST_LEGS)) or int(number[1]) > _MOST_LEGS:
        raise ValueError(f'is "{group}"; expected at most {_MOST_LEGS} rotations')
    return group


class SymmetrySection(Section):
    """The group that carries the reference leg to all legs."""

    group: Annotated[str, AfterValidator(_check_group)]
    legs: _LegCount | None = None
    axis: Annotated[float, Quantity("rad", direction=True)] = 0.0
    elements: list[str] | None = None


class ToleranceSection(Section):
    """Manufacturing standard deviations; the gain's is relative to the gain."""

    length: Annotated[float, Quantity("m", "positive")] = 1e-3
    angle: Annotated[float, Quantity("rad", "positive")] = 1e-3
    gain: Annotated[float, Quantity("1", "positive")] = 1e-3


class NoiseSection(Section):
    """Measurement standard deviations; the reading's is added per file, in the reading's unit."""

    position: Annotated[float, Quantity("m", "not negative")] = 1e-4
    orientation: Annotated[float, Quantity("rad", "not negative")] = 1e-4


class ProtocolSection(Section):
    """Defaults of the protocol."""

    pose_count: Annotated[int, Field(strict=True, ge=1, le=10**6)] = 24
    candidates: Annotated[int, Field(strict=True, ge=1, le=10**7)] = 30000
    seed: Annotated[int, Field(strict=True, ge=0, le=2**63 - 1)] = 1


class MeasurementSection(Section):
    """Which columns of a measurement table hold what."""

    position: list[str]
    readings: list[str]
    angle: str | None = None
    quaternion: list[str] | None = None
    rotation_vector: list[str] | None = None
    position_unit: str | None = None
    orientation_unit: str | None = None
    reading_unit: str | None = None
    leg: str | None = None


class MappingFile(Section):
    """A column mapping in a file of its own."""

    measurements: MeasurementSection


class WorkspaceSection(Section):
    """The settings of a workspace; the bounds are added per pose space."""

    reach_margin: Annotated[float | None, Quantity("m", "not negative")] = None
    conditioning_limit: Annotated[float, Quantity("1", "positive")] = 20.0
    characteristic_length: Annotated[float | None, Quantity("m", "positive")] = None


class MechanismHeader(Section):
    """The keys that every mechanism file may have, and those that decide about the others."""

    schema_version: Annotated[Literal[1], _WholeNumber] = Field(alias="schema")
    name: (
        Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_check_name)] | None
    ) = None
    chain: str
    platform: Literal["rigid", "point"] = "rigid"
    reading_unit: Literal["rad", "m"] | None = None
    symmetry: Any = None
    reference_leg: Any = None
    legs: Any = None
    workspace: Any = None
    noise: Any = None
    tolerances: Any = None
    joint_limits: Any = None
    protocol: Any = None
    measurements: Any = None


@functools.cache
def mechanism_model(chain: str, platform: str, reading_unit: str | None) -> type[MechanismHeader]:
    """Return the model of mechanism files with this chain.

    Returns
    -------
    type
        A pydantic model.

    Raises
    ------
    SymkinError
        If there is no such chain, or it cannot carry the platform.
    """
    import symkin

    info = symkin.chain_info(chain, platform)
    units = info.units_of_sensor(reading_unit or info.reading_unit)
    parameters = {name: _parameter(chain, name, unit) for name, unit in units.items()}
    title = f"{chain} {platform}"
    reference_leg = _leg_model(
        f"ReferenceLeg {title}",
        {name: Annotated[float, quantity] for name, quantity in parameters.items()},
    )
    leg = _leg_model(
        f"Leg {title}",
        {name: Annotated[Estimate, EstimateOf(quantity)] for name, quantity in parameters.items()},
    )
    fields: dict[str, tuple[Any, Any]] = {
        "chain": (Literal[chain], ...),
        "platform": (Literal[platform], ... if platform == "point" else platform),
        "symmetry": (SymmetrySection | None, None),
        "reference_leg": (reference_leg | None, None),
        "legs": (Annotated[list[leg], Field(min_length=1, max_length=_MOST_LEGS)] | None, None),  # type: ignore[valid-type]
        "workspace": (_workspace_model(info.pose_space) | None, None),
        "noise": _section(_noise_model(reading_unit or info.reading_unit)),
        "tolerances": _section(ToleranceSection),
        "joint_limits": _section(_limits_model(reading_unit or info.reading_unit)),
        "protocol": _section(ProtocolSection),
        "measurements": (MeasurementSection | None, None),
    }
    model: type[MechanismHeader] = _model(f"Mechanism {title}", MechanismHeader, fields)
    return model


def _section(model: Any) -> tuple[Any, Any]:
    """A section with defaults throughout may be left out."""
    return model, Field(default_factory=model)


def _model(title: str, base: type[Section], fields: dict[str, tuple[Any, Any]]) -> Any:
    return create_model(title, __base__=base, **fields)  # type: ignore[call-overload]


def _leg_model(title: str, parameters: dict[str, Any]) -> Any:
    mode = {"working_mode": (Annotated[Literal[-1, 1], _WholeNumber], -1)}
    return _model(title, Section, mode | {name: (kind, ...) for name, kind in parameters.items()})


def _parameter(chain: str, name: str, unit: str) -> Quantity:
    sign: Sign = "any"
    joints = chain.replace("[", "").replace("]", "")
    end = {"base_radius": joints[0], "platform_radius": joints[-1]}.get(name, "")
    if name.endswith("_length"):
        sign = "positive"
    elif name == "sensor_gain":
        sign = "not zero"
    elif name.endswith("_radius") and end != "P":
        sign = "not negative"  # a guide's distance from the centre is signed, a point's is not
    note = "active joint per sensor reading" if name == "sensor_gain" else ""
    return Quantity(unit, sign, note, direction=unit == "rad")


@functools.cache
def _workspace_model(pose_space: str) -> Any:
    coordinates = COORDINATES[pose_space]
    home = Annotated[tuple[float, ...], QuantityList(tuple(coordinates.values()))]
    bounds = {
        name: (Annotated[tuple[float, float], IntervalOf(unit)], ...)
        for name, unit in coordinates.items()
    }
    return _model(
        f"Workspace {pose_space}", WorkspaceSection, bounds | {"home": (home | None, None)}
    )


@functools.cache
def _noise_model(reading_unit: str) -> Any:
    reading = Annotated[float, Quantity(reading_unit, "not negative", "in the sensor's unit")]
    return _model("Noise", NoiseSection, {"reading": (reading, 0.0)})


@functools.cache
def _limits_model(reading_unit: str) -> Any:
    limit = Annotated[float | None, Quantity(reading_unit, note="in the sensor's unit")]
    return _model("JointLimits", Section, {"lower": (limit, None), "upper": (limit, None)})
