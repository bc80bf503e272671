# SPDX-License-Identifier: MIT
"""What a mechanism file may say.

A kind says how a TOML value is read and how JSON Schema describes it. The keys of a leg and of the
workspace depend on the chain, so a whole file is described for one chain, platform and reading
unit. ``python -m symkin.files.mechanism_schema`` prints the JSON Schema, for editors that complete
and check TOML.
"""

from __future__ import annotations

import functools
import itertools
import json
import math
import re
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from symkin.data.sensor_tables import MOST_ROWS
from symkin.errors import QuantityError, printable
from symkin.files.declared_forms import DYAD_KEYS
from symkin.model.chains import PLATFORMS, ChainInfo, chain_info, chains
from symkin.model.file_frames import point_parameters
from symkin.model.poses import POSE_SPACES
from symkin.model.settings import (
    DIRECTIONS,
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)
from symkin.options import OPTIONS, Option, Platform, Prior
from symkin.storage.quantities import counts_steps, evaluate_quantity, unit_factor
from symkin.storage.toml_file import (
    Kind,
    Schema,
    Sign,
    WrongValueError,
    boolean,
    check_keys,
    choice,
    estimate,
    list_of,
    one_or_list,
    quantity,
    read_at,
    schema_version,
    table,
    text,
    whole,
)
from symkin.values import Array

# More would be slow beyond use, and no such mechanism is known.
_MOST_LEGS = 64
ENDS = ("base", "platform")
_ROUNDING = 1e-6  # of correlations that are typed


def _limit(unit: str) -> Kind:
    """A reading; inf or -inf where a leg has no such limit."""
    finite = quantity(unit, note="in the sensor's unit, inf or -inf for none")
    return Kind(
        lambda raw: raw if raw in (math.inf, -math.inf) else finite.read(raw), finite.schema
    )


def _coordinates(*units: str) -> Kind:
    """A list of quantities, each in its own unit."""
    kinds = [quantity(unit, direction=unit == "rad") for unit in units]
    return _row(kinds, ", ".join(units))


def _or_nowhere(place: Kind) -> Kind:
    """A place, or an empty list for one that nobody knows."""

    def read(raw: Any) -> tuple[float, ...]:
        return () if raw == [] else place.read(raw)

    return Kind(read, {"anyOf": [place.schema, {"type": "array", "maxItems": 0}]})


def _or_bowed(flat: Kind) -> Kind:
    """The plane of a bed, or that with its bow and the radius of its rim."""
    bowed = _coordinates("m", "1", "1", "m", "m")

    def read(raw: Any) -> tuple[float, ...]:
        kind = bowed if isinstance(raw, list) and len(raw) > 3 else flat
        found: tuple[float, ...] = kind.read(raw)
        if len(found) > 3 and not found[-1] > 0:
            raise QuantityError(f"is {raw}; expected the radius of the rim above zero, last")
        return found

    return Kind(read, {"anyOf": [flat.schema, bowed.schema]})


def _row(kinds: Sequence[Kind], units: str) -> Kind:
    """A list of so many values, each of its own kind."""
    count = len(kinds)

    def read(raw: Any) -> tuple[float, ...]:
        if not isinstance(raw, list) or len(raw) != count:
            found = f"{len(raw)} values" if isinstance(raw, list) else f"{raw!r}, no list"
            raise QuantityError(f"has {found}; expected {count}, in {units}")
        return tuple(kind.read(item) for kind, item in zip(kinds, raw, strict=True))

    items = [kind.schema for kind in kinds]
    return Kind(read, {"type": "array", "prefixItems": items, "minItems": count, "maxItems": count})


def _interval(unit: str) -> Kind:
    """``[lower, upper]``."""
    both = _coordinates(unit, unit)

    def read(raw: Any) -> tuple[float, float]:
        lower, upper = both.read(raw)
        if lower > upper:
            raise QuantityError(f"is {raw}; expected the lower bound first")
        return lower, upper

    return Kind(read, both.schema)


def _estimate(unit: str, value: Kind) -> Kind:
    """A quantity, or ``{ value = ..., standard_deviation = ... }``; NaN where there is none."""
    both = estimate(value, {"standard_deviation": quantity(unit, "not negative")})

    def read(raw: Any) -> tuple[float, float]:
        made = both.read(raw)
        return made["value"], made.get("standard_deviation", math.nan)

    return Kind(read, both.schema)


def _whole(option: Option) -> Kind:
    """A whole number, as the option of this name is."""
    assert option.least is not None  # and neither is most
    assert option.most is not None
    return whole(int(option.least), int(option.most))


def _check_name(name: str) -> str:
    if not name:
        raise WrongValueError("is empty; expected a name")
    if not name.isprintable():
        raise WrongValueError(f"is {printable(name)!r}; expected characters that can be printed")
    return name


def _check_group(group: str) -> str:
    named = re.fullmatch("C([1-9][0-9]*)v", group, re.ASCII)
    group = f"D{named[1]}" if named else group  # as Schoenflies calls it
    number = re.fullmatch("[CD]([1-9][0-9]*)", group, re.ASCII)
    if not number:
        raise WrongValueError(
            f'is "{group}"; expected C (rotations) or D (rotations and reflections) and the number '
            'of rotations, such as "C3" or "D3"'
        )
    if len(number[1]) > len(str(_MOST_LEGS)) or int(number[1]) > _MOST_LEGS:
        raise WrongValueError(f'is "{group}"; expected at most {_MOST_LEGS} rotations')
    return group


def _prior(raw: Any) -> Any:
    """The word, or a standard deviation for each pattern."""
    if isinstance(raw, dict):
        return _assumed(raw)
    return choice(*get_args(Prior)).read(raw)


def _assumed(raw: Any) -> Any:
    """A standard deviation for each name or pattern."""
    if not isinstance(raw, dict):
        raise WrongValueError("is not a table of standard deviations; expected one")
    number = Kind(_number_or_text, {})
    return {name: read_at(name, number, each) for name, each in raw.items()}


def _number_or_text(raw: Any) -> float | str:
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise WrongValueError(f"is {raw!r}; expected a standard deviation")
    return raw if isinstance(raw, str) else float(raw)


def _names(raw: Any) -> dict[str, str]:
    if not isinstance(raw, dict):
        raise WrongValueError("is not a table of keys; expected one")
    return {name: read_at(name, text(), column) for name, column in raw.items()}


def _angle_or_direction() -> Kind:
    """An angle about Z, or three numbers that have a direction."""
    angle, direction = quantity("rad", direction=True), _coordinates("1", "1", "1")

    def read(raw: Any) -> Any:
        return direction.read(raw) if isinstance(raw, list) else angle.read(raw)

    return Kind(read, {"anyOf": [angle.schema, direction.schema]})


_SYMMETRY = table(
    {
        "group": text(check=_check_group),
        "legs": whole(1, _MOST_LEGS),
        "axis": _angle_or_direction(),
        "mirror": _coordinates("1", "1", "1"),
        "centre": _coordinates("m", "m", "m"),
        "elements": list_of(text()),
    },
    ("group",),
)
_TOLERANCES = table(
    {
        "length": quantity("m", "positive"),
        "angle": quantity("rad", "positive"),
        "gain": quantity("1", "positive", "relative to the gain"),
    },
    settings=Tolerances,
)
PROTOCOL = table(
    {name: _whole(OPTIONS[name]) for name in ("pose_count", "candidates", "seed")},
    settings=ProtocolSettings,
)
MEASUREMENTS = table(
    {
        "position": list_of(text()),
        "readings": list_of(text()),
        "angle": text(),
        "quaternion": list_of(text()),
        "rotation_vector": list_of(text()),
        "position_unit": text(),
        "orientation_unit": text(),
        "reading_unit": text(),
        "leg": text(),
        "robot": text(),
        "names": Kind(_names, {"type": "object", "additionalProperties": {"type": "string"}}),
    },
    ("readings",),
    MeasurementColumns,
)
_PATTERNS = list_of(text(200))
_DEVIATIONS: Schema = {"type": "object", "additionalProperties": {"type": ["number", "string"]}}
IDENTIFICATION = table(
    {
        "free": _PATTERNS,
        "fixed": _PATTERNS,
        "shared": _PATTERNS,
        "tie": list_of(text(1000)),
        "prior": Kind(
            _prior,
            {
                "anyOf": [
                    {"enum": list(get_args(Prior))},
                    _DEVIATIONS,
                ]
            },
        ),
        "frames": list_of(choice(*OPTIONS["frames"].words)),
        **{name: choice(*OPTIONS[name].words) for name in ("sensor", "gauge", "loss_per")},
        "noise": choice("estimate"),
        "drift": list_of(choice(*OPTIONS["drift"].words)),
        "step": list_of(text(40)),
        "growth": boolean(),
        "backlash": boolean(),
        "clock_offset": boolean(),
        "bow": quantity("m", "positive"),
        "sessions": list_of(choice(*OPTIONS["sessions"].words)),
        "of": choice(*OPTIONS["of"].words),
    }
)
_DEVICE = table(
    {
        "kind": text(200),
        "distance": quantity("m", "not negative"),
        "visit": choice(*OPTIONS["visit"].words),
    },
    ("kind",),
)
_SECTIONS = (
    "symmetry", "reference_leg", "reference_legs", "legs", "workspace", "device", "noise",
    "tolerances", "joint_limits", "protocol", "measurements", "frames", "identification", "assumed",
    "sensor_table",
)  # fmt: skip


class ReadingUnit(NamedTuple):
    """What sensors read, and how much of it a step or count is, if the file says that."""

    unit: str
    step: float | None = None


def _reading_unit(raw: Any) -> ReadingUnit:
    if raw in ("rad", "m"):
        return ReadingUnit(raw)
    if isinstance(raw, str) and counts_steps(raw):
        try:
            evaluate_quantity(raw, "rad/step")
        except QuantityError:
            return ReadingUnit("m", unit_factor(raw, "m"))
        return ReadingUnit("rad", unit_factor(raw, "rad"))
    raise WrongValueError(
        f"is {raw!r}; expected 'rad' or 'm', or the size of a step such as '1/80 mm/step'"
    )


_STEP_SCHEMA = {"type": "string", "pattern": "(step|count)", "description": "size of a step"}
# The keys that every file may have, and those that decide about the others.
_HEADER_KINDS: dict[str, Kind] = {
    "schema": schema_version(1),
    "name": text(200, _check_name),
    "chain": text(),
    "platform": choice(*PLATFORMS),
    "reading_unit": Kind(_reading_unit, {"anyOf": [{"enum": ["rad", "m"]}, _STEP_SCHEMA]}),
    "reading_wraps": boolean(),
}
HEADER = table(_HEADER_KINDS | dict.fromkeys(_SECTIONS, Kind(lambda raw: raw, {})), ("schema",))


def noise_kinds(unit: str) -> dict[str, Kind]:
    """What [noise] may have, and the option of its name; `unit` is that of the readings."""
    return {
        "position": quantity("m", "not negative"),
        "orientation": quantity("rad", "not negative"),
        "reading": quantity(unit, "not negative", "in the sensor's unit"),
        "per_metre": quantity("1", "not negative", "m of position for each m from the device"),
        "along": quantity("m", "not negative", "of a position along the direction"),
        "along_per_metre": quantity("1", "not negative", "m along it for each m from the device"),
        "direction": choice(*DIRECTIONS),
    }


@functools.cache
def mechanism_table(
    chains: tuple[str, ...], platform: str, reading_unit: str, default: str | None
) -> Kind:
    """Describe the files of mechanisms with legs of these chains, of a platform and a reading unit.

    Legs that name no chain have the `default`.

    Raises
    ------
    SymkinError
        If there is no such chain, or it cannot carry the platform.
    """
    infos = [chain_info(chain, platform) for chain in chains]
    info, unit = infos[0], reading_unit
    reference = _leg_of_chains(infos, unit, default, listed=False)
    space = POSE_SPACES[info.pose_space]
    coordinates = info.box
    limit = one_or_list(_limit(unit), 1, _MOST_LEGS)
    noise = table(noise_kinds(unit), settings=NoiseSettings)
    sections: dict[str, Kind] = {
        "chain": choice(*chains),
        "platform": choice(platform),
        "symmetry": _SYMMETRY,
        "reference_leg": reference,
        "reference_legs": list_of(reference, 1, _MOST_LEGS),
        "legs": list_of(_leg_of_chains(infos, unit, default, listed=True), 1, _MOST_LEGS),
        "workspace": _workspace(coordinates, space.closure_unit),
        "device": _DEVICE,
        "noise": noise,
        "tolerances": _TOLERANCES,
        "joint_limits": table({"lower": limit, "upper": limit}, settings=JointLimits),
        "protocol": PROTOCOL,
        "measurements": MEASUREMENTS,
    }
    place = ("m",) * space.size
    frame = _coordinates(*place, *("rad",) * (len(space.frame_components) - len(place)))
    frames = {"base": frame, "target": frame}
    if space.moves:
        frames["anchors"] = list_of(_coordinates(*place))
        frames["zeros"] = list_of(quantity("m"))
        frames["points"] = list_of(_or_nowhere(_coordinates(*place)))
    if space.size == 3:
        frames["plane"] = _or_bowed(_coordinates("m", "1", "1"))
    ends = dict.fromkeys(end for each in infos for end in ends_of(each))
    frames |= {f"{end}_centre": _coordinates(*place) for end in ends}
    # ``[shown, straight]`` of a sensor, of any number of turns.
    rows = list_of(list_of(quantity(unit), 2, 2), 2, MOST_ROWS)
    sections |= {
        "frames": table(frames),
        "identification": IDENTIFICATION,
        "assumed": Kind(_assumed, _DEVIATIONS),
        "sensor_table": table({"file": text(), "rows": rows, "legs": list_of(rows, 1, _MOST_LEGS)}),
    }
    required = ("schema",) + (("chain",) if default is not None else ())
    required += ("platform",) if platform != "rigid" else ()
    return table(_HEADER_KINDS | sections, required)


def _workspace(coordinates: Mapping[str, str], closure_unit: str) -> Kind:
    return table(
        {name: _interval(unit) for name, unit in coordinates.items()}
        | {
            "home": _coordinates(*coordinates.values()),
            "reach_margin": quantity(closure_unit, "not negative"),
            "conditioning_limit": quantity("1", "positive"),
            "characteristic_length": quantity("m", "positive"),
        },
        tuple(coordinates),
        WorkspaceSettings,
    )


def _leg_of_chains(
    infos: Sequence[ChainInfo], unit: str, default: str | None, *, listed: bool
) -> Kind:
    """A leg's table, whose keys are those of its chain; values have deviations where `listed`."""
    kinds = {info.name: _leg(info, unit, listed=listed) for info in infos}

    def read(raw: Any) -> Any:
        given = raw.get("chain", default) if isinstance(raw, dict) else default
        made = kinds[given if given in kinds else infos[0].name].read(raw)
        return {"chain": given, **made}

    schemas = [kind.schema for kind in kinds.values()]
    return Kind(read, schemas[0] if len(schemas) == 1 else {"anyOf": schemas})


def _leg(info: ChainInfo, unit: str, *, listed: bool) -> Kind:
    units = info.units_of_sensor(unit)
    parameters = {name: _parameter(info, name, units[name]) for name in units}
    others: dict[str, Kind] = {"chain": choice(info.name), "working_mode": choice(-1, 1)}
    if not listed:
        return _leg_kind(info, parameters, others, estimated=False)
    joint = units["sensor_offset"]
    # Plain numbers: the quadratic term's unit is one that expressions do not know.
    others |= {f"sensor_{term}": quantity("1", note=each) for term, each in (
        ("quadratic", f"{joint} per square of the reading"),
        ("cosine", joint),
        ("sine", joint),
    )}  # fmt: skip
    estimates = {name: _estimate(units[name], kind) for name, kind in parameters.items()}
    return _leg_kind(info, estimates, others, estimated=True)


def _parameter(info: ChainInfo, name: str, unit: str) -> Kind:
    sign: Sign = "any"
    kind = info.parameter_roles[name].kind
    if kind in ("length", "arc"):
        sign = "positive"
    elif kind == "gain":
        sign = "not zero"
    # A guide's distance is signed.
    elif kind == "pulley_radius" or (kind == "radius" and not info.signed_radius):
        sign = "not negative"
    note = "active joint per sensor reading" if kind == "gain" else ""
    if name in info.defaults:
        note = f"held; by default {info.defaults[name]}"
    return quantity(unit, sign, note, direction=unit == "rad")


def ends_of(info: ChainInfo) -> dict[str, dict[str, str]]:
    """The ends that are points, with the names of their parameters by kind."""
    found = {end: point_parameters(info, end) for end in ENDS}
    return {end: names for end, names in found.items() if names}


def _leg_kind(
    info: ChainInfo, parameters: Mapping[str, Kind], others: Mapping[str, Kind], *, estimated: bool
) -> Kind:
    """A leg's table, with each of its points by parameters or by coordinates.

    Where `estimated`, coordinates may have standard deviations.
    """
    ends = ends_of(info)
    forms: dict[tuple[str, ...], Kind] = {}
    for drawn in itertools.chain(*(itertools.combinations(ends, n) for n in range(len(ends) + 1))):
        replaced = {name for end in drawn for name in ends[end].values()}
        kinds = {name: kind for name, kind in parameters.items() if name not in replaced}
        points = {f"{end}_point": _point(len(ends[end]), estimated) for end in drawn}
        # The azimuth that a direction is given from is by default that of the base point, which
        # is about a centre that the user has not seen.
        free = () if "base" in drawn else tuple(info.defaults)
        needed = tuple(name for name in (*kinds, *points) if name not in free)
        forms[drawn] = table({**others, **kinds, **points}, needed)

    known = (*others, *parameters, *(f"{end}_point" for end in ends))

    def read(raw: Any) -> Any:
        keys = raw if isinstance(raw, dict) else {}
        given = [end for end in ENDS if f"{end}_point" in keys]
        for end in given:
            if end not in ends:
                raise WrongValueError(_without_point(info, end), (f"{end}_point",))
            for name in ends[end].values():
                if name in raw:
                    raise WrongValueError(
                        f"stands beside {end}_point; expected one of the two", (name,)
                    )
        check_keys(keys, known)
        return forms[tuple(end for end in ends if end in given)].read(raw)

    schemas = [form.schema for form in forms.values()]
    schema: Schema = schemas[0] if len(schemas) == 1 else {"anyOf": schemas}
    return Kind(read, schema)


def _without_point(info: ChainInfo, end: str) -> str:
    if end == "platform" and info.pose_space == "translating":
        return (
            "a platform that never turns has no points of its own; expected base_point alone, "
            "less the platform's point"
        )
    if end == "platform" and info.pose_space == "point":
        return "the platform is a point itself; expected base_point alone"
    return f"the {end} end of {info.name} is a guide, not a point; expected its parameters"


def _point(size: int, estimated: bool) -> Kind:
    """Coordinates, or a table of them with their standard deviations and correlations."""
    value = _numbers("m", size)
    if not estimated:
        return Kind(lambda raw: {"value": value.read(raw)}, value.schema)
    errors = {
        "standard_deviation": _numbers("m", size, "not negative; nan where it is held", nan=True),
        "correlation": _numbers("1", size * (size - 1) // 2, "xy, or xy, xz, yz"),
    }
    whole = estimate(value, errors)

    def read(raw: Any) -> dict[str, tuple[float, ...]]:
        made: dict[str, tuple[float, ...]] = whole.read(raw)
        if any(each < 0 for each in made.get("standard_deviation", ())):
            raise QuantityError(f"has standard_deviation {raw['standard_deviation']}; not negative")
        if "correlation" in made:
            matrix = covariance_of(np.ones(size), made["correlation"])
            if np.linalg.eigvalsh(matrix)[0] < -_ROUNDING:
                raise QuantityError(
                    f"has correlation {raw['correlation']}; expected -1 to 1, and such as errors "
                    "can have together"
                )
        return made

    return Kind(read, whole.schema)


def _numbers(unit: str, count: int, note: str = "", *, nan: bool = False) -> Kind:
    kind = quantity(unit, note=note)

    def read(raw: Any) -> Any:
        return math.nan if nan and isinstance(raw, float) and math.isnan(raw) else kind.read(raw)

    return _row([Kind(read, kind.schema)] * count, unit)


def covariance_of(deviations: ArrayLike, correlation: Sequence[float]) -> Array:
    """Covariance by standard deviations, NaN for none, and the upper triangle of correlations."""
    sigma = np.nan_to_num(np.array(deviations))
    matrix = np.eye(len(sigma))
    if len(correlation):
        upper = np.triu_indices(len(sigma), 1)
        matrix[upper] = correlation
        matrix.T[upper] = correlation
    return np.asarray(matrix * np.outer(sigma, sigma))


# Kinds of poses, and a known chain whose files have the sections of those that declare legs.
_LIKE_DECLARED: tuple[tuple[str, Platform, str], ...] = (
    ("planar", "rigid", "[R]RR"),
    ("spatial", "rigid", "U[P]S"),
    ("point", "point", "[R]RR"),
    ("translating", "translating", "[P]US"),
    ("spherical", "spherical", "[R]RR"),
    ("schoenflies", "rigid", "U[P]S"),
)
_RIGID = ("planar", "spatial")  # pose spaces of rigid platforms, which need no word in a file
_NUMBER: Schema = {"type": ["number", "string"]}
_WORDS: Schema = {"type": "array", "items": {"type": "string"}}


def _declared_schema(pose_space: str, platform: Platform, like: str) -> Schema:
    """Files that declare their legs: the parameters of a leg are known to these alone."""
    known = mechanism_table((like,), platform, "rad", None).schema["properties"]
    space = POSE_SPACES[pose_space]
    box = _workspace(space.units, space.closure_unit).schema["properties"]
    values: Schema = {"type": "array", "items": _NUMBER}  # as many as are free
    home = _object({"position": values} | dict.fromkeys(space.rotation, _NUMBER))
    box |= {"home": {"anyOf": [values, home]}, "free": _WORDS}
    if pose_space == "spatial":
        box |= {"tilt": _NUMBER}
    noise = known["noise"]["properties"]
    reading = {"anyOf": [noise["reading"], {"type": "object"}]}
    step = {"type": ["string", "object"]}
    path = {"type": "array", "items": step}
    steps = {"anyOf": [path, {"type": "array", "items": path}]}
    tables = {"type": "array", "items": {"type": "object"}}
    chain = {
        "path": steps,
        "platform_path": steps,
        "rods": tables,
        "loops": tables,
        "closes": {"enum": ["pose", "point", "rotation"]},
        "home": {"type": "object"},
        "pose": values,
        "free": _WORDS,
    }
    leg = {"type": "object", "properties": {"chain": {"type": "string"}}}
    legs = {"type": "array", "items": leg}
    own = {
        "schema": {"enum": [1, 2]},
        "chain": {"type": "string"},
        "platform": {"enum": [pose_space, *(["rigid"] if pose_space in _RIGID else [])]},
        "chains": {"type": "object", "additionalProperties": _object(chain)},
        "reference_leg": leg,
        "reference_legs": legs,
        "legs": legs,
        "workspace": _object(box),
        "noise": _object(noise | {"tilt": _NUMBER, "reading": reading}),
        "observation": _object(
            {"measured": {"type": ["string", "array"]}, "datum": {"type": "object"}}
        ),
    }
    required = ["schema", "chains", *(["platform"] if pose_space not in _RIGID else [])]
    return _object(known | own) | {"required": required}


def _dyad_schema() -> Schema:
    """Files with a planar dyad of several readings by its chain's name and parameters."""
    known = _declared_schema("planar", "rigid", "[R]RR")
    keys = dict.fromkeys(DYAD_KEYS, _NUMBER) | {"home": {"type": "object"}}
    leg = _object(keys) | {"required": [name for name in DYAD_KEYS if name != "home"]}
    own = {"chain": {"const": "[R][R]R"}, "reference_leg": leg}
    names = [name for name in known["properties"] if name not in ("chains", "legs")]
    properties = {name: known["properties"][name] for name in names} | own
    return _object(properties) | {"required": ["schema", "chain", "reference_leg"]}


def _object(properties: Schema) -> Schema:
    return {"type": "object", "properties": properties, "additionalProperties": False}


def mechanism_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of mechanism files.

    One alternative per chain, one for the mixed legs of every kind of platform, and one for
    declared legs of every kind of poses.

    Returns
    -------
    dict
    """
    files, alike = [], defaultdict[tuple[str, str], list[str]](list)
    for platform in PLATFORMS:
        for chain in chains(platform):
            info = chain_info(chain, platform)
            files.append(mechanism_table((chain,), platform, info.reading_unit, chain).schema)
            if info.closures == 1:
                alike[platform, info.pose_space].append(chain)
    files += [
        mechanism_table(tuple(mixed), platform, "rad", None).schema
        for (platform, _), mixed in alike.items()
        if len(mixed) > 1
    ]
    files += [_declared_schema(*each) for each in _LIKE_DECLARED]
    files.append(_dyad_schema())
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "symkin mechanism file",
        "anyOf": files,
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(mechanism_schema(), indent=1) + "\n")
