# SPDX-License-Identifier: MIT
"""What all results have in common: plain values, and the renderings of what they say.

A result is one frozen dataclass. `Result.page` describes its content once; text, HTML and the short
form are renderings of that description, and JSON comes from the fields.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Hashable, Iterable, Iterator, Mapping
from contextvars import ContextVar
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar, TypeVar, cast, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from symkin.errors import ResultsError

Array = NDArray[np.float64]
_Class = TypeVar("_Class", bound=type)
_Item = TypeVar("_Item")
_Key = TypeVar("_Key", bound=Hashable)
_Scalar = TypeVar("_Scalar", bound=np.generic)
_PLAIN = (str, int, bool, type(None))  # themselves, not what is derived from them


def field(*, unit: str = "", number: bool = False, private: bool = False, **arguments: Any) -> Any:
    """A dataclass field with what its JSON form needs.

    Parameters
    ----------
    unit : str
        Appended to its key: ``position_rms`` in m is ``position_rms_m``. In it "closure" stands for
        the object's `closure_unit`, since legs on a sphere miss closing by an angle.
    number : bool
        Whether it is an index, or some, that people count from 1.
    private : bool
        Whether `to_dict` leaves it out: it is large, or said elsewhere. What is not compared
        either is not saved.
    **arguments
        Of `dataclasses.field`.
    """
    metadata = {"unit": unit, "number": number, "private": private}
    return dataclasses.field(metadata=metadata, **arguments)


@dataclass_transform(
    frozen_default=True, eq_default=False, field_specifiers=(field, dataclasses.field)
)
def record(cls: _Class) -> _Class:
    """Make a dataclass that is frozen, and whose ``==`` and ``repr`` are those of a `Value`.

    What is no `Value` has the hash of its fields. That `dataclass` writes no methods for these for
    each class takes 0.06 s less of every command.
    Not attrs: its ``cmp_using`` stops at arrays inside tuples and mappings, so that what follows
    would stay, `import symkin` would take 14 ms more, and `dataclasses.replace` would not work.
    """
    if not issubclass(cls, Value):
        for name, method in _OF_RECORDS.items():
            if name not in cls.__dict__:
                setattr(cls, name, method)
    return cast(_Class, dataclasses.dataclass(eq=False, repr=False)(cls))


def read_only(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """The same array, which nobody can change."""
    array.flags.writeable = False
    return array


def places_of(keys: Iterable[_Key]) -> dict[_Key, list[int]]:
    """Where each key stands among all, from 0, in their order of appearance."""
    found: dict[_Key, list[int]] = {}
    for place, key in enumerate(keys):
        found.setdefault(key, []).append(place)
    return found


def evenly(count: int, most: int) -> NDArray[np.intp]:
    """At most so many places, evenly spread over `count`."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.intp))


class Value:
    """A frozen dataclass that holds arrays: they are read-only, compared by value and not printed.

    So are mappings; a copy, and what is pickled, is as fixed as the original.

    Attributes
    ----------
    derived : tuple of str
        Properties that `to_dict` has after the fields.
    """

    derived: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        """Make arrays and mappings read-only, without touching those of whoever gave them."""
        for each in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, each.name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                object.__setattr__(self, each.name, read_only(value.view()))
            elif type(value) is dict:
                object.__setattr__(self, each.name, FrozenMapping(value))

    def __setattr__(self, name: str, value: object) -> None:
        """Set a field once, as `__init__` does."""
        if name in self.__dict__ or name not in type(self).__dataclass_fields__:  # type: ignore[attr-defined]
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        self.__dict__[name] = value

    def __delattr__(self, name: str) -> None:
        """Refuse it."""
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Fix what has been copied or unpickled: arrays come out of it writeable."""
        self.__dict__.update(state)
        Value.__post_init__(self)

    def __eq__(self, other: object) -> bool:
        """Whether all fields that are compared are alike, NaN like NaN."""
        if type(other) is not type(self):
            return NotImplemented
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        names = [each.name for each in fields if each.compare]
        return all(_same(getattr(self, name), getattr(other, name)) for name in names)

    __hash__ = None  # type: ignore[assignment]  # arrays have none

    def __repr__(self) -> str:
        """Return the fields, arrays by their shapes."""
        shown = [
            f"{each.name}={_short(getattr(self, each.name))}"
            for each in dataclasses.fields(self)  # type: ignore[arg-type]
            if each.repr and not each.metadata.get("private")
        ]
        return f"{type(self).__name__}({', '.join(shown)})"

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values: dictionaries, lists, numbers, text.

        Keys end in the unit of their values (``_m``, ``_rad``); legs, rows and sets are counted
        from 1; what is not a number is None.
        """
        document: dict[str, Any] = {}
        for each in dataclasses.fields(self):  # type: ignore[arg-type]
            if each.metadata.get("private"):
                continue
            unit = each.metadata.get("unit", "")
            if "closure" in unit:
                unit = unit.replace("closure", self.closure_unit)  # type: ignore[attr-defined]
            value = plain(getattr(self, each.name), each.name)
            if each.metadata.get("number"):
                value = _counted(value)
            document[f"{each.name}_{unit}" if unit else each.name] = value
        for name in self.derived:
            document[name] = plain(getattr(self, name), name)
        return document


def _hash(self: Any) -> int:
    fields = dataclasses.fields(self)
    told = [each.name for each in fields if (each.compare if each.hash is None else each.hash)]
    return hash(tuple(getattr(self, name) for name in told))


_OF_RECORDS: Mapping[str, Any] = {
    "__hash__": _hash,
    **{name: vars(Value)[name] for name in ("__eq__", "__repr__", "__setattr__", "__delattr__")},
}


def plain(value: Any, place: str = "") -> Any:
    """Return the JSON form of a value.

    Parameters
    ----------
    value : Any
        Of numbers, text, arrays, paths, enumerations, dataclasses, and of mappings and sequences of
        these.
    place : str
        Its dotted key, for messages.

    Raises
    ------
    ResultsError
        For anything else, naming its key.
    """
    if type(value) in _PLAIN:  # most are, and matching takes a while
        return value
    match value:
        case Value():
            return value.to_dict()
        case Mapping():
            return {str(key): plain(item, f"{place}.{key}") for key, item in value.items()}
        case np.ndarray() if value.dtype.kind == "f" and np.isfinite(value).all():
            return value.tolist()
        case np.ndarray() | np.generic():
            return plain(value.tolist(), place)
        case Enum():
            return plain(value.value, place)
        case list() | tuple():
            return [plain(item, f"{place}[{index}]") for index, item in enumerate(value)]
        case float() if not math.isfinite(value):
            return None
        case None | bool() | int() | float() | str():
            return value
        case Path():
            return value.as_posix()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}
        return plain(fields, place)
    raise ResultsError(f"results{place} is a {type(value).__name__}, which has no JSON form")


def _counted(value: Any) -> Any:
    """Indices as people count them."""
    if isinstance(value, dict):
        return {key: _counted(each) for key, each in value.items()}
    if value is None:
        return None
    return [_counted(each) for each in value] if isinstance(value, list) else value + 1


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        one, other = np.asarray(one), np.asarray(other)
        return bool(np.array_equal(one, other, equal_nan=one.dtype.kind in "fc"))
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, float) and isinstance(other, float) and math.isnan(one):
        return math.isnan(other)
    return bool(one == other)


def _short(value: Any) -> str:
    """A value in a few characters."""
    if isinstance(value, np.ndarray):
        return f"<array {value.shape}>" if value.size > 8 else np.array2string(value, precision=6)
    if isinstance(value, tuple | list) and len(value) > 6:
        return f"<{len(value)} {type(value[0]).__name__}>"
    return repr(value)


@contextlib.contextmanager
def set_to(variable: ContextVar[_Item], value: _Item) -> Iterator[None]:
    """Set a variable of the context for as long as this lasts."""
    before = variable.set(value)
    try:
        yield
    finally:
        variable.reset(before)


class FrozenMapping(dict[str, _Item]):
    """A dictionary that stays as it is, and can be pickled, copied and hashed."""

    def _refuse(self, *_: object, **__: object) -> Any:
        raise TypeError("this does not change; change a copy: dict(...)")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __hash__(self) -> int:  # type: ignore[override]
        """Return a hash of names and values."""
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple[type, tuple[dict[str, _Item]]]:
        """Make it anew."""
        return FrozenMapping, (dict(self),)
