# SPDX-License-Identifier: MIT
"""Records as plain values and back, to the last bit: what loads is equal to what was saved.

`symkin.values.plain` is for readers: keys with units, counts from 1, no arrays of single rows. This
is for the program itself: the fields by their names, decoded by their annotations. What stands in
several places is written once, ``{"same_as": "/plan/mechanism"}`` elsewhere. A class that is not
made of its fields says in `arguments` of what it is, and may have a class method `of_arguments`.
"""

from __future__ import annotations

import base64
import dataclasses
import functools
import math
import types
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints, is_typeddict

import numpy as np

from symkin.errors import ResultsError
from symkin.storage.shipped import located, portable

_NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}  # which JSON does not have
_SHARED = "same_as"
_LARGE = 100  # values of an array that nobody reads as numbers


def encoded(value: Any) -> Any:
    """Return the JSON form of a record, or of what a record may hold.

    Of a dataclass what it is made of: its `arguments`, or else its fields, less those that are
    private and not compared.
    """
    return _Encoder().of(value, "")


class _Encoder:
    def __init__(self) -> None:
        self._places: dict[int, tuple[str, Any]] = {}  # with the value, so that it stays what it is

    def of(self, value: Any, place: str) -> Any:
        if value is None or isinstance(value, bool | int | str):
            return value
        if isinstance(value, float):
            return value if math.isfinite(value) else str(value)
        if isinstance(value, np.generic):
            return self.of(value.item(), place)
        if isinstance(value, Path):
            return portable(value)
        if isinstance(value, Mapping):
            if all(isinstance(name, str) for name in value):
                return {name: self.of(each, f"{place}/{name}") for name, each in value.items()}
            return [
                [self.of(name, place), self.of(each, f"{place}/{row}/1")]
                for row, (name, each) in enumerate(value.items())
            ]
        if isinstance(value, list | tuple):
            return [self.of(each, f"{place}/{row}") for row, each in enumerate(value)]
        if not isinstance(value, np.ndarray) and not _is_made(type(value)):
            raise ResultsError(f"a {type(value).__name__} cannot be saved")
        if id(value) in self._places:
            return {_SHARED: self._places[id(value)][0]}
        self._places[id(value)] = place, value
        if isinstance(value, np.ndarray):
            return self._array(value, place)
        arguments = getattr(value, "arguments", None) or {
            each.name: getattr(value, each.name)
            for each in dataclasses.fields(value)
            if each.init and (each.compare or not each.metadata.get("private"))
        }
        return self.of(arguments, place)

    def _array(self, value: Any, place: str) -> dict[str, Any]:
        document: dict[str, Any] = {"shape": list(value.shape), "dtype": value.dtype.str}
        if value.size > _LARGE and value.dtype.kind in "fiub":
            little = value.astype(value.dtype.newbyteorder("<"), order="C", copy=False)
            document["dtype"] = little.dtype.str
            return {**document, "base64": base64.b64encode(little.tobytes()).decode("ascii")}
        return {**document, "values": self.of(value.ravel().tolist(), place)}


def decoded(kind: Any, document: Any, classes: Mapping[type, type] | None = None) -> Any:
    """Return what was encoded of a kind, a type or an annotation; refuse anything else.

    `classes` says what is made instead of a class.
    """
    try:
        return _Decoder(classes or {}).of(kind, document, "")
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise ResultsError(f"is no {getattr(kind, '__name__', kind)}: {error}") from error


class _Decoder:
    def __init__(self, classes: Mapping[type, type]) -> None:
        self._classes = classes
        self._places: dict[str, Any] = {}

    def of(self, kind: Any, document: Any, place: str) -> Any:
        origin, inner = get_origin(kind), get_args(kind)
        if document is None or kind is Any or origin is Literal:
            return document
        if isinstance(document, dict) and document.keys() == {_SHARED}:
            return self._places[document[_SHARED]]
        if origin in (Union, types.UnionType):
            return self.of(_chosen(inner, document), document, place)
        if origin is np.ndarray or kind is np.ndarray:
            found = self._places[place] = _array(document, get_args(inner[1])[0])
            return found
        if origin in (tuple, list) or _is_sequence(origin):
            kinds = inner if origin is tuple and inner[-1] is not Ellipsis else ()
            if kinds and len(kinds) != len(document):
                raise ValueError(f"{len(document)} values; expected {len(kinds)}")
            parts = (
                self.of(kinds[row] if kinds else inner[0], each, f"{place}/{row}")
                for row, each in enumerate(document)
            )
            return list(parts) if origin is list else tuple(parts)
        if isinstance(origin, type) and issubclass(origin, Mapping):
            if isinstance(document, list):
                return {
                    self.of(inner[0], name, place): self.of(inner[1], each, f"{place}/{row}/1")
                    for row, (name, each) in enumerate(document)
                }
            return {
                name: self.of(inner[1], each, f"{place}/{name}") for name, each in document.items()
            }
        made = origin or getattr(kind, "__bound__", None) or kind  # of a type variable its bound
        if made is float:
            return _NUMBERS[document] if isinstance(document, str) else float(document)
        if made is Path:
            return located(document)
        if made in (int, str, bool):
            return made(document)
        made = self._classes.get(made, made)
        maker: Callable[..., Any] = getattr(made, "of_arguments", made)
        hints = _hints(made) | (_hints(maker) if maker is not made else {})
        arguments = {
            name: self.of(hints[name], each, f"{place}/{name}") for name, each in document.items()
        }
        found = self._places[place] = maker(**arguments)
        return found


def _is_made(kind: Any) -> bool:
    """Whether its values are written as what they are made of."""
    return dataclasses.is_dataclass(kind) or hasattr(kind, "arguments")


def _is_sequence(origin: Any) -> bool:
    return isinstance(origin, type) and origin.__name__ == "Sequence"


def _chosen(kinds: tuple[Any, ...], document: Any) -> Any:
    """The member of a union that a document is of: told apart by what JSON tells apart."""
    for kind in kinds:
        origin = get_origin(kind) or kind
        plain = isinstance(origin, type)
        if isinstance(document, str):
            # Infinite numbers are text, and text that may be one is a number.
            fits = origin in (str, Path, Literal) or (origin is float and document in _NUMBERS)
        elif isinstance(document, dict):
            of_array = origin is np.ndarray
            fits = of_array == ("shape" in document) and (
                of_array
                or _is_made(origin)
                or is_typeddict(origin)
                or (plain and issubclass(origin, Mapping))
            )
        elif isinstance(document, list):
            fits = origin in (tuple, list) or _is_sequence(origin)
        else:
            fits = origin in (float, int, bool)
        if fits:
            return kind
    raise ValueError(f"{document!r} is none of {kinds}")


def _array(document: Mapping[str, Any], annotated: Any) -> Any:
    written = np.dtype(document.get("dtype", float))
    dtype = written if annotated is Any else np.dtype(annotated)
    if "base64" in document:
        flat = np.frombuffer(base64.b64decode(document["base64"], validate=True), dtype=written)
        values = flat.astype(dtype)
    else:
        given = document["values"]
        if dtype.kind in "fc":
            given = [_NUMBERS[each] if isinstance(each, str) else each for each in given]
        values = np.array(given, dtype=dtype)
    return values.reshape(document["shape"])


@functools.cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)
