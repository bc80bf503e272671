# SPDX-License-Identifier: MIT
"""Checking a TOML file against a pydantic model, with errors in the file's own terms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from symkin.errors import did_you_mean
from symkin.io.toml_source import KeyPath, TomlSource, at

__all__ = ["Section", "validate"]

_Model = TypeVar("_Model", bound=BaseModel)


class Section(BaseModel):
    """A table of a file: unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def validate(source: TomlSource, model: type[_Model], keys: KeyPath = ()) -> _Model:
    """Check the values below `keys` against a model.

    Raises
    ------
    MechanismFileError
        At the first wrong key. A misspelt key is reported rather than the key that is missing
        because of it.
    """
    try:
        return model.model_validate(at(source.values, keys))
    except ValidationError as error:
        faults = error.errors(include_url=False)
        fault = min(faults, key=lambda fault: fault["type"] != "extra_forbidden")
        place = keys + tuple(fault["loc"])
        if fault["type"] not in ("extra_forbidden", "missing"):
            place = source.existing(place)
        raise source.error(place, _explained(model, fault)) from error


def _explained(model: type[BaseModel], fault: ErrorDetails) -> str:
    context = fault.get("ctx", {})
    match fault["type"]:
        case "extra_forbidden":
            *place, name = fault["loc"]
            return f"unknown key{did_you_mean(str(name), _names_allowed_at(model, place))}"
        case "missing":
            return "this key is missing"
        case "model_type":
            return "is not a table of keys; expected one"
        case "list_type":
            return "is not a list; expected one"
        case "value_error":
            return str(context["error"])
        case "literal_error":
            return f"is {fault['input']!r}; expected {context['expected']}"
        case _:
            expectation = fault["msg"].replace("Input should be", "expected")
            return f"is {fault['input']!r}; {expectation[0].lower()}{expectation[1:]}"


def _names_allowed_at(model: type[BaseModel], place: list[int | str]) -> list[str]:
    """Names of the keys, as the file writes them, of the table at `place`."""
    for key in place:
        if isinstance(key, str):
            by_name = {field.alias or name: field for name, field in model.model_fields.items()}
            model = next(_models_in(by_name[key].annotation))
    return [field.alias or name for name, field in model.model_fields.items()]


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """The models in ``Model``, ``Model | None`` or ``list[Model]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in getattr(annotation, "__args__", ()):
        yield from _models_in(argument)
