# SPDX-License-Identifier: MIT
"""Points by coordinates in a mechanism file: how they are read, and written back."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.chains import ChainInfo
from symkin.drawing import cartesian, centres, jacobian, point_parameters, polar, split_covariance
from symkin.errors import QuantityError, did_you_mean
from symkin.io.toml_file import Kind, Schema, TomlSource, WrongValueError, estimate, quantity, table
from symkin.mechanism import Mechanism
from symkin.settings import DrawnPoints

Array = NDArray[np.float64]
_Values = dict[str, Any]
_ENDS = ("base", "platform")
_ROUNDING = 1e-6  # of correlations that are typed


def ends_of(info: ChainInfo) -> dict[str, dict[str, str]]:
    """The ends that are points, with the names of their parameters by kind."""
    found = {end: point_parameters(info, end) for end in _ENDS}
    return {end: names for end, names in found.items() if names}


def leg_kind(
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
        given = [end for end in _ENDS if f"{end}_point" in keys]
        for end in given:
            if end not in ends:
                raise WrongValueError(_without_point(info, end), (f"{end}_point",))
            for name in ends[end].values():
                if name in raw:
                    raise WrongValueError(
                        f"stands beside {end}_point; expected one of the two", (name,)
                    )
        for name in keys:
            if name not in known:
                raise WrongValueError(f"unknown key{did_you_mean(name, known)}", (name,))
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
            matrix = _covariance(np.ones(size), made["correlation"])
            if np.linalg.eigvalsh(matrix)[0] < -_ROUNDING:
                raise QuantityError(
                    f"has correlation {raw['correlation']}; expected -1 to 1, and such as errors "
                    "can have together"
                )
        return made

    return Kind(read, whole.schema)


def _numbers(unit: str, count: int, note: str = "", *, nan: bool = False) -> Kind:
    kind = quantity(unit, note=note)

    def read(raw: Any) -> tuple[float, ...]:
        if not isinstance(raw, list) or len(raw) != count:
            found = f"{len(raw)} values" if isinstance(raw, list) else f"{raw!r}, no list"
            raise QuantityError(f"has {found}; expected {count}, in {unit}")
        return tuple(
            math.nan if nan and isinstance(each, float) and math.isnan(each) else kind.read(each)
            for each in raw
        )

    items = {"type": "array", "items": kind.schema, "minItems": count, "maxItems": count}
    return Kind(read, items)


def read_points(
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
    ends = {}
    for end in _ENDS:
        if any(f"{end}_point" in leg for leg in legs):
            ends[end] = [ends_of(info).get(end, {}) for info in infos]
    given = {end: frames.get(f"{end}_centre") for end in _ENDS}
    for end, centre in given.items():
        if centre is None:
            continue
        if end not in ends:
            raise source.error(
                ("frames", f"{end}_centre"), f"goes with {end}_point, which no leg has"
            )
        if any(centre) and not all(ends[end]):
            raise source.error(
                ("frames", f"{end}_centre"),
                f"goes with legs whose {end} ends are all points; leg "
                f"{ends[end].index({}) + 1} ({infos[ends[end].index({})].name}) has a guide, which "
                "is given about the origin as the others are",
            )
    if not ends:
        return legs, None
    for end, names in ends.items():
        _require_everywhere(source, section, legs, end, names)
    points = {
        end: np.array(
            [
                leg[f"{end}_point"]["value"]
                if f"{end}_point" in leg
                else [np.nan] * max(map(len, names))
                for leg in legs
            ]
        )
        for end, names in ends.items()
    }
    # A guide is given about the origin, and points beside it are too.
    fixed = {
        end: np.zeros(each.shape[1])
        for end, each in points.items()
        if not listed or np.isnan(each).any()
    }
    fixed |= {end: np.array(given[end]) for end in ends if given[end] is not None}
    about = fixed
    if len(fixed) < len(ends):
        known = [
            {name: leg[name][0] for name in info.parameter_names if name in leg}
            for leg, info in zip(legs, infos, strict=True)
        ]
        about = centres(infos, known, [leg.get("working_mode", -1) for leg in legs], points, fixed)
    made = [
        {name: value for name, value in leg.items() if not name.endswith("_point")} for leg in legs
    ]
    correlations = {}
    for end, names in ends.items():
        matrices = []
        for number, (leg, own_names) in enumerate(zip(legs, names, strict=True)):
            if not own_names:
                matrices.append(np.empty((0, 0)))
                continue
            values = polar(points[end][number] - about[end], own_names)
            own = {kind: float(each) for kind, each in values.items()}
            deviations, matrix = _errors_of_parameters(own, leg[f"{end}_point"])
            matrices.append(matrix)
            for (kind, name), deviation in zip(own_names.items(), deviations, strict=True):
                made[number][name] = (own[kind], deviation) if listed else own[kind]
        if any(np.any(matrix != np.eye(len(matrix))) for matrix in matrices):
            correlations[end] = tuple(tuple(map(tuple, matrix.tolist())) for matrix in matrices)
    base, platform = (tuple(about[end].tolist()) if end in about else None for end in _ENDS)
    return made, DrawnPoints(base, platform, correlations=correlations)


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
    covariance = _covariance(point["standard_deviation"], point.get("correlation", ()))
    inverse = np.linalg.pinv(jacobian(values))
    return split_covariance(inverse @ covariance @ inverse.T)


def _covariance(deviations: ArrayLike, correlation: Sequence[float]) -> Array:
    sigma = np.nan_to_num(np.array(deviations))
    matrix = np.eye(len(sigma))
    if len(correlation):
        upper = np.triu_indices(len(sigma), 1)
        matrix[upper] = correlation
        matrix.T[upper] = correlation
    return np.asarray(matrix * np.outer(sigma, sigma))


def point_value(mechanism: Mechanism, leg: int, end: str) -> Any:
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
