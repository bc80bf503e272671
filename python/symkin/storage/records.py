# SPDX-License-Identifier: MIT
"""Records as plain values and back, to the last bit: what loads is equal to what was saved.

`symkin.values.plain` is for readers: keys with units, counts from 1, no arrays of single rows. This
is for the program itself: the fields by their names, decoded by their annotations.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import types
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from symkin.errors import ResultsError

__all__ = ["decoded", "encoded"]

_NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}  # which JSON does not have


def encoded(value: Any) -> Any:
    """Return the JSON form of a record, or of what a record may hold.

    Of a dataclass what it is made of: its `arguments`, or else its fields.
    """
    if isinstance(value, np.ndarray):
        return {"shape": list(value.shape), "values": encoded(value.ravel().tolist())}
    if isinstance(value, np.generic):
        return encoded(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, Mapping):
        return {str(name): encoded(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [encoded(each) for each in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        arguments = getattr(value, "arguments", None) or {
            each.name: getattr(value, each.name) for each in dataclasses.fields(value) if each.init
        }
        return encoded(arguments)
    raise ResultsError(f"a {type(value).__name__} cannot be saved")


def decoded(kind: Any, document: Any, classes: Mapping[type, type] | None = None) -> Any:
    """Return what was encoded.

    Parameters
    ----------
    kind : type or annotation
        What it was.
    document : Any
        Its JSON form.
    classes : mapping of type to type, optional
        What is made instead of a class.

    Raises
    ------
    ResultsError
        For anything else than an encoded `kind`.
    """
    try:
        return _decoded(kind, document, classes or {})
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise ResultsError(f"is no {getattr(kind, '__name__', kind)}: {error}") from error


def _decoded(kind: Any, document: Any, classes: Mapping[type, type]) -> Any:
    origin, inner = get_origin(kind), get_args(kind)
    again = functools.partial(_decoded, classes=classes)
    if document is None or kind is Any or origin is Literal:
        return document
    if origin in (Union, types.UnionType):
        return again(_chosen(inner, document), document)
    if origin is np.ndarray or kind is np.ndarray:
        return _array(document, get_args(inner[1])[0])
    if origin in (tuple, list):
        if len(inner) == 2 and inner[1] is not Ellipsis:
            return tuple(again(*each) for each in zip(inner, document, strict=True))
        return tuple(again(inner[0], each) for each in document)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {name: again(inner[1], each) for name, each in document.items()}
    made = origin or getattr(kind, "__bound__", None) or kind  # of a type variable its bound
    if made is float:
        return _NUMBERS[document] if isinstance(document, str) else float(document)
    if made in (int, str, bool, Path):
        return made(document)
    hints = _hints(made)
    maker: Callable[..., Any] = classes.get(made, made)
    return maker(**{name: again(hints[name], each) for name, each in document.items()})


def _chosen(kinds: tuple[Any, ...], document: Any) -> Any:
    """The member of a union that a document is of: told apart by what JSON tells apart."""
    for kind in kinds:
        origin = get_origin(kind) or kind
        plain = isinstance(origin, type)
        if isinstance(document, str):
            # Infinite numbers are text, and text that may be one is a number.
            fits = origin in (str, Path, Literal) or (origin is float and document in _NUMBERS)
        elif isinstance(document, dict):
            fits = (
                dataclasses.is_dataclass(origin)
                or (plain and issubclass(origin, Mapping))
                or (origin is np.ndarray and document.keys() == {"shape", "values"})
            )
        elif isinstance(document, list):
            fits = origin in (tuple, list)
        else:
            fits = origin in (float, int, bool)
        if fits:
            return kind
    raise ValueError(f"{document!r} is none of {kinds}")


def _array(document: Mapping[str, Any], dtype: Any) -> Any:
    values = [_NUMBERS[each] if isinstance(each, str) else each for each in document["values"]]
    return np.array(values, dtype=dtype).reshape(document["shape"])


@functools.cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)
